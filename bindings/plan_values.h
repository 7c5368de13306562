// SPDX-License-Identifier: Apache-2.0
// Converts methods, counts and constants of the planner between Python and the core.
#pragma once
#include "base/error.h"
#include "common.h"
#include "plan/planner.h"

namespace deltalux::python {

inline const std::array<std::string, 5> kMethodNames{"auto", "brute_force", "disc_index", "ray_map",
                                                     "sphere_cache"};
inline const std::array<std::string, plan::kCounts> kCountNames{
    "segments", "visits", "node_tests", "disc_tests", "sphere_tests",  "far_tests", "box_tests",
    "rebuilds", "splits", "turns",      "hits",       "outline_tests", "far_hits"};

/// Names are checked in Python; an unknown one means "auto".
inline plan::Method to_method(const std::string& name) {
  const auto found = std::find(kMethodNames.begin(), kMethodNames.end(), name);
  return plan::Method(found == kMethodNames.end() ? 0 : found - kMethodNames.begin());
}

inline nb::dict to_dict(const plan::Counts& counts) {
  nb::dict out;
  for (size_t i = 0; i < plan::kCounts; ++i) out[kCountNames[i].c_str()] = counts[i];
  return out;
}

inline plan::Counts to_counts(const std::map<std::string, double>& values) {
  plan::Counts counts{};
  for (size_t i = 0; i < plan::kCounts; ++i)
    if (const auto found = values.find(kCountNames[i]); found != values.end())
      counts[i] = found->second;
  return counts;
}

inline nb::dict to_dict(const plan::PartPlan& plan) {
  nb::list methods;
  for (const plan::MethodPlan& m : plan.methods) {
    nb::dict entry;
    entry["method"] = kMethodNames[size_t(m.method)];
    entry["build_seconds"] = m.build_seconds;
    entry["bake_seconds"] = m.bake_seconds;
    entry["frame_seconds"] = m.frame_seconds;
    entry["bytes"] = m.bytes;
    entry["piloted"] = m.piloted;
    entry["bake_counts"] = to_dict(m.bake);
    entry["frame_counts"] = to_dict(m.frame);
    methods.append(entry);
  }
  nb::dict out;
  out["object"] = plan.object;
  out["discs"] = plan.discs;
  out["chosen"] = kMethodNames[size_t(plan.chosen)];
  out["methods"] = methods;
  out["frames"] = plan.traffic.frames;
  out["bake_segments"] = plan.traffic.bake.segments;
  out["frame_segments"] = plan.traffic.frame.segments;
  out["size_by_sphere"] = plan.traffic.size_by_sphere;
  out["size_by_box"] = plan.traffic.size_by_box;
  return out;
}

inline nb::list to_list(const std::vector<plan::PartPlan>& plans) {
  nb::list out;
  for (const plan::PartPlan& plan : plans) out.append(to_dict(plan));
  return out;
}

/// By method name, then by size; a row holds size, seconds to build per disc, and seconds per
/// count.
using MachineRows = std::map<std::string, std::vector<std::vector<double>>>;

inline MachineRows to_rows(const plan::Machine& machine) {
  MachineRows rows;
  for (const plan::Method method : plan::kMethods)
    for (const plan::Constants& c : machine[size_t(method)]) {
      std::vector<double> row{c.size, c.build};
      row.insert(row.end(), c.seconds.begin(), c.seconds.end());
      rows[kMethodNames[size_t(method)]].push_back(std::move(row));
    }
  return rows;
}

/// Throws OptionError for rows that do not hold constants of every method.
inline plan::Machine to_machine(const MachineRows& rows) {
  plan::Machine machine;
  for (const plan::Method method : plan::kMethods) {
    const auto found = rows.find(kMethodNames[size_t(method)]);
    if (found == rows.end() || found->second.empty())
      throw OptionError("machine: found no constants of \"" + kMethodNames[size_t(method)] +
                        "\", expected those of every disc method");
    for (const std::vector<double>& row : found->second) {
      if (row.size() != plan::kCounts + 2)
        throw OptionError("machine: found a row of " + std::to_string(row.size()) +
                          " numbers, expected " + std::to_string(plan::kCounts + 2));
      plan::Constants c{row[0], {}, row[1]};
      std::copy(row.begin() + 2, row.end(), c.seconds.begin());
      machine[size_t(method)].push_back(c);
    }
  }
  return machine;
}

}  // namespace deltalux::python
