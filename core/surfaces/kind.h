// SPDX-License-Identifier: Apache-2.0
// The interface of kinds of surfaces: all that paths, estimates and edits need to know.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/random.h"
#include "base/vec.h"

namespace deltalux::surfaces {

class Kind;
struct TextureMap;

/// The product of each channel.
constexpr Vec3f product(Vec3f a, Vec3f b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

/// The reflectance of a point that has this tint, see Kind::tint(): the mean, and how much of the
/// differences from it there is.
constexpr Vec3f tinted(Vec3f mean, Vec3f contrast, Vec3f tint) {
  const Vec3f one{1, 1, 1};
  return product(mean, one + product(contrast, tint - one));
}

/// The kind without parameters: the same reflectance everywhere.
const Kind& diffuse();

/// A point of a triangle.
struct SurfacePoint {
  /// Barycentrics: the point is corner 0 + u (corner 1 - corner 0) + v (corner 2 - corner 0).
  float u = 0, v = 0;
  /// Texture coordinates, not finite where there are none; only set for kinds that read them.
  std::array<float, 2> texture{};
};

/// A surface as its material describes it. Its behaviour is defined by its kind.
struct Surface {
  /// Factor on all light that it sends back, per channel: the mean over the surface. Edits change
  /// it.
  Vec3f reflectance{};
  Vec3f emission{};  ///< radiance per channel; the mean if there is a glow
  bool two_sided = false;
  const Kind* kind = &diffuse();
  std::vector<float> parameters{};          ///< additional parameters of its kind
  std::string name{};                       ///< for messages
  std::shared_ptr<const TextureMap> map{};  ///< of textured ones
  /// Of luminous ones whose radiance differs: that of a texel of 1 is the map's gain. `emission` is
  /// the mean, and the radiance where there are no texture coordinates.
  std::shared_ptr<const TextureMap> glow{};

  /// Whether some of its points reflect otherwise than `reflectance`, diffusely.
  bool varies() const;
  /// Whether light may go on from it in another lobe than the diffuse one.
  bool has_lobes() const;
  /// Whether nothing passes it straight, at none of its points.
  bool stops_all() const;
  /// How much points differ from the mean, in units of their tints' differences from 1: 1, or less
  /// if the brightest points would reflect more than they receive. They reflect all of it then.
  Vec3f contrast() const;
  /// The reflectance of the diffuse lobe at a point, in [0, 1].
  Vec3f diffuse_at(const SurfacePoint& at) const;
};

/// Random numbers of a bounce have these dimensions. A kind that needs more counts on from kMore.
enum Dimension : uint32_t { kScatterU, kScatterV, kSurvive, kMore };

/// What becomes of light at a surface. Diffuse light goes on in all directions, so that cells send
/// it. Specular light goes on in directions that depend on its own, so that who follows it back has
/// to go on, too. Straight light passes as if nothing were there, but for a factor, so that shadow
/// rays pass, too.
enum class Lobe : uint8_t { diffuse, specular, straight };

/// The random numbers of one bounce of a path, by dimension.
class BounceRandom {
 public:
  constexpr BounceRandom(uint64_t seed, uint64_t path, uint32_t bounce)
      : path_(seed, path), bounce_(bounce) {}
  constexpr float operator()(uint32_t dimension) const { return path_(bounce_, dimension); }
  constexpr uint32_t bounce() const { return bounce_; }

 private:
  PathRandom path_;
  uint32_t bounce_;
};

/// A path that meets a surface.
struct Arrival {
  Vec3f direction;  ///< unit
  Vec3f normal;     ///< geometric normal; its side follows the winding; not normalised
  SurfacePoint at;
};

/// The same path after a surface has scattered it.
struct Departure {
  Vec3f normal;      ///< unit, on the side on which the path leaves
  Vec3f direction;   ///< unit
  Vec3d throughput;  ///< factors on the path's power, per channel; none exceeds 1
  Lobe lobe = Lobe::diffuse;
};

/// How a ray that follows light back goes on from a surface, in a lobe that is not diffuse.
struct Onward {
  Lobe lobe = Lobe::specular;
  Vec3f normal;     ///< unit, on the side on which it leaves; not of straight light
  Vec3f direction;  ///< unit
  Vec3f factor;     ///< on the light from there, per channel
  /// Of specular light: whether Surface::reflectance multiplies it, too.
  bool painted = true;
};

/// What a surface's answers depend on, beside the surface itself.
enum class Reads : uint8_t { nothing, barycentrics, texture };

/// Behaviour of all surfaces of one kind. Stateless; there is one instance of each kind.
class Kind {
 public:
  virtual ~Kind() = default;
  /// Its name in scenes.
  virtual std::string_view name() const = 0;
  /// Why a surface cannot have these parameters; null if it can.
  virtual const char* flaw(std::span<const float> parameters) const = 0;
  Reads reads() const { return reads_; }

  /// Whether all points stop rays.
  virtual bool is_opaque(const Surface& surface) const = 0;
  /// Whether this point stops rays, of light and of all who ask for it; else they pass straight
  /// through. Not asked if the surface is opaque.
  virtual bool stops(const Surface& surface, const SurfacePoint& at) const = 0;

  /// The reflectance of the diffuse lobe at a point, relative to the surface's mean, where its
  /// contrast is 1; 1 on average. Depends on the parameters, not on the reflectance. Not asked
  /// unless Surface::varies(): it is 1 then.
  virtual Vec3f tint(const Surface& surface, const SurfacePoint& at) const = 0;
  /// Begins to bring what tint() reads of this point into the cache.
  virtual void fetch(const Surface&, const SurfacePoint&) const {}
  /// Upper bound of tint().
  virtual Vec3f max_tint(const Surface& surface) const = 0;

  // Lobes that are not diffuse. All of this depends on the parameters, not on the reflectance, so
  // that edits of that leave rays as they are.

  /// Whether it has a specular lobe; whether it lets light pass straight.
  virtual bool has_specular(const Surface&) const { return false; }
  virtual bool transmits(const Surface&) const { return false; }
  /// The share of the light at this point that is for the diffuse lobe, of which that sends back
  /// its reflectance: where there is no glass, or no mirror. With this probability, a ray that
  /// follows light back takes the diffuse lobe.
  virtual float diffuse_share(const Surface&, const SurfacePoint&) const { return 1; }
  /// Which of the others it takes else, and how it goes on, for random numbers u and v. False: it
  /// ends in nothing. The factor includes 1 / (1 - diffuse_share()).
  virtual bool onward(const Surface&, const Arrival&, float u, float v, Onward& out) const {
    (void)u, (void)v, (void)out;
    return false;
  }
  /// The share of the light that passes straight: what scatter() and onward() send on so, on
  /// average.
  virtual float transmittance(const Surface&, const Arrival&) const { return 0; }

  /// Decides whether a path goes on, how, and in which lobe; a pure function of its arguments. On
  /// average over all random numbers, paths carry on as much power as the surface reflects.
  virtual bool scatter(const Surface& surface, const Arrival& arrival, const BounceRandom& random,
                       Departure& out) const = 0;
  /// Upper bound of the throughput in scatter() at a path's first hit.
  virtual Vec3d max_throughput(const Surface& surface) const = 0;

 protected:
  explicit Kind(Reads reads) : reads_(reads) {}

 private:
  Reads reads_;
};

inline bool Surface::varies() const { return kind->reads() != Reads::nothing || has_lobes(); }

inline bool Surface::has_lobes() const {
  return kind->has_specular(*this) || kind->transmits(*this);
}

inline bool Surface::stops_all() const { return kind->is_opaque(*this) && !kind->transmits(*this); }

inline Vec3f Surface::contrast() const {
  Vec3f out{1, 1, 1};
  if (!varies()) return out;
  const Vec3f most = kind->max_tint(*this);
  for (int c = 0; c < 3; ++c)
    if (reflectance[c] * most[c] > 1)
      out[c] = std::clamp((1 / reflectance[c] - 1) / (most[c] - 1), 0.0f, 1.0f);
  return out;
}

inline Vec3f Surface::diffuse_at(const SurfacePoint& at) const {
  if (!varies()) return reflectance;
  return min(tinted(reflectance, contrast(), kind->tint(*this, at)), Vec3f{1, 1, 1});
}

}  // namespace deltalux::surfaces
