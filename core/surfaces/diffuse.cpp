// SPDX-License-Identifier: Apache-2.0
// Diffuse surfaces with the same reflectance everywhere.
#include "surfaces/lambertian.h"

namespace deltalux::surfaces {
namespace {

class Diffuse final : public Lambertian {
 public:
  Diffuse() : Lambertian(Reads::nothing) {}
  std::string_view name() const override { return "diffuse"; }
  const char* flaw(std::span<const float> parameters) const override {
    return parameters.empty() ? nullptr : "parameters, which a diffuse surface has none of";
  }
  Vec3f tint(const Surface&, const SurfacePoint&) const override { return {1, 1, 1}; }
  Vec3f max_tint(const Surface&) const override { return {1, 1, 1}; }
};

}  // namespace

const Kind& diffuse() {
  static const Diffuse kind;
  return kind;
}

}  // namespace deltalux::surfaces
