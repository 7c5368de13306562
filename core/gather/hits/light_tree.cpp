// SPDX-License-Identifier: Apache-2.0
// Builds trees of lights by halving them along their longest extent.
#include "gather/hits/light_tree.h"

#include <algorithm>
#include <cmath>

namespace deltalux::gather {

using direct::Receiver;

LightTree::LightTree(std::span<const trace::Light> lights, const direct::Shapes& shapes,
                     std::vector<uint32_t> members)
    : shapes_(&shapes) {
  nodes_.reserve(2 * members.size());
  if (!members.empty()) build(lights, members);
}

void LightTree::build(std::span<const trace::Light> lights, std::span<uint32_t> members) {
  Box bounds, middles;
  Node node;
  node.strength = 0;
  for (const uint32_t l : members) {
    const trace::Light& light = lights[l];
    bounds.grow(light.bounds), middles.grow(light.bounds.centre());
    const double area = light.area > 0 ? light.area : 1.0;
    node.strength += area * (*shapes_)[l]->brightest();
  }
  node.centre = bounds.centre(), node.radius = 0.5f * bounds.diagonal();
  if (members.size() == 1) node.light = members.front();
  const size_t number = nodes_.size();
  nodes_.push_back(node);
  if (members.size() == 1) return;
  const Vec3f extent = middles.extent();
  const int axis = main_axis(extent);
  const size_t half = members.size() / 2;
  std::nth_element(members.begin(), members.begin() + long(half), members.end(),
                   [&](uint32_t a, uint32_t b) {
                     const float p = lights[a].bounds.centre()[axis];
                     const float q = lights[b].bounds.centre()[axis];
                     return p != q ? p < q : a < b;
                   });
  build(lights, members.first(half));
  nodes_[number].right = uint32_t(nodes_.size());
  build(lights, members.subspan(half));
}

double LightTree::about(const Node& node, const Receiver& receiver) const {
  if (node.light != ~0u) {
    const direct::LightShape& shape = *(*shapes_)[node.light];
    return shape.about(receiver) * shape.brightest();
  }
  if (receiver.normal == Vec3f{}) return 0;
  const Vec3f d = node.centre - receiver.point;
  const float squared = std::max(dot(d, d), node.radius * node.radius);
  const float distance = std::sqrt(squared);
  const float above = std::min(dot(receiver.normal, d) + node.radius, distance);
  return above > 0 ? node.strength * double(above) / (double(squared) * double(distance)) : 0.0;
}

uint32_t LightTree::draw(const Receiver& receiver, double& u, double& chance) const {
  chance = 1;
  size_t at = 0;
  while (nodes_[at].light == ~0u) {
    const size_t left = at + 1, right = nodes_[at].right;
    const double a = about(nodes_[left], receiver), b = about(nodes_[right], receiver);
    if (!(a + b > 0)) return scene::kNone;
    const double share = a / (a + b);
    const bool goes_left = u < share;
    const double own = goes_left ? share : 1 - share;
    u = std::clamp((goes_left ? u : u - share) / own, 0.0, 1 - 0x1p-24);
    chance *= own;
    at = goes_left ? left : right;
  }
  return about(nodes_[at], receiver) > 0 ? nodes_[at].light : scene::kNone;
}

}  // namespace deltalux::gather
