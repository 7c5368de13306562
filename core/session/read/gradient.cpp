// SPDX-License-Identifier: Apache-2.0
// First moments are corrected for clipped discs; direct light contributes central differences.
#include "session/read/gradient.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "session/discs/deposit.h"

namespace deltalux::session {
namespace {

constexpr float kDifferenceStep = 0.25f;  // of the radius, in each direction

/// Fits irradiance E0 + (gu, gv) . position to the energy and its first moments over the outline
/// `m`; adds the slopes to gu and gv.
void fit(const samples::OutlineMoments& m, double energy, double su, double sv, double& gu,
         double& gv) {
  if (!(m.area > 0)) return;
  // Eliminate E0 = (energy - g . m1) / m0.
  const double uu = m.uu - m.u * m.u / m.area, uv = m.uv - m.u * m.v / m.area,
               vv = m.vv - m.v * m.v / m.area;
  const double a = su - energy * m.u / m.area, b = sv - energy * m.v / m.area;
  const double determinant = uu * vv - uv * uv;
  if (!(determinant > 1e-6 * m.area * m.area * m.area * m.area)) return;  // almost a line
  gu += (a * vv - b * uv) / determinant;
  gv += (b * uu - a * uv) / determinant;
}

/// Two axes of a sample's tangent plane.
struct TangentFrame {
  Vec3f u{}, v{};

  /// Converts slopes along u and v to world space and adds them to `gradient`.
  void add(double along_u, double along_v, double* gradient) const {
    for (int axis = 0; axis < 3; ++axis) gradient[axis] += along_u * u[axis] + along_v * v[axis];
  }
};

TangentFrame frame_of(Vec3f normal) {
  TangentFrame frame;
  tangent_frame(normal, frame.u, frame.v);
  return frame;
}

/// Calls visit(discs, index, pose, object) for the discs of all present samples.
template <class Visit>
void each_disc(const State& s, const Visit& visit) {
  const samples::DiscSet& still = s.discs.still->discs();
  for (size_t i = 0; i < still.size(); ++i) visit(still, i, Pose{}, scene::kNone);
  for (const MovingPart& part : s.discs.moving) {
    const scene::Object& object = s.scene.objects[part.object];
    const samples::DiscSet& discs = part.index->discs();
    if (object.present)
      for (size_t i = 0; i < discs.size(); ++i) visit(discs, i, object.pose, part.object);
  }
}

/// The sums of all stored segments, in the order of World::samples.
SlopeSums deposit_slopes(State& s, Progress& progress) {
  const size_t n = s.samples.size(), slabs = s.slabs();
  SlopeSums own{std::vector<int64_t>(slabs * n * 3), std::vector<int64_t>(slabs * n * 6)};
  Deposit(s.paths, s.discs, {own.discs.data(), n, false, own.moments.data()}).add_all(progress);
  return own;
}

/// Adds the gradients of the light that paths bring. `frames`: axes of each disc, in world space.
void add_slopes_of_paths(const State& s, const SlopeSums& of, std::span<const TangentFrame> frames,
                         double* gradient) {
  const size_t n = s.samples.size();
  const uint32_t slabs = s.slabs();
  each_disc(s, [&](const samples::DiscSet& discs, size_t i, const Pose&, uint32_t) {
    const uint32_t id = discs.id[i];
    const samples::OutlineMoments m = samples::outline_moments(discs, i);
    const double unit = discs.radius[i] / estimate::EnergySums::kMomentSteps;
    for (int c = 0; c < 3; ++c) {
      double gu = 0, gv = 0;
      for (uint32_t slab = 0; slab < slabs; ++slab) {
        const double factor = s.sum_unit(slab / kBatches);
        const size_t at = size_t(slab) * n + id;
        fit(m, factor * double(of.discs[3 * at + c]),
            factor * unit * double(of.moments[6 * at + 2 * c]),
            factor * unit * double(of.moments[6 * at + 2 * c + 1]), gu, gv);
      }
      frames[id].add(gu, gv, gradient + 9 * size_t(s.given[id]) + 3 * c);
    }
  });
}

}  // namespace

SlopeSums slope_sums(State& s, Progress& progress) {
  check_whole(s);
  const DiscsInPlace discs(s, s.discs, progress);
  const SlopeSums own = deposit_slopes(s, progress);
  return {in_given_order(own.discs, 3, s.given), in_given_order(own.moments, 6, s.given)};
}

void read_gradient(State& s, double* gradient, Progress& progress, const SlopeSums& others) {
  check_readable(s);
  const DiscsInPlace discs(s, s.discs, progress);
  SlopeSums slopes = deposit_slopes(s, progress);
  if (s.holds_none()) {
    if (others.discs.size() != slopes.discs.size() ||
        others.moments.size() != slopes.moments.size())
      throw OptionError(
          "gradient: the segments are in other sessions; give the sum of their gradient_sums");
    add_in_given_order(others.discs, 3, s.given, slopes.discs);
    add_in_given_order(others.moments, 6, s.given, slopes.moments);
  }
  const size_t n = s.samples.size();
  std::fill(gradient, gradient + 9 * n, 0.0);
  // Four receivers around each sample: a step along -u, +u, -v and +v.
  std::vector<direct::Receiver> around(4 * n);
  std::vector<TangentFrame> frames(n);
  each_disc(s, [&](const samples::DiscSet& set, size_t i, const Pose& pose, uint32_t object) {
    const uint32_t id = set.id[i];
    const TangentFrame frame = frames[id] = frame_of(set.normal[i]);
    const float step = kDifferenceStep * set.radius[i];
    for (int k = 0; k < 4; ++k) {
      const Vec3f axis = k < 2 ? frame.u : frame.v;
      around[4 * id + k] = {pose.point(set.centre[i] + axis * (k % 2 ? step : -step)),
                            pose.direction(set.normal[i]), object};
    }
    frames[id] = {pose.direction(frame.u), pose.direction(frame.v)};
  });
  add_slopes_of_paths(s, slopes, frames, gradient);
  direct::DirectLight direct(4 * n, s.direct.light->scales(), s.options.seed);
  direct.compute({*s.caster, s.lights, s.light_sampled, around}, s.workers, progress);
  const auto light = direct.sums();
  for (size_t part = 0; part < direct.parts().size(); ++part)
    for (size_t id = 0; id < n; ++id) {
      const auto& [group, quantum] = direct.parts()[part];
      const double per_metre =
          s.group_factor[group] * quantum / (2 * kDifferenceStep * double(s.samples.radius[id]));
      for (int c = 0; c < 3; ++c) {
        const int64_t* e = light.data() + 3 * (part * 4 * n + 4 * id) + size_t(c);
        frames[id].add(double(e[3] - e[0]) * per_metre, double(e[9] - e[6]) * per_metre,
                       gradient + 9 * size_t(s.given[id]) + 3 * c);
      }
    }
}

}  // namespace deltalux::session
