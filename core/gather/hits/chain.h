// SPDX-License-Identifier: Apache-2.0
// Chains: continuation of a gather ray that hits something near. A cell there averages light over
// an area as large as the contact shadows that the ray should resolve, so the ray goes on as a
// path.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "base/end_slack.h"
#include "direct/light_shape.h"
#include "gather/aim/direction_sampler.h"
#include "gather/aim/suns.h"
#include "gather/cells/cells.h"
#include "gather/hits/one_light.h"
#include "gather/hits/vertex.h"
#include "trace/change.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"
#include "trace/scatter.h"

namespace deltalux::gather {

/// What rays are cast and read in: the scene as it is now.
struct Context {
  const scene::Scene& scene;
  const trace::RayCaster& caster;
  std::span<const trace::Light> lights;
  std::span<const direct::Receiver> receivers;  ///< by sample, in world space
  const Cells& cells;
  const Guiding& guiding;
  const Beams& beams;
  const Suns& suns;
  /// The receiver where a ray lands, on the side that it hits.
  direct::Receiver landing(Vec3f origin, Vec3f w, const trace::Hit& hit) const {
    const bool fixed = hit.primitive < scene.static_primitives();
    const Vec3f way = w * hit.t, at = origin + way;
    // Receiver::slack() adds that of the place itself.
    const float beside = end_slack(at, way) - position_slack(at);
    return {at, trace::facing_normal(hit, w), fixed ? scene::kNone : scene.object_of(hit.primitive),
            scene.slack_of(hit.primitive) + beside};
  }
};

/// Steps from hit to hit; a chain that takes this number ends in nothing.
inline constexpr uint32_t kMaxTouched = 16;
/// Each may have two before it, factors and caustics. A chain that ends in a cell gets up to three
/// more: factors, and the direct light of a beam and of a sun at the end.
inline constexpr uint32_t kMaxVertices = 3 * kMaxTouched + 3;
inline constexpr uint32_t kDark = kNoCell;  // where a ray meets nothing

/// From the third vertex on, chains continue with the probability kGoesOn. It is fixed, since
/// reflectances may be edited.
inline constexpr uint32_t kSurely = 2;
inline constexpr float kGoesOn = 0.7f;
/// A path that begins at a near hit, or one that ends at a far hit immediately. After its last
/// vertex comes `end`, a cell or nothing. Cells hold no direct light of those beams and suns for
/// which gather rays cast shadow rays, so the end may have a vertex for each of these two.
struct Chain {
  std::array<Vertex, kMaxVertices> vertex;
  std::array<Place, kMaxVertices> place;  ///< of each vertex; where the last segment starts, too
  std::array<Tint, kMaxVertices> tint;    ///< of each vertex
  uint32_t count = 0;
  uint32_t end = kDark;
  /// Weight of the end; the vertices' light has weights of its own.
  float weight = 1;
  /// whether it depends on where a beam's light lands: on shadow rays from its lamp to vertices or
  /// to the end, or on one of its points, towards which the last segment goes if it misses it
  bool in_beam = false;
  /// Where the last segment ends; far outside of the world if it hits nothing. A ray towards a
  /// point of a beam ends there, even if something hides the point.
  Vec3f tip{};
  void add(const Vertex& own, const direct::Receiver& at, Tint its = {}) {
    place[count] = Place::of(at);
    tint[count] = its;
    vertex[count++] = own;
  }
  Points points() const { return Points{vertex, place, tint}.subspan(0, count); }
};

/// Traces chains through the present scene.
class ChainTracer {
 public:
  /// `targets`: those of `context`.
  ChainTracer(const Context& context, const CellFinder& finder, const Targets& targets,
              uint64_t seed);
  /// Continues from the first hit, in `cell`, which is near or has a lobe that is not diffuse.
  /// `key`: random key of the ray; `first`: random numbers for the light at that hit.
  Chain trace(uint64_t key, const Draw& first, Vec3f origin, Vec3f w, const trace::Hit& hit,
              uint32_t cell) const;
  /// The same chain where something changed behind one of its points alone: casts it from there.
  /// Where all surfaces are diffuse and nothing depends on beams. `origin`: of the ray; `kept`: of
  /// the chain up to that point.
  Chain resume(uint64_t key, const Draw& first, Vec3f origin, const Points& kept) const;
  /// Asks lights again at vertices of a chain whose way did not change, where all surfaces are
  /// diffuse. `key`, `first`: as for trace(); `renewal(vertex, receiver)`: why the vertex asks, if
  /// it does. Returns whether it cast rays.
  template <class Why>
  bool ask_again(uint64_t key, const Draw& first, std::span<const Place> places,
                 std::span<Vertex> vertices, const Why& renewal) const {
    bool casts = false;
    uint32_t step = 0;
    for (size_t k = 0; k < vertices.size(); ++k) {
      Vertex& vertex = vertices[k];
      if (vertex.is_factor()) continue;
      const direct::Receiver at = places[k].receiver();
      if (const Renewal why = renewal(vertex, at); why != Renewal::none) {
        const OneLight::Answer now =
            asked_by(vertex).ask_again(context_.caster, at, light_draw(key, step, first),
                                       {vertex.light, vertex.direct}, why, casts);
        vertex.light = now.light, vertex.direct = now.direct;
      }
      step += vertex.is_point();
    }
    return casts;
  }
  /// Whether rays that meet this go on, however far it is.
  bool goes_on_at(const trace::Hit& hit) const { return context_.scene.has_lobes(hit.primitive); }
  /// Makes a chain that ends at the first hit, in `cell`, which is far. It has vertices only for
  /// beams and suns.
  Chain end(const Draw& first, Vec3f origin, Vec3f w, const trace::Hit& hit, uint32_t cell) const;

