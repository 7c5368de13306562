// SPDX-License-Identifier: Apache-2.0
// Reads the scene and samples that benchmarks/run.py wrote: a stream of 32-bit values.
#pragma once
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "samples/sample_set.h"
#include "scene/scene.h"

namespace deltalux::benchmarks {

class DumpReader {
 public:
  explicit DumpReader(const std::string& path) : file_(path, std::ios::binary) {
    if (!file_) throw std::runtime_error("cannot open " + path);
  }
  template <class T>
  std::vector<T> array() {
    uint64_t count = 0;
    read(&count, sizeof count);
    std::vector<T> out(count);
    read(out.data(), count * sizeof(T));
    return out;
  }
  std::vector<Vec3f> vectors() {
    const std::vector<float> flat = array<float>();
    std::vector<Vec3f> out(flat.size() / 3);
    for (size_t i = 0; i < out.size(); ++i)
      out[i] = {flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]};
    return out;
  }

 private:
  void read(void* to, size_t bytes) {
    if (!file_.read(static_cast<char*>(to), std::streamsize(bytes)))
      throw std::runtime_error("scene dump is too short");
  }
  std::ifstream file_;
};

struct Dump {
  scene::Scene scene;
  samples::SampleSet samples;
};

inline Dump read_dump(const std::string& path) {
  DumpReader in(path);
  Dump dump;
  const auto reflectance = in.vectors(), emission = in.vectors();
  for (size_t i = 0; i < reflectance.size(); ++i)
    dump.scene.materials.push_back({reflectance[i], emission[i], false});
  const uint32_t objects = in.array<uint32_t>().at(0);
  for (uint32_t i = 0; i < objects; ++i) {
    scene::Object object;
    object.name = "object" + std::to_string(i);
    object.vertices = in.vectors();
    const auto indices = in.array<uint32_t>();
    for (size_t t = 0; t + 2 < indices.size(); t += 3)
      object.triangles.push_back({indices[t], indices[t + 1], indices[t + 2]});
    object.material = in.array<uint32_t>();
    object.group.assign(object.triangles.size(), 0);
    object.movable = in.array<uint32_t>().at(0) != 0;
    const auto pose = in.array<double>();
    for (int r = 0; r < 3; ++r) {
      object.pose.row[r] = {pose[4 * r], pose[4 * r + 1], pose[4 * r + 2]};
      object.pose.translation[r] = pose[4 * r + 3];
    }
    dump.scene.objects.push_back(std::move(object));
  }
  dump.samples.point = in.vectors();
  dump.samples.normal = in.vectors();
  dump.samples.radius = in.array<float>();
  dump.samples.attached = in.array<uint32_t>();
  return dump;
}

}  // namespace deltalux::benchmarks
