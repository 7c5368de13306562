// SPDX-License-Identifier: Apache-2.0
// Faces near a piece by a tree of boxes; each crosses its plane in a line that is clipped to it.
#include "samples/contact_lines.h"

#include <numeric>

namespace deltalux::samples {
namespace {

constexpr double kFlat = 0.996;  // cosine between planes that do not cross but overlap
constexpr size_t kLeaf = 4;      // faces
constexpr size_t kGrain = 256;   // pieces

Box box_of(const std::array<Vec3d, 3>& corners, double pad) {
  Box box;
  for (Vec3d corner : corners) box.grow(Vec3f(corner));
  return box.padded(float(pad) + position_slack(max(box.high, -box.low)));
}

/// Boxes of faces, halved along their longest side.
class FaceTree {
 public:
  explicit FaceTree(std::span<const Face> faces) : order_(faces.size()), boxes_(faces.size()) {
    for (size_t i = 0; i < faces.size(); ++i) boxes_[i] = box_of(faces[i].corners, 0);
    std::iota(order_.begin(), order_.end(), 0u);
    if (!faces.empty()) build(0, uint32_t(faces.size()));
  }

  /// Calls visit(face) for all whose boxes overlap.
  template <class Visit>
  void each_near(const Box& box, const Visit& visit) const {
    if (!nodes_.empty()) descend(0, box, visit);
  }

 private:
  struct Node {
    Box box;
    uint32_t begin, end;
    uint32_t second;  ///< child; the first one follows; 0: a leaf
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

Vec3d doubled_area(const std::array<Vec3d, 3>& corners) {
  return cross(corners[1] - corners[0], corners[2] - corners[0]);
}

bool neighbours(const Face& one, const Face& two) {
  int common = 0;
  for (uint32_t a : one.points)
    for (uint32_t b : two.points) common += a == b;
  return common >= 2;
}

/// The line where a face meets the plane of a piece with unit `normal`; its length is 0 where they
/// do not meet.
ContactLine on_plane(const Piece& piece, Vec3d normal, const Face& face, double gap) {
  double height[3];
  for (int k = 0; k < 3; ++k) {
    height[k] = dot(face.corners[k] - piece.corners[0], normal);
    if (std::abs(height[k]) <= gap) height[k] = 0;
  }
  // What lies in the plane by its whole width is seen from its edge: its longest side is the line.
  std::array<Vec3d, 6> spots;
  int count = 0;
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (height[k] == 0) spots[count++] = face.corners[k];
    if (height[k] * height[next] < 0)
      spots[count++] = face.corners[k] + (face.corners[next] - face.corners[k]) *
                                             (height[k] / (height[k] - height[next]));
  }
  ContactLine line{0, {}, {}, 0};
  for (int i = 0; i < count; ++i)
    spots[i] = spots[i] - normal * dot(spots[i] - piece.corners[0], normal);
  for (int i = 0; i < count; ++i)
    for (int j = i + 1; j < count; ++j) {
      const double apart = length(spots[j] - spots[i]);
      if (apart > line.length) line = {0, spots[i], (spots[j] - spots[i]) * (1 / apart), apart};
    }
  return line;
}

/// Keeps of the line what lies within the piece, or no more than `tolerance` outside.
void clip(const Piece& piece, Vec3d normal, double tolerance, ContactLine& line) {
  double begin = 0, end = line.length;
  for (int k = 0; k < 3; ++k) {
    const Vec3d corner = piece.corners[k];
    const Vec3d inward = normalize(cross(normal, piece.corners[(k + 1) % 3] - corner));
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

}  // namespace

std::vector<ContactLine> find_contact_lines(std::span<const Piece> pieces,
                                            std::span<const Face> faces, double gap,
                                            double tolerance, const Workers& workers) {
  const FaceTree tree(faces);
  std::vector<Vec3d> normals(faces.size());
  for (size_t i = 0; i < faces.size(); ++i) normals[i] = normalize(doubled_area(faces[i].corners));
  std::vector<std::vector<ContactLine>> blocks((pieces.size() + kGrain - 1) / kGrain);
  workers.for_blocks(pieces.size(), kGrain, [&](size_t begin, size_t end) {
    std::vector<ContactLine>& lines = blocks[begin / kGrain];
    std::vector<uint32_t> near;
    for (size_t i = begin; i < end; ++i) {
      const Piece& piece = pieces[i];
      const Vec3d normal = normalize(doubled_area(piece.corners));
      near.clear();
      tree.each_near(box_of(piece.corners, gap), [&](uint32_t face) { near.push_back(face); });
      std::sort(near.begin(), near.end());
      for (uint32_t face : near) {
        if (std::abs(dot(normal, normals[face])) > kFlat) continue;
        if (neighbours(faces[piece.face], faces[face])) continue;
        ContactLine line = on_plane(piece, normal, faces[face], gap);
        if (line.length <= tolerance) continue;
        clip(piece, normal, tolerance, line);
        line.piece = uint32_t(i);
        if (line.length > tolerance) lines.push_back(line);
      }
    }
  });
  std::vector<ContactLine> all;
  for (const auto& block : blocks) all.insert(all.end(), block.begin(), block.end());
  return all;
}

}  // namespace deltalux::samples
