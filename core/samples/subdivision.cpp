// SPDX-License-Identifier: Apache-2.0
// Works in rounds: bisect all long edges, split their triangles, and examine the parts.
#include "samples/subdivision.h"

#include <algorithm>

#include "samples/triangle_shapes.h"

namespace deltalux::samples {
namespace {

/// A triangle rotated so that edge `first` becomes a-b.
struct Turned {
  int64_t a, b, c, ab, bc, ca;
  Turned(const Triangle& t, const Triangle& m, size_t first)
      : a(t[first]),
        b(t[(first + 1) % 3]),
        c(t[(first + 2) % 3]),
        ab(m[first]),
        bc(m[(first + 1) % 3]),
        ca(m[(first + 2) % 3]) {}
};

double squared(Vec3d v) { return inner(v, v); }

Marks long_edges(std::span<const Vec3d> points, const Triangle& t, double squared_limit) {
  Marks marks;
  for (size_t k = 0; k < 3; ++k)
    marks[k] = squared(points[size_t(t[(k + 1) % 3])] - points[size_t(t[k])]) > squared_limit;
  return marks;
}

bool any(const Marks& marks) { return marks[0] || marks[1] || marks[2]; }

/// Subdivision in progress.
class Halving {
 public:
  Halving(std::span<const Vec3d> points, double squared_limit, size_t most)
      : points_(points.begin(), points.end()), squared_limit_(squared_limit), most_(most) {}

  /// Adds a triangle; `marks`: its long edges.
  void add(const Triangle& triangle, int64_t source, const Marks& marks) {
    active_.triangles.push_back(triangle);
    active_.source.push_back(source);
    marked_.push_back(marks);
  }

  /// Does one round; calls final(triangle, source) for each part without long edges. Returns false
  /// if there are too many points.
  template <class Final>
  bool halve(const Final& final) {
    if (!add_middles()) return false;
    const Pieces parts = split_marked(points_, active_.triangles, active_.source, marked_, middle_);
    active_.triangles.clear(), active_.source.clear(), marked_.clear();
    for (size_t i = 0; i < parts.triangles.size(); ++i) {
      const Marks marks = long_edges(points_, parts.triangles[i], squared_limit_);
      if (any(marks))
        add(parts.triangles[i], parts.source[i], marks);
      else
        final(parts.triangles[i], parts.source[i]);
    }
    return true;
  }

  bool finished() const { return active_.triangles.empty(); }
  const std::vector<Vec3d>& points() const { return points_; }

 private:
  /// Adds the midpoint of every marked edge, in the order of the edges' ends.
  bool add_middles() {
    struct Edge {
      int64_t low, high;
      size_t number;
      bool operator<(const Edge& other) const {
        return low != other.low ? low < other.low : high < other.high;
      }
    };
    std::vector<Edge> edges;
    middle_.assign(marked_.size(), {-1, -1, -1});
    for (size_t i = 0; i < marked_.size(); ++i)
      for (size_t k = 0; k < 3; ++k) {
        if (!marked_[i][k]) continue;
        const Triangle& t = active_.triangles[i];
        const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
        edges.push_back({low, high, 3 * i + k});
      }
    std::sort(edges.begin(), edges.end());
    for (size_t i = 0; i < edges.size(); ++i) {
      if (i == 0 || edges[i - 1] < edges[i]) {
        if (points_.size() >= most_) return false;
        points_.push_back(0.5 * (points_[size_t(edges[i].low)] + points_[size_t(edges[i].high)]));
      }
      middle_[edges[i].number / 3][edges[i].number % 3] = int64_t(points_.size()) - 1;
    }
    return true;
  }