 private:
  /// Chooses a lobe for a hit. In one that is not diffuse, goes on: adds a vertex, which is a point
  /// if the surface's reflectance counts, and changes the ray.
  enum class Taken : uint8_t { diffuse, painted, by_factor, nothing };
  Taken take_lobe(const PathRandom& random, uint32_t step, const direct::Receiver& at,
                  const trace::Hit& hit, Vec3f& origin, Vec3f& w, Chain& chain) const;
  /// A ray, what it met, and what it did before.
  struct Walk {
    Vec3f origin, w;
    trace::Hit hit;
    uint32_t cell;
    Vec3f bend;                      ///< the last point
    uint32_t step = 0, touched = 0;  ///< points; of these, vertices
  };
  /// Follows a chain from a hit to its end.
  void follow(uint64_t key, const Draw& first, Walk& walk, Chain& chain) const;
  /// Casts the segment that leaves a point. Returns false if the chain ends.
  bool go_on(uint64_t key, const Draw& first, Taken taken, Walk& walk, Chain& chain) const;
  /// Adds the vertex of a near hit, with its direct light and caustics.
  void touch(const Draw& draw, const direct::Receiver& at, const trace::Hit& hit, uint32_t cell,
             Chain& chain) const;
  /// Sets the chain's end, and adds vertices for the direct light of beams and suns there.
  void finish(const Draw& draw, const direct::Receiver& at, const trace::Hit& hit, uint32_t cell,
              Chain& chain) const;
  /// What a vertex of a scene without caustics asked: at the end, one of those lights that cells
  /// leave out.
  const OneLight& asked_by(const Vertex& vertex) const {
    if (!vertex.is_of_end()) return one_light_;
    return context_.beams.has(vertex.light) ? one_beam_ : one_sun_;
  }
  /// Random numbers for the light at the hit after so many steps.
  Draw light_draw(uint64_t key, uint32_t step, const Draw& first) const;

  const Context& context_;
  const CellFinder& finder_;
  const Targets& targets_;
  OneLight one_light_, one_beam_, one_sun_;
  uint64_t seed_;
};

}  // namespace deltalux::gather
