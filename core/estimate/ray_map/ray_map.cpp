// SPDX-License-Identifier: Apache-2.0
// Adds and removes the segments of a ray map, and restarts its tree when they exceed its range.
#include "estimate/ray_map/ray_map.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

namespace deltalux::estimate {
namespace {

float greatest(Vec3f v) { return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}); }

template <class Node, class F>
void for_each_node(Node& node, F&& f) {
  f(node);
  if (!node.child) return;
  for (int i = 0; i < 2; ++i) for_each_node(node.child[i], f);
}

}  // namespace

RayMap::RayMap(segments::SegmentEnd rule, const RayMapOptions& options)
    : rule_(rule), options_(options) {}

bool RayMap::is_usual(const RayRecord& r) const {
  const float speed = greatest(r.direction);
  // Comparisons with NaN yield false.
  return greatest(r.origin) < kFarthest && speed > 1e-6f && speed < 1e6f &&
         std::isfinite(dot(r.origin, r.direction)) && r.extended >= 0;
}

std::vector<uint32_t> RayMap::push(const segments::SegmentSpan& s) {
  std::vector<uint32_t> ids(s.count), usual, odd;
  // Reserve room for as many removed segments as sweep() tolerates: this costs nothing until it is
  // used, and edits do not reallocate arrays.
  if (records_.empty()) records_.reserve(s.count + s.count * 5 / 8);
  float reach = 0;
  Box bounds;
  for (size_t i = 0; i < s.count; ++i) {
    const RayRecord r{
        {s.ox[i], s.oy[i], s.oz[i]}, {s.dx[i], s.dy[i], s.dz[i]}, s.length[i], s.extended[i]};
    if (free_.empty()) {
      ids[i] = uint32_t(records_.size());
      records_.push_back(r);
    } else {
      ids[i] = free_.back();
      free_.pop_back();
      records_[ids[i]] = r;
    }
    const bool fits = is_usual(r);
    (fits ? usual : odd).push_back(ids[i]);
    if (!fits) continue;
    reach = std::max(reach, greatest(r.origin));
    bounds.grow(r.origin);
    const Vec3f end = r.origin + r.direction * r.length;
    if (greatest(end) < kFarthest) bounds.grow(end);
  }
  root_.add(usual), odd_.add(odd);
  bounds_.grow(bounds);
  widen(reach, 0);
  return ids;
}

void RayMap::remove(std::span<const uint32_t> ids) {
  for (const uint32_t id : ids)
    if (id >= records_.size() || !records_[id].alive())
      throw OptionError("ray map: id: found " + std::to_string(id) +
                        ", expected the id of a segment that is in the map");
  for (const uint32_t id : ids) {
    if (!records_[id].alive()) continue;  // the id was given twice
    records_[id] = {{}, {}, -1.0f, -1.0f};
    ++dead_;
  }
  // Lists keep removed segments, which no test hits, until there are many: a traversal of all lists
  // would cost more than the rest of a small edit.
  if (dead_ > 1024 && dead_ > live() / 2) sweep();
}

void RayMap::sweep() {
  const auto gone = [&](uint32_t id) { return !records_[id].alive(); };
  const auto clean = [&](RayNode& node) {
    uint32_t settled = 0;
    node.for_range(0, std::min<size_t>(node.settled, node.count()), [&](const auto ids) {
      settled += uint32_t(std::count_if(ids.begin(), ids.end(), std::not_fn(gone)));
    });
    node.settled = settled;
    std::erase_if(node.ids, gone), std::erase_if(node.late, gone);
  };
  for_each_node(root_, clean);
  clean(odd_);
  std::vector<bool> known(records_.size());
  for (const uint32_t id : free_) known[id] = true;
  for (uint32_t id = 0; id < records_.size(); ++id)
    if (gone(id) && !known[id]) free_.push_back(id);
  dead_ = 0;
}

void RayMap::widen(float reach, float radius) {
  constexpr float kMinReach = 1e-12f;  // squares of values compared to it must not underflow
  const bool further = reach > reach_,
             wider = rule_ == segments::SegmentEnd::bounded && radius > radius_;
  if (!further && !wider) return;
  if (further) reach_ = std::max(kMinReach, std::exp2(std::ceil(std::log2(reach))));
  if (wider) radius_ = radius;
  // A tree whose root is a leaf has no lists to lose.
  if (!root_.child && root_.settled == 0) return;
  root_ = {}, odd_ = {};
  for (uint32_t id = 0; id < records_.size(); ++id)
    if (records_[id].alive()) (is_usual(records_[id]) ? root_ : odd_).ids.push_back(id);
  free_.clear();
  for (uint32_t id = 0; id < records_.size(); ++id)
    if (!records_[id].alive()) free_.push_back(id);
  dead_ = 0;
  ++generation_;
}

void RayMap::unsettle() {
  for_each_node(root_, [](RayNode& node) { node.settled = 0; });
  odd_.settled = 0;
}

size_t RayMap::bytes() const {
  size_t sum = records_.size() * sizeof(RayRecord) + free_.capacity() * sizeof(uint32_t);
  const auto add = [&](const RayNode& node) {
    sum += (node.ids.capacity() + node.late.capacity()) * sizeof(uint32_t) +
           (node.child ? 2 * sizeof(RayNode) : 0);
  };
  for_each_node(root_, add);
  add(odd_);
  return sum;
}

}  // namespace deltalux::estimate