  std::vector<Vec3d> points_;
  double squared_limit_;
  size_t most_;
  Pieces active_;
  std::vector<Marks> marked_;
  std::vector<Triangle> middle_;
};

}  // namespace

Pieces split_marked(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                    std::span<const int64_t> source, std::span<const Marks> marked,
                    std::span<const Triangle> middle) {
  std::array<std::vector<size_t>, 4> by_count;
  for (size_t i = 0; i < triangles.size(); ++i)
    by_count[size_t(marked[i][0] + marked[i][1] + marked[i][2])].push_back(i);
  Pieces out;
  const size_t parts = 2 * by_count[1].size() + 3 * by_count[2].size() + 4 * by_count[3].size();
  out.triangles.resize(parts), out.source.resize(parts);
  size_t done = 0;
  const auto put = [&](const std::vector<size_t>& chosen, size_t i, size_t part, Triangle t) {
    const size_t at = done + part * chosen.size() + i;
    out.triangles[at] = t, out.source[at] = source[chosen[i]];
  };
  const auto at = [&](int64_t point) { return points[size_t(point)]; };

  const std::vector<size_t>& one = by_count[1];  // turned so that the marked edge is a-b
  for (size_t i = 0; i < one.size(); ++i) {
    const Marks& marks = marked[one[i]];
    const Turned t(triangles[one[i]], middle[one[i]], marks[0] ? 0 : marks[1] ? 1 : 2);
    put(one, i, 0, {t.a, t.ab, t.c});
    put(one, i, 1, {t.ab, t.b, t.c});
  }
  done += 2 * one.size();

  // Rotated so that the unmarked edge is c-a. The shorter diagonal gives better triangles. If both
  // are equal, choose by indices, so that both windings of a triangle are split alike.
  const std::vector<size_t>& two = by_count[2];
  for (size_t i = 0; i < two.size(); ++i) {
    const Marks& marks = marked[two[i]];
    const Turned t(triangles[two[i]], middle[two[i]], !marks[0] ? 1 : !marks[1] ? 2 : 0);
    const double one_way = squared(at(t.a) - at(t.bc)), other_way = squared(at(t.ab) - at(t.c));
    const bool from_a = one_way < other_way || (one_way == other_way && t.a < t.c);
    put(two, i, 0, {t.ab, t.b, t.bc});
    put(two, i, 1, {t.a, t.ab, from_a ? t.bc : t.c});
    put(two, i, 2, {from_a ? t.a : t.ab, t.bc, t.c});
  }
  done += 3 * two.size();

  const std::vector<size_t>& three = by_count[3];
  for (size_t i = 0; i < three.size(); ++i) {
    const Turned t(triangles[three[i]], middle[three[i]], 0);
    put(three, i, 0, {t.a, t.ab, t.ca});
    put(three, i, 1, {t.ab, t.b, t.bc});
    put(three, i, 2, {t.ca, t.bc, t.c});
    put(three, i, 3, {t.ab, t.bc, t.ca});
  }
  return out;
}

std::optional<Subdivided> split_long_edges(std::span<const Vec3d> points,
                                           std::span<const Triangle> triangles,
                                           double squared_limit, size_t most) {
  Halving halving(points, squared_limit, most);
  Pieces final;  // parts of split triangles
  std::vector<uint32_t> parts(triangles.size(), 0);
  for (size_t i = 0; i < triangles.size(); ++i) {
    const Marks marks = long_edges(points, triangles[i], squared_limit);
    if (any(marks))
      halving.add(triangles[i], int64_t(i), marks);
    else
      parts[i] = 1;
  }
  const std::vector<uint32_t> whole = parts;
  while (!halving.finished()) {
    const auto keep = [&](const Triangle& triangle, int64_t source) {
      final.triangles.push_back(triangle);
      final.source.push_back(source);
      ++parts[size_t(source)];
    };
    if (!halving.halve(keep)) return {};
  }
  Subdivided out;
  out.added.assign(halving.points().begin() + long(points.size()), halving.points().end());
  std::vector<size_t> place(triangles.size());
  size_t total = 0;
  for (size_t i = 0; i < triangles.size(); ++i) place[i] = total, total += parts[i];
  out.pieces.triangles.resize(total), out.pieces.source.resize(total);
  const auto put = [&](const Triangle& triangle, size_t source) {
    out.pieces.triangles[place[source]] = triangle;
    out.pieces.source[place[source]++] = int64_t(source);
  };
  for (size_t i = 0; i < triangles.size(); ++i)
    if (whole[i]) put(triangles[i], i);
  for (size_t i = 0; i < final.triangles.size(); ++i)
    put(final.triangles[i], size_t(final.source[i]));
  return out;
}

std::optional<size_t> count_halved_edges(std::span<const Vec3d> points,
                                         std::span<const Triangle> triangles, double squared_limit,
                                         size_t most) {
  Halving halving(points, squared_limit, most);
  for (size_t i = 0; i < triangles.size(); ++i) {
    const Marks marks = long_edges(points, triangles[i], squared_limit);
    if (any(marks)) halving.add(triangles[i], int64_t(i), marks);
  }
  while (!halving.finished())
    if (!halving.halve([](const Triangle&, int64_t) {})) return {};
  return halving.points().size() - points.size();
}

}  // namespace deltalux::samples
