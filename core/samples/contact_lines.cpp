// SPDX-License-Identifier: Apache-2.0
// Finds the pieces near each face by a bounding volume hierarchy over pieces, since there are fewer
// of them. The face crosses the plane of a piece in a line, which is clipped to the piece.
#include "samples/contact_lines.h"

#include <numeric>

#include "samples/triangle_shapes.h"

namespace deltalux::samples {
namespace {

// cosine: planes that are closer to parallel overlap instead of crossing
constexpr double kFlat = 0.996;
constexpr size_t kLeaf = 4;      // pieces
constexpr size_t kGrain = 1024;  // faces

Box box_of(const Corners& corners, double pad) {
  Box box;
  for (Vec3d corner : corners) box.grow(Vec3f(corner));
  return box.padded(float(pad) + position_slack(max(box.high, -box.low)));
}

/// A bounding volume hierarchy over pieces, split at the median along the longest axis.
class PieceTree {
 public:
  explicit PieceTree(std::vector<Box>&& boxes) : order_(boxes.size()), boxes_(std::move(boxes)) {
    std::iota(order_.begin(), order_.end(), 0u);
    if (!boxes_.empty()) build(0, uint32_t(boxes_.size()));
  }

  /// Calls visit(piece) for all pieces whose boxes overlap `box`.
  template <class Visit>
  void each_near(const Box& box, const Visit& visit) const {
    if (!nodes_.empty()) descend(0, box, visit);
  }

 private:
  struct Node {
    Box box;
    uint32_t begin, end;
    uint32_t second;  ///< second child; the first one follows its parent; 0: a leaf
  };

  uint32_t build(uint32_t begin, uint32_t end) {
    const uint32_t number = uint32_t(nodes_.size());
    nodes_.push_back({{}, begin, end, 0});
    Box box, centres;
    for (uint32_t i = begin; i < end; ++i) {
      box.grow(boxes_[order_[i]]);
      centres.grow(boxes_[order_[i]].centre());
    }
    nodes_[number].box = box;
    if (end - begin <= kLeaf) return number;
    const Vec3f size = centres.extent();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](uint32_t a, uint32_t b) {
                       const float x = boxes_[a].centre()[axis], y = boxes_[b].centre()[axis];
                       return x != y ? x < y : a < b;
                     });
    build(begin, middle);
    const uint32_t second = build(middle, end);
    nodes_[number].second = second;
    return number;
  }

  template <class Visit>
  void descend(uint32_t number, const Box& box, const Visit& visit) const {
    const Node& node = nodes_[number];
    if (!node.box.overlaps(box)) return;
    if (node.second) {
      descend(number + 1, box, visit);
      descend(node.second, box, visit);
      return;
    }
    for (uint32_t i = node.begin; i < node.end; ++i)
      if (boxes_[order_[i]].overlaps(box)) visit(order_[i]);
  }

  std::vector<uint32_t> order_;
  std::vector<Box> boxes_;
  std::vector<Node> nodes_;
};

/// Whether two triangles share an edge.
bool neighbours(const Triangle& one, const Triangle& two) {
  int common = 0;
  for (int64_t a : one)
    for (int64_t b : two) common += a == b;
  return common >= 2;
}

/// The line where a face crosses the plane of a piece with unit `normal`; its length is 0 if it
/// does not.
ContactLine on_plane(const Corners& piece, Vec3d normal, const Corners& face, double gap) {
  double height[3];
  for (int k = 0; k < 3; ++k) {
    height[k] = dot(face[k] - piece[0], normal);
    if (std::abs(height[k]) <= gap) height[k] = 0;
  }
  // Of a face that lies within the plane by its whole width (seen from its edge), the longest side
  // is the line.
  std::array<Vec3d, 6> spots;
  int count = 0;
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (height[k] == 0) spots[count++] = face[k];
    if (height[k] * height[next] < 0)
      spots[count++] = face[k] + (face[next] - face[k]) * (height[k] / (height[k] - height[next]));
  }
  ContactLine line{0, {}, {}, 0};
  for (int i = 0; i < count; ++i) spots[i] = spots[i] - normal * dot(spots[i] - piece[0], normal);
  for (int i = 0; i < count; ++i)
    for (int j = i + 1; j < count; ++j) {
      const double apart = length(spots[j] - spots[i]);
      if (apart > line.length) line = {0, spots[i], (spots[j] - spots[i]) * (1 / apart), apart};
    }
  return line;
}

