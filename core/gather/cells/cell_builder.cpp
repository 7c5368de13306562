// SPDX-License-Identifier: Apache-2.0
// Groups triangles into planes, lays squares over them, and divides these into cells.
#include "gather/cells/cell_builder.h"

#include <algorithm>
#include <array>

#include "base/random.h"

namespace deltalux::gather {
namespace {

constexpr double kFlatAngle = 0x1p-10;  // of components: normals of one plane differ by less
// offsets of planes are compared in units of this share of the edge
constexpr double kFlatOffset = 0x1p-6;
constexpr double kMinFlat = 0.5;   // of a square: smaller planes are merged with others
constexpr double kMinPart = 1e-5;  // of a square: parts with less area are dropped
constexpr size_t kMaxFrames = 32;  // tried for a plane
// a later edge's frame must be smaller by this factor; otherwise the longest edge's is kept
constexpr double kTighter = 0.999;
constexpr double kFar = std::numeric_limits<double>::infinity();
// use a table unless it would have this many times more squares than are used
constexpr double kMaxEmpty = 8;
constexpr float kLift = 4;  // multiples of position_slack(), see Coverage

uint64_t rounded(double x) { return uint64_t(int64_t(std::llround(x))); }

}  // namespace

uint32_t CellBuilder::add_cell(BodyCells& out, double area, uint32_t material) {
  out.area_.push_back(float(area));
  out.material_.push_back(material);
  out.spot_.emplace_back();
  return uint32_t(out.area_.size() - 1);
}

double CellBuilder::longest_edge(uint32_t triangle) const {
  double longest = 0;
  for (int k = 0; k < 3; ++k)
    longest = std::max(longest, length(corner(triangle, (k + 1) % 3) - corner(triangle, k)));
  return longest;
}

void CellBuilder::build(BodyCells& out) {
  out.faces_.assign(triangles_.size(), {{}, kNoCell, kNoCell});
  std::vector<uint32_t> small;
  std::vector<Flat> large;
  std::vector<PlaneSize> sizes;
  for (Flat& flat : find_flats()) {
    if (flat.longest > edge_ || flat.area > kMinFlat * edge_ * edge_)
      large.push_back(std::move(flat));
    else
      small.insert(small.end(), flat.triangles.begin(), flat.triangles.end());
  }
  for (const Flat& flat : large) sizes.push_back({flat.triangles, flat.area});
  const std::vector<double> edges = square_edges(sizes, edge_, distance_);
  for (size_t i = 0; i < large.size(); ++i) make_patch(out, large[i], edges[i]);
  std::sort(small.begin(), small.end());
  merge_small(out, small);
  find_cuts(out);
  make_cells(out);
}

std::vector<CellBuilder::Flat> CellBuilder::find_flats() {
  std::vector<Flat> flats;
  std::unordered_map<uint64_t, std::vector<std::pair<std::array<uint64_t, 5>, uint32_t>>> by_hash;
  for (uint32_t t = 0; t < triangles_.size(); ++t) {
    step();
    const Vec3d c = across(t);
    const double twice = length(c);
    if (!(twice > 0) || !std::isfinite(1 / twice)) continue;
    const Vec3d n = c * (1 / twice);
    const std::array<uint64_t, 5> key{
        rounded(n.x / kFlatAngle), rounded(n.y / kFlatAngle), rounded(n.z / kFlatAngle),
        rounded(dot(n, corner(t, 0)) / (kFlatOffset * edge_)), triangles_[t].material};
    uint64_t hash = 0;
    for (uint64_t word : key) hash = combine(hash, word);
    auto& bucket = by_hash[hash];
    auto found = std::find_if(bucket.begin(), bucket.end(), [&](const auto& entry) {
      return entry.first == key && lies_in(flats[entry.second], t);
    });
    if (found == bucket.end()) {
      found = bucket.insert(bucket.end(), {key, uint32_t(flats.size())});
      flats.push_back({{}, n});
    }
    Flat& flat = flats[found->second];
    flat.triangles.push_back(t);
    flat.longest = std::max(flat.longest, longest_edge(t));
    flat.area += 0.5 * twice;
  }
  return flats;
}

bool CellBuilder::lies_in(const Flat& flat, uint32_t triangle) const {
  const Vec3d base = corner(flat.triangles[0], 0);
  for (int k = 0; k < 3; ++k)
    if (!(std::fabs(dot(flat.normal, corner(triangle, k) - base)) < BodyCells::kRise * edge_))
      return false;
  return true;
}

CellBuilder::Frame CellBuilder::frame_along(const Flat& flat, Vec3d along) const {
  Frame frame{corner(flat.triangles[0], 0), normalize(along), {}, {kFar, kFar}, {-kFar, -kFar}};
  frame.v = cross(flat.normal, frame.u);
  for (uint32_t t : flat.triangles)
    for (int k = 0; k < 3; ++k) {
      const Vec3d d = corner(t, k) - frame.base;
      const double at[2] = {dot(d, frame.u), dot(d, frame.v)};
      for (int axis = 0; axis < 2; ++axis) {
        frame.low[axis] = std::min(frame.low[axis], at[axis]);
        frame.high[axis] = std::max(frame.high[axis], at[axis]);
      }
    }
  return frame;
}

CellBuilder::Frame CellBuilder::tightest_frame(const Flat& flat) const {
  // Most surfaces are rectangles; along their edges, whole squares fill them.
  std::vector<Vec3d> edges;
  for (uint32_t t : flat.triangles)
    for (int k = 0; k < 3; ++k) edges.push_back(corner(t, (k + 1) % 3) - corner(t, k));
  std::stable_sort(edges.begin(), edges.end(),
                   [](Vec3d p, Vec3d q) { return dot(p, p) > dot(q, q); });
  Frame best{};
  double least = kFar;
  for (size_t i = 0; i < std::min(edges.size(), kMaxFrames); ++i) {
    if (!(dot(edges[i], edges[i]) > 0)) break;
    const Frame frame = frame_along(flat, edges[i]);
    const double area = (frame.high[0] - frame.low[0]) * (frame.high[1] - frame.low[1]);
    if (area < kTighter * least) least = area, best = frame;
  }
  return best;
}

void CellBuilder::make_patch(BodyCells& out, const Flat& flat, double edge) {
  const Frame frame = tightest_frame(flat);
  const Vec3d u = frame.u, v = frame.v, base = frame.base;
  const double *low = frame.low, *high = frame.high;
  const auto divisions = [&](int axis) {
    return uint32_t(std::clamp(std::ceil((high[axis] - low[axis]) / edge - 0.25), 1.0, 1e6));
  };
  BodyCells::Patch patch{};
  patch.origin = Vec3f(base + u * low[0] + v * low[1]);
  patch.u = Vec3f(u), patch.v = Vec3f(v);
  patch.columns = divisions(0), patch.rows = divisions(1);
  patch.columns_per_metre = float(patch.columns / std::max(high[0] - low[0], 1e-30));
  patch.rows_per_metre = float(patch.rows / std::max(high[1] - low[1], 1e-30));
  const uint32_t number = uint32_t(out.patches_.size());
  std::map<uint64_t, uint32_t> found;
  for (uint32_t t : flat.triangles) {
    out.faces_[t] = {Vec3f(flat.normal), number, kNoCell};
    add_squares(patch, t, found);
  }
  for (auto& [key, square] : found) squares_[square].patch = number;
  const double all = double(patch.columns) * patch.rows;
  if (all > kMaxEmpty * double(found.size()) + 64) {
    patch.first = out.keys_.size();
    patch.count = uint32_t(found.size());
    out.keys_.insert(out.keys_.end(), found.begin(), found.end());
  } else {
    patch.first = out.table_.size();
    out.table_.resize(patch.first + size_t(all), kNoCell);
    for (const auto& [key, square] : found) out.table_[patch.first + key] = square;
  }
  out.patches_.push_back(patch);
}

void CellBuilder::add_squares(const BodyCells::Patch& patch, uint32_t triangle,
                              std::map<uint64_t, uint32_t>& found) {
  const Vec3d origin(patch.origin), u(patch.u), v(patch.v);
  Polygon whole;
  for (int k = 0; k < 3; ++k) {
    const Vec3d d = corner(triangle, k) - origin;
    whole.push_back({dot(d, u), dot(d, v)});
  }
  const double wide = 1.0 / patch.columns_per_metre, high = 1.0 / patch.rows_per_metre;
  const auto range = [](double from, double to, double size, uint32_t count) {
    const auto at = [&](double x) {
      return uint32_t(std::clamp(std::floor(x / size), 0.0, double(count - 1)));
    };
    return std::pair{at(from), at(to)};
  };
  const auto [low_y, high_y] = std::minmax({whole[0].y, whole[1].y, whole[2].y});
  const auto rows = range(low_y, high_y, high, patch.rows);
  for (uint32_t row = rows.first; row <= rows.second; ++row) {
    const double y0 = row * high, y1 = (row + 1) * high;
    // Do not clip at the border of the rectangle, where rounding could lose a strip.
    Polygon strip = whole;
    if (row > 0) strip = clipped(strip, [&](const Point& p) { return p.y - y0; });
    if (row + 1 < patch.rows) strip = clipped(strip, [&](const Point& p) { return y1 - p.y; });
    if (strip.size() < 3) continue;
    double low_x = strip[0].x, high_x = low_x;
    for (const Point& p : strip) low_x = std::min(low_x, p.x), high_x = std::max(high_x, p.x);
    const auto columns = range(low_x, high_x, wide, patch.columns);
    for (uint32_t column = columns.first; column <= columns.second; ++column) {
      step();
      const double x0 = column * wide, x1 = (column + 1) * wide;
      Polygon piece = strip;
      if (column > 0) piece = clipped(piece, [&](const Point& p) { return p.x - x0; });
      if (column + 1 < patch.columns)
        piece = clipped(piece, [&](const Point& p) { return x1 - p.x; });
      if (!(area_of(piece) > 1e-9 * wide * high)) continue;
      const uint64_t key = uint64_t(row) * patch.columns + column;
      const auto [entry, fresh] = found.try_emplace(key, uint32_t(squares_.size()));
      if (fresh) squares_.push_back({0, triangles_[triangle].material, {x0, y0}, {x1, y1}, {}});
      squares_[entry->second].pieces.push_back({piece, triangle});
    }
  }
}

void CellBuilder::make_cells(BodyCells& out) {
  out.clumps_.resize(clumps_.size());
  for (size_t i = 0; i < clumps_.size(); ++i)
    for (const bool back : {false, true}) {
      step();
      make_clump_side(out, out.clumps_[i], back, clumps_[i]);
    }
  out.squares_.resize(squares_.size());
  for (size_t i = 0; i < squares_.size(); ++i)
    for (const bool back : {false, true}) {
      step();
      make_side(out, out.squares_[i], back, squares_[i], cuts_[i][size_t(back)]);
    }
}

void CellBuilder::make_side(BodyCells& out, BodyCells::Square& own, bool back, const Square& square,
                            const std::vector<Cut>& cuts) {
  BodyCells::Side& side = own.side[back];
  side.first_line = uint32_t(out.lines_.size());
  side.lines = uint32_t(cuts.size());
  side.first_part = uint32_t(out.parts_.size());
  for (const Cut& cut : cuts) out.lines_.push_back({float(cut.a), float(cut.b), float(cut.c)});
  double all = 0, largest = 0;
  const BodyCells::Patch& patch = out.patches_[square.patch];
  const Frame2 frame{Vec3d(patch.origin), Vec3d(patch.u), Vec3d(patch.v)};
  std::vector<Polygon> shape, seen;
  for (const Piece& piece : square.pieces) {
    all += area_of(piece.shape);
    shape.push_back(piece.shape);
    find_seen(frame, piece, back, seen);
  }
  // The parts_ of `whole` on one side of each cut, and their area.
  const auto cut_out = [&](const std::vector<Polygon>& whole, uint32_t part) {
    parts_.clear();
    double area = 0;
    for (Polygon piece : whole) {
      for (uint32_t k = 0; k < side.lines && piece.size() >= 3; ++k) {
        const double sign = part >> k & 1 ? 1 : -1;
        const Cut& cut = cuts[k];
        piece = clipped(piece,
                        [&](const Point& p) { return sign * (cut.a * p.x + cut.b * p.y - cut.c); });
      }
      area += area_of(piece);
      if (piece.size() >= 3) parts_.push_back(piece);
    }
    return area;
  };
  for (uint32_t part = 0; part < 1u << side.lines; ++part) {
    const double area = cut_out(shape, part);
    uint32_t cell = kNoCell;
    if (area > kMinPart * all) {
      // What is hidden has a cell without area: paths that hit the very edge of what hides it may
      // land there.
      double own = cut_out(seen, part);
      if (!(own > kMinPart * area)) own = 0, cut_out(shape, part);
      cell = add_cell(out, own, square.material);
      if (area > largest) largest = area, side.largest = cell;
      BodyCells::Spot& spot = out.spot_[cell];
      spot.patch = square.patch;
      spot.back = back;
      for (size_t axis = 0; axis < 2; ++axis)
        spot.low[axis] = float(square.low[axis]), spot.high[axis] = float(square.high[axis]);
      place_probes(spot, parts_);
    }
    out.parts_.push_back(cell);
  }
}

Polygon CellBuilder::projected(const Frame2& frame, uint32_t triangle) const {
  Polygon out;
  for (int k = 0; k < 3; ++k) {
    const Vec3d d = corner(triangle, k) - frame[0];
    out.push_back({dot(d, frame[1]), dot(d, frame[2])});
  }
  return out;
}

void CellBuilder::find_seen(const Frame2& frame, const Piece& piece, bool back,
                            std::vector<Polygon>& out) const {
  std::vector<Polygon> seen{piece.shape}, rest;
  for (const auto& hider : coincident_.of(piece.triangle)) {
    // Probes meet what lies higher.
    const double lift = double(BodyCells::kRise) * edge_ +
                        double(kLift * position_slack(triangles_[piece.triangle].corner[0]));
    if (hider.from_back != back || double(hider.gap) > lift) continue;
    const Polygon hole = projected(frame, hider.face);
    rest.clear();
    for (const Polygon& part : seen) add_outside(part, hole, rest);
    seen.swap(rest);
  }
  out.insert(out.end(), seen.begin(), seen.end());
}

void CellBuilder::place_probes(BodyCells::Spot& spot, const std::vector<Polygon>& pieces) {
  fans_.clear();
  double all = 0;
  for (const Polygon& piece : pieces)
    for (size_t i = 2; i < piece.size(); ++i) {
      const Fan fan{piece[0], piece[i - 1], piece[i], area_of({piece[0], piece[i - 1], piece[i]})};
      if (fan.area > 0) all += fan.area, fans_.push_back(fan);
    }
  size_t number = 0;
  double before = 0;
  for (uint32_t k = 0; k < BodyCells::kProbes; ++k) {
    const double wanted = (k + 0.5) / BodyCells::kProbes * all;
    while (number + 1 < fans_.size() && before + fans_[number].area < wanted)
      before += fans_[number++].area;
    const Fan& fan = fans_[number];
    // Place the probe in its triangle by its share of the area, and across by a radical inverse.
    const double along = std::sqrt(std::clamp((wanted - before) / fan.area, 0.0, 1.0));
    const double aside = double(sobol::reverse_bits(k)) * 0x1p-32 + 0.5 / BodyCells::kProbes;
    const double wb = along * (1 - aside), wc = along * aside;
    const double at[2] = {fan.a.x + wb * (fan.b.x - fan.a.x) + wc * (fan.c.x - fan.a.x),
                          fan.a.y + wb * (fan.b.y - fan.a.y) + wc * (fan.c.y - fan.a.y)};
    for (size_t axis = 0; axis < 2; ++axis) {
      const double share = (at[axis] - spot.low[axis]) / (double(spot.high[axis]) - spot.low[axis]);
      spot.probe[2 * k + axis] = uint8_t(std::clamp(std::floor(256 * share), 0.0, 255.0));
    }
  }
}

}  // namespace deltalux::gather
