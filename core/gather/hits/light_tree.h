// SPDX-License-Identifier: Apache-2.0
// Chooses one of very many lights in logarithmic time: by what groups of lights that lie together
// may give.
#pragma once
#include <span>
#include <vector>

#include "direct/light_shape.h"
#include "trace/lights.h"

namespace deltalux::gather {

/// A binary tree over lights that have a place. A pure function of them.
class LightTree {
 public:
  LightTree() = default;
  /// `members`: indices of the lights.
  LightTree(std::span<const trace::Light> lights, const direct::Shapes& shapes,
            std::vector<uint32_t> members);
  bool empty() const { return nodes_.empty(); }
  /// About what all of it gives to the receiver without shadows; zero only if none gives anything.
  double about(const direct::Receiver& receiver) const { return about(nodes_.front(), receiver); }
  /// Draws a light. `u` in [0, 1) is rescaled within the interval that stands for the choice, so
  /// that it is uniform again. Returns kNone if the light drawn gives nothing.
  uint32_t draw(const direct::Receiver& receiver, double& u, double& chance) const;

 private:
  struct Node {
    Vec3f centre;
    float radius;
    double strength;       // sum of intensities
    uint32_t right = 0;    // the left child follows its parent
    uint32_t light = ~0u;  // of a leaf
  };
  void build(std::span<const trace::Light> lights, std::span<uint32_t> members);
  double about(const Node& node, const direct::Receiver& receiver) const;

  const direct::Shapes* shapes_ = nullptr;
  std::vector<Node> nodes_;
};

}  // namespace deltalux::gather