/// Clips the line to the piece, extended by `tolerance`.
void clip(const Corners& piece, Vec3d normal, double tolerance, ContactLine& line) {
  double begin = 0, end = line.length;
  for (int k = 0; k < 3; ++k) {
    const Vec3d corner = piece[k];
    const Vec3d inward = normalize(cross(normal, piece[(k + 1) % 3] - corner));
    const double depth = dot(line.start - corner, inward) + tolerance;
    const double slope = dot(line.along, inward);
    if (slope > 1e-12)
      begin = std::max(begin, -depth / slope);
    else if (slope < -1e-12)
      end = std::min(end, -depth / slope);
    else if (depth < 0)
      end = -1;
  }
  line.start = line.start + line.along * begin;
  line.length = end - begin;
}

/// Boxes have single precision: choose the middle of all faces as origin.
Vec3d middle_of(std::span<const Vec3d> points, std::span<const Triangle> triangles) {
  if (triangles.empty()) return {};
  Vec3d low = points[size_t(triangles[0][0])], high = low;
  for (const Triangle& t : triangles)
    for (int64_t corner : t)
      low = min(low, points[size_t(corner)]), high = max(high, points[size_t(corner)]);
  return 0.5 * (low + high);
}

}  // namespace

std::vector<ContactLine> find_contact_lines(std::span<const Vec3d> points, const FacePieces& pieces,
                                            const Faces& faces, double gap, double tolerance,
                                            const Workers& workers) {
  const Vec3d origin = middle_of(points, faces.corners);
  const auto corners_of = [&](const Triangle& t) {
    return Corners{points[size_t(t[0])] - origin, points[size_t(t[1])] - origin,
                   points[size_t(t[2])] - origin};
  };
  const size_t count = pieces.corners.size();
  std::vector<Corners> own(count);
  std::vector<Vec3d> normals(count);
  std::vector<Box> boxes(count);
  for (size_t i = 0; i < count; ++i) {
    own[i] = corners_of(pieces.corners[i]);
    normals[i] = normalize(doubled_area(own[i]));
    boxes[i] = box_of(own[i], gap);
  }
  const PieceTree tree(std::move(boxes));
  std::vector<std::vector<ContactLine>> blocks((faces.corners.size() + kGrain - 1) / kGrain);
  workers.for_blocks(faces.corners.size(), kGrain, [&](size_t begin, size_t end) {
    std::vector<ContactLine>& lines = blocks[begin / kGrain];
    for (size_t i = begin; i < end; ++i) {
      const Corners face = corners_of(faces.corners[i]);
      const Vec3d face_normal = normalize(doubled_area(face));
      tree.each_near(box_of(face, 0), [&](uint32_t piece) {
        const Vec3d normal = normals[piece];
        if (std::abs(dot(normal, face_normal)) > kFlat) return;
        if (neighbours(faces.places[size_t(pieces.face[piece])], faces.places[i])) return;
        ContactLine line = on_plane(own[piece], normal, face, gap);
        if (line.length <= tolerance) return;
        clip(own[piece], normal, tolerance, line);
        line.piece = piece;
        if (line.length > tolerance) lines.push_back(line);
      });
    }
  });
  std::vector<size_t> place(count + 1);
  for (const auto& block : blocks)
    for (const ContactLine& line : block) ++place[line.piece + 1];
  for (size_t i = 0; i < count; ++i) place[i + 1] += place[i];
  std::vector<ContactLine> all(place[count]);
  for (const auto& block : blocks)
    for (ContactLine line : block) {
      line.start = line.start + origin;
      all[place[line.piece]++] = line;
    }
  return all;
}

}  // namespace deltalux::samples
