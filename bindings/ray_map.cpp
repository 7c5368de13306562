// SPDX-License-Identifier: Apache-2.0
// Bindings of the ray map: one call on plain arrays, and an object with addition and removal of
// segments.
#include <atomic>
#include <mutex>
#include <optional>

#include "base/parallel.h"
#include "common.h"
#include "estimate/ray_map/discs.h"
#include "estimate/ray_map/nearest.h"
#include "estimate/ray_map/region.h"
#include "estimate/ray_map/tally.h"
#include "estimate_inputs.h"

namespace deltalux::python {
namespace {

using estimate::RayMapStats;

estimate::RayMetric to_metric(const std::string& name) {
  return name == "hit"        ? estimate::RayMetric::hit
         : name == "crossing" ? estimate::RayMetric::crossing
                              : estimate::RayMetric::line;
}

nb::dict to_dict(const RayMapStats& stats) {
  nb::dict counts;
  counts["hits"] = stats.tests.hits;
  counts["disc_tests"] = stats.tests.disc_tests;
  counts["node_tests"] = stats.tests.node_tests;
  counts["sphere_tests"] = stats.tests.sphere_tests;
  counts["box_tests"] = stats.box_tests;
  counts["splits"] = stats.splits;
  counts["refused_splits"] = stats.refused;
  return counts;
}

Vec3f to_vector3(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

nb::tuple ray_map_sums(const SegmentColumns& segments, const samples::DiscSet& discs,
                       const std::string& rule, uint32_t leaf_size, size_t memory_limit,
                       int threads, nb::object progress) {
  const size_t n = discs.size();
  std::vector<int64_t> sums(3 * n, 0);
  RayMapStats stats;
  run(progress, [&](Progress& p) {
    estimate::RayMap map(to_rule(rule), {leaf_size, memory_limit, false});
    map.push(segments.span(0, segments.count()));
    const Workers workers(threads);
    const estimate::EnergySums out{sums.data(), n, workers.threads() > 1};
    const auto take = [&](std::span<const estimate::RayMapHit> hits) {
      for (const estimate::RayMapHit& hit : hits)
        out.add(0, discs.id[hit.disc], &segments.power[3 * size_t(hit.segment)], +1);
    };
    stats = estimate::find_crossings(map, discs, workers, take, &p);
  });
  return nb::make_tuple(make_array(std::move(sums), {n, 3}), to_dict(stats));
}

nb::tuple ray_map_nearest(const SegmentColumns& segments, const Rows<float, 3>& points,
                          const Rows<float, 3>& normals, const std::string& rule,
                          const std::string& metric, uint32_t k, bool unbiased, uint32_t leaf_size,
                          size_t memory_limit, int threads, nb::object progress) {
  estimate::Gathered found;
  RayMapStats stats;
  const estimate::RayMapNearest nearest(to_vectors(points), to_vectors(normals), to_rule(rule),
                                        {to_metric(metric), k}, unbiased,
                                        {leaf_size, memory_limit, true});
  run(progress, [&](Progress& p) {
    found = nearest.estimate(segments.span(0, segments.count()), Workers(threads), &p, stats);
  });
  const size_t n = points.shape(0);
  return nb::make_tuple(make_array(std::move(found.irradiance), {n, 3}), to_dict(stats));
}

/// A map with the powers of its segments and the discs given to follow(). Calls exclude each other.
class RayMapObject {
 public:
  RayMapObject(const std::string& rule, uint32_t leaf_size, size_t memory_limit)
      : map_(to_rule(rule), {leaf_size, memory_limit, true}) {}

  nb::object push(const SegmentColumns& segments) {
    std::vector<uint32_t> ids;
    exclusively([&] {
      ids = map_.push(segments.span(0, segments.count()));
      power_.reserve(3 * map_.room());
      power_.resize(3 * map_.records().size());
      for (size_t i = 0; i < ids.size(); ++i)
        std::copy_n(&segments.power[3 * i], 3, &power_[3 * size_t(ids[i])]);
    });
    const size_t n = ids.size();
    return make_array(std::move(ids), {n});
  }

  void remove(const Column<uint32_t>& ids) {
    const std::span<const uint32_t> gone(ids.data(), ids.shape(0));
    exclusively([&] {
      map_.remove(gone);
      if (tally_) tally_->remove(gone, power_);
    });
  }

  void follow(const samples::DiscSet& discs) {
    exclusively([&] { tally_.emplace(discs, ++followers_); });
  }

  /// Sums of the discs given to follow().
  nb::object sums(int threads, nb::object progress) {
    std::vector<int64_t> sums;
    run(progress, [&](Progress& p) {
      const std::lock_guard lock(mutex_);
      RayMapStats stats = tally_->refresh(map_, power_, Workers(threads), &p);
      add(stats);
      sums = tally_->sums();
    });
    const size_t n = sums.size() / 3;
    return make_array(std::move(sums), {n, 3});
  }

  nb::object sphere(const std::array<float, 3>& centre, float radius) {
    return ids([&](RayMapStats& stats) {
      return estimate::find_in_sphere(map_, to_vector3(centre), radius, stats);
    });
  }
  nb::object box(const std::array<float, 3>& low, const std::array<float, 3>& high) {
    return ids([&](RayMapStats& stats) {
      return estimate::find_in_box(map_, {to_vector3(low), to_vector3(high)}, stats);
    });
  }

  nb::tuple nearest(const std::array<float, 3>& point, const std::array<float, 3>& normal,
                    uint32_t k, const std::string& metric) {
    std::vector<uint32_t> ids;
    std::vector<double> distances;
    const Vec3f points[1] = {to_vector3(point)}, normals[1] = {to_vector3(normal)};
    exclusively([&] {
      const auto take = [&](size_t, std::span<const estimate::NearRay> rays) {
        for (const estimate::NearRay& ray : rays)
          ids.push_back(ray.id), distances.push_back(ray.distance);
      };
      add(estimate::find_nearest(map_, power_, points, normals, {to_metric(metric), k}, take,
                                 Workers(1)));
    });
    const size_t n = ids.size();
    return nb::make_tuple(make_array(std::move(ids), {n}), make_array(std::move(distances), {n}));
  }

  nb::dict stats() {
    RayMapStats stats;
    exclusively([&] { stats = stats_; });
    return to_dict(stats);
  }
  size_t bytes() {
    size_t sum = 0;
    exclusively([&] {
      sum = map_.bytes() + power_.size() * sizeof(uint32_t) + (tally_ ? tally_->bytes() : 0);
    });
    return sum;
  }
  size_t size() {
    size_t live = 0;
    exclusively([&] { live = map_.live(); });
    return live;
  }

 private:
  template <class F>
  void exclusively(const F& work) {
    const nb::gil_scoped_release release;
    const std::lock_guard lock(mutex_);
    work();
  }
  template <class F>
  nb::object ids(const F& find) {
    std::vector<uint32_t> found;
    exclusively([&] {
      RayMapStats stats;
      found = find(stats);
      add(stats);
    });
    const size_t n = found.size();
    return make_array(std::move(found), {n});
  }
  void add(const RayMapStats& stats) { stats_ += stats; }

  std::mutex mutex_;
  estimate::RayMap map_;
  std::vector<uint32_t> power_;
  std::optional<estimate::RayMapTally> tally_;
  uint32_t followers_ = 0;
  RayMapStats stats_;
};

}  // namespace

void bind_ray_map(nb::module_& m) {
  m.def("ray_map_sums", ray_map_sums, nb::arg("segments"), nb::arg("discs"), nb::arg("rule"),
        nb::arg("leaf_size"), nb::arg("memory_limit"), nb::arg("threads"),
        nb::arg("progress").none());
  m.def("ray_map_nearest", ray_map_nearest, nb::arg("segments"), nb::arg("points"),
        nb::arg("normals"), nb::arg("rule"), nb::arg("metric"), nb::arg("k"), nb::arg("unbiased"),
        nb::arg("leaf_size"), nb::arg("memory_limit"), nb::arg("threads"),
        nb::arg("progress").none());
  nb::class_<RayMapObject>(m, "RayMap")
      .def(nb::init<const std::string&, uint32_t, size_t>(), nb::arg("rule"), nb::arg("leaf_size"),
           nb::arg("memory_limit"))
      .def("push", &RayMapObject::push, nb::arg("segments"))
      .def("remove", &RayMapObject::remove, nb::arg("ids"))
      .def("follow", &RayMapObject::follow, nb::arg("discs"))
      .def("sums", &RayMapObject::sums, nb::arg("threads"), nb::arg("progress").none())
      .def("sphere", &RayMapObject::sphere, nb::arg("centre"), nb::arg("radius"))
      .def("box", &RayMapObject::box, nb::arg("low"), nb::arg("high"))
      .def("nearest", &RayMapObject::nearest, nb::arg("point"), nb::arg("normal"), nb::arg("k"),
           nb::arg("metric"))
      .def("stats", &RayMapObject::stats)
      .def("bytes", &RayMapObject::bytes)
      .def("size", &RayMapObject::size);
}

}  // namespace deltalux::python
