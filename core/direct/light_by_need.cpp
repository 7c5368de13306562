// SPDX-License-Identifier: Apache-2.0
// Visits lights in descending order of their unshadowed contribution.
#include "direct/light_by_need.h"

#include <algorithm>
#include <optional>

#include "direct/block.h"

namespace deltalux::direct {
namespace {

constexpr double kMuch = 0.25, kLittle = 0.01;  // of a receiver's direct light

}  // namespace

void light_by_need(const Context& context, std::span<const double> dim, uint64_t seed,
                   const Workers& workers, Progress& progress, std::span<Vec3d> irradiance) {
  struct Lamp {
    std::unique_ptr<const LightShape> shape;
    Vec3d strength;
    double brightness;
    const trace::Light* light;
  };
  std::vector<Lamp> lamps;
  for (uint32_t i = 0; i < context.lights.size(); ++i) {
    const trace::Light& light = context.lights[i];
    const Vec3d own = Vec3d(light.strength) * dim[i];
    const double brightness = own.x + own.y + own.z;
    if (light.on && brightness > 0)
      lamps.push_back({shape_of(light, i, seed), own, brightness, &light});
  }
  workers.for_blocks(context.receivers.size(), kBlock, [&](size_t begin, size_t end) {
    const ReceiverBlock block(context.receivers, begin, end);
    std::vector<Blockers> blockers;
    for (const Lamp& lamp : lamps) blockers.emplace_back(context.caster, *lamp.light, block);
    std::vector<std::pair<double, uint32_t>> order;
    for (size_t i = begin; i < end; ++i) {
      progress.check();
      const Receiver& receiver = context.receivers[i];
      const uint64_t key = place_key(receiver.point, receiver.normal);
      order.clear();
      double left = 0, found = 0;
      for (uint32_t k = 0; k < lamps.size(); ++k) {
        const double most = lamps[k].shape->about(receiver) * lamps[k].brightness;
        if (most > 0) order.emplace_back(-most, k), left += most;
      }
      std::sort(order.begin(), order.end());
      Vec3d sum{};
      for (const auto& [minus, k] : order) {
        const Lamp& lamp = lamps[k];
        const double of_all = -minus / (found + left);
        left = std::max(0.0, left + minus);
        const std::span<const uint32_t> movables = blockers[k].of(receiver);
        // the choice varies with place and light, so that it has no bias
        std::optional<uint32_t> third;
        if (of_all < kLittle) third = uint32_t((key + k) % 3);
        const double open = lamp.shape->open(receiver);
        const double share =
            of_all > kMuch
                ? visible_share(context.caster, *lamp.shape, receiver, open,
                                fixed_view(context.caster, *lamp.shape, receiver, open), movables)
                      .share
                : coarse_share(context.caster, *lamp.shape, receiver, third, movables);
        if (!(share > 0)) continue;
        const double factor = share * open;
        sum = sum + lamp.strength * factor;
        found += factor * lamp.brightness;
      }
      irradiance[i] = sum;
    }
  });
}

}  // namespace deltalux::direct
