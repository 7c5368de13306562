// SPDX-License-Identifier: Apache-2.0
// Casts gather rays, and those that an edit affects again.
#include "gather/hits/gather_hits.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "base/random.h"
#include "base/stopwatch.h"
#include "gather/hits/stale_rays.h"

namespace deltalux::gather {
namespace {

constexpr size_t kGrain = 64;      // samples per task of a thread
constexpr size_t kTogether = 16;   // rays that are cast before their cells are looked up
constexpr size_t kPortion = 2048;  // samples whose rays are cast before they are stored

// The following constants are for updates. Samples on moved objects cast all their rays, most
// others none.
constexpr size_t kBlock = 16;       // samples per block
constexpr size_t kMaxBlocks = 256;  // blocks between two checks of the clock
constexpr size_t kFew = 16;         // fewer blocks than this are divided among threads more finely
constexpr double kSoon = 4;         // milliseconds between checks of the clock, approximately

/// Adapts the number of blocks processed between two checks of the clock.
class Step {
 public:
  /// Number of blocks to process next.
  size_t size() const { return size_; }
  void took(double milliseconds) {
    if (2 * milliseconds < kSoon) size_ = std::min(2 * size_, kMaxBlocks);
    if (milliseconds > 2 * kSoon) size_ = std::max(size_ / 2, size_t(1));
  }

 private:
  size_t size_ = 2;
};

}  // namespace

/// Casts the rays of samples in the present scene.
class GatherHits::Caster {
 public:
  Caster(const GatherHits& hits, const Context& context)
      : hits_(hits),
        context_(context),
        finder_(context.scene, context.cells),
        targets_(context.guiding.guides, context.beams),
        chains_(context, finder_, targets_, hits.seed_) {}

  /// Whether the sample has no normal, so that it casts no rays.
  bool blind(size_t sample) const { return context_.receivers[sample].normal == Vec3f{}; }
  SampleRays rays(size_t sample) const {
    return {hits_.directions_, context_.guiding.allotments, targets_,
            uint32_t(sample),  hits_.rays_.count(sample),   context_.receivers[sample]};
  }
  /// Casts the given rays of a sample and appends what they met.
  void cast(const SampleRays& rays, size_t sample, std::span<const uint32_t> which,
            CastRays& out) const {
    for (size_t first = 0; first < which.size(); first += kTogether)
      cast_together(rays, sample, which.subspan(first, std::min(kTogether, which.size() - first)),
                    out);
  }
  /// Casts again, or asks lights again for, what is stale of a sample's rays; without `around`, all
  /// from `first` on. Returns whether any was.
  bool renew(size_t sample, uint32_t first, const StaleRays& stale, const StaleRays::Around* around,
             CastRays& out) const {
    struct Memory {
      std::vector<uint32_t> which;
      StaleRays::Scratch scratch;
    };
    thread_local Memory of_thread;
    // Every use of a thread's own variable looks it up.
    auto& [which, scratch] = of_thread;
    const SampleRays own = rays(sample);
    const size_t before = out.rays.size() + out.relit.size();
    which.clear();
    if (around) {
      stale.mark(own, sample, *around, scratch);
      std::sort(scratch.stale().begin(), scratch.stale().end());
      for (const uint32_t ray : scratch.stale()) {
        const Stale again = scratch.of(ray);
        if (again.what == Stale::all) which.push_back(ray);
        if (again.what == Stale::lights) ask_again(own, sample, ray, stale, out);
        if (again.what == Stale::tail) resume(own, sample, ray, again.kept, stale, out);
      }
    } else {
      for (uint32_t ray = first; ray < hits_.shown(sample); ++ray) which.push_back(ray);
    }
    cast(own, sample, which, out);
    return out.rays.size() + out.relit.size() > before;
  }

 private:
  /// Asks lights again along the chain of a ray, and appends it if it brings something else.
  void ask_again(const SampleRays& rays, size_t sample, uint32_t ray, const StaleRays& stale,
                 CastRays& out) const {
    const uint32_t number = chain_of(hits_.targets(sample)[ray]);
    const std::span<const Vertex> before = hits_.chains_.vertices(number);
    std::vector<Vertex>& now = out.relit_vertices;
    const size_t first = now.size();
    now.insert(now.end(), before.begin(), before.end());
    const bool casts = chains_.ask_again(
        key(sample, ray), rays.beyond(ray), hits_.chains_.places(number),
        std::span(now).subspan(first), [&](const Vertex& vertex, const direct::Receiver& at) {
          return stale.renewal(vertex, at);
        });
    const bool same = std::equal(before.begin(), before.end(), now.begin() + long(first));
    out.asked.rays += casts, out.asked.changed += casts && !same;
    if (same)
      now.resize(first);
    else
      out.relit.push_back(number);
  }
  /// Casts the rest of a chain again behind its first `kept` vertices.
  void resume(const SampleRays& rays, size_t sample, uint32_t ray, size_t kept,
              const StaleRays& stale, CastRays& out) const {
    const size_t place = hits_.rays_.first(sample) + ray;
    const uint32_t number = chain_of(hits_.targets_[place]);
    const Draw first = rays.beyond(ray);
    Chain chain = chains_.resume(key(sample, ray), first, rays.origin(),
                                 hits_.chains_.points(number).subspan(0, kept));
    chains_.ask_again(key(sample, ray), first, std::span(chain.place).first(kept),
                      std::span(chain.vertex).first(kept),
                      [&](const Vertex& vertex, const direct::Receiver& at) {
                        return stale.renewal(vertex, at);
                      });
    const float weight = hits_.weights_.empty() ? 1.0f : hits_.weights_[place];
    out.rays.push_back({place, kChain, weight, chain.in_beam});
    out.add(chain);
  }
  /// Of the ray's random numbers.
  uint64_t key(size_t sample, uint32_t ray) const {
    return combine(context_.receivers[sample].key, ray);
  }
  /// Casts at most kTogether rays, step by step: what a step reads for one ray does not depend on
  /// the others, so that the processor waits for memory once, not ray by ray.
  void cast_together(const SampleRays& rays, size_t sample, std::span<const uint32_t> which,
                     CastRays& out) const {
    const Vec3f o = rays.origin();
    const bool casts = !blind(sample);
    std::array<Aim, kTogether> aims;
    std::array<trace::Hit, kTogether> hits;
    std::array<uint32_t, kTogether> cells;
    for (size_t i = 0; i < which.size(); ++i) {
      aims[i] = casts ? rays.aim(which[i]) : Aim{};
      hits[i] = aims[i].w == Vec3f{} ? trace::Hit{} : context_.caster.closest(o, aims[i].w);
      if (hits[i].valid()) finder_.prefetch(hits[i].primitive);
    }
    for (size_t i = 0; i < which.size(); ++i)
      cells[i] = hits[i].valid() ? finder_.find(hits[i].primitive, o, aims[i].w, hits[i].t) : kDark;
    for (size_t i = 0; i < which.size(); ++i) {
      CastRays::Ray own{hits_.rays_.first(sample) + which[i], cells[i], 0, false};
      // If something hides the point that the ray aims for, keep the ray with weight 0: the
      // obstacle may move.
      if (cells[i] != kNoCell && (!aims[i].point || aims[i].point->is_met(o, aims[i].w, hits[i])))
        weigh(rays, sample, which[i], aims[i].w, hits[i], own, out);
      out.rays.push_back(own);
    }
  }
  /// Computes the weight of a ray that hit something, and its chain if it has one.
  void weigh(const SampleRays& rays, size_t sample, uint32_t ray, Vec3f w, const trace::Hit& hit,
             CastRays::Ray& own, CastRays& out) const {
    const Vec3f o = rays.origin();
    own.weight = 1;
    if (rays.has_guides())
      own.weight =
          rays.weight(ray, w, hit.t, context_.landing(o, w, hit), context_.caster, own.in_beam);
    const bool far = hit.t >= context_.cells.near(own.target) && !chains_.goes_on_at(hit);
    if (far && !context_.beams.reach(own.target) &&
        !context_.suns.may_shine(trace::facing_normal(hit, w)))
      return;
    const Draw first = rays.beyond(ray);
    const Chain chain = far ? chains_.end(first, o, w, hit, own.target)
                            : chains_.trace(key(sample, ray), first, o, w, hit, own.target);
    own.in_beam |= chain.in_beam;
    if (!chain.count) return;
    own.target = kChain;
    out.add(chain);
  }

  const GatherHits& hits_;
  const Context& context_;
  CellFinder finder_;
  Targets targets_;
  ChainTracer chains_;
};

GatherHits::GatherHits(RayCounts rays, uint64_t seed)
    : rays_(std::move(rays)),
      seed_(seed),
      directions_(rays_.most(), seed),
      changed_(rays_.receivers(), 1),
      parts_(rays_.receivers(), kParts) {}

GatherHits::Cast GatherHits::set(const CastRays& found) {
  size_t next = 0, first = 0;
  uint64_t changed = 0;
  for (const CastRays::Ray& ray : found.rays) {
    uint32_t& target = targets_[ray.place];
    const uint32_t before = target;
    bool same = is_chain(before) == is_chain(ray.target);
    if (is_chain(ray.target)) {
      const CastRays::Chained& chain = found.chained[next++];
      const Points own = found.points().subspan(first, chain.count);
      first += chain.count;
      same = same && chains_.is(chain_of(before), own, chain.end, chain.weight);
      target = store(own, chain.end, chain.weight, chain.tip);
    } else {
      same = same && before == ray.target;
      target = ray.target;
    }
    if (is_chain(before)) chains_.remove(chain_of(before));
    if (!weights_.empty()) {
      same = same && weights_[ray.place] == ray.weight;
      weights_[ray.place] = ray.weight;
    }
    changed += !same;
    if (in_beam_.empty()) continue;
    uint64_t& word = in_beam_[ray.place / 64];
    const uint64_t bit = uint64_t(1) << (ray.place % 64);
    word = ray.in_beam ? word | bit : word & ~bit;
  }
  size_t vertex = 0;
  for (const uint32_t chain : found.relit) {
    const size_t count = chains_.vertices(chain).size();
    chains_.relight(chain, std::span(found.relit_vertices).subspan(vertex, count));
    vertex += count;
  }
  return {found.rays.size() + found.asked.rays, changed + found.asked.changed};
}

void GatherHits::clear(const Guiding& guiding) {
  pending_.reset();
  parts_.assign(samples(), kParts);
  chains_.clear();
  near_.clear();
  targets_.assign(rays_.all(), kDark);
  weights_.assign(guiding.empty() ? 0 : targets_.size(), 0.0f);
  in_beam_.assign(guiding.beams.empty() ? 0 : (targets_.size() + 63) / 64, 0);
}

void GatherHits::cast(const Context& context, const Workers& workers, Progress& progress) {
  const Caster caster(*this, context);
  clear(context.guiding);
  progress.begin("cast gather rays", rays_.all());
  // Work in portions of samples: chains need much less memory once they are stored.
  for (size_t first = 0; first < samples(); first += kPortion) {
    const size_t portion = std::min(kPortion, samples() - first);
    std::vector<CastRays> found((portion + kGrain - 1) / kGrain);
    workers.for_blocks(portion, kGrain, [&](size_t begin, size_t end) {
      std::vector<uint32_t> all;
      for (size_t sample = first + begin; sample < first + end; ++sample) {
        progress.check();
        const SampleRays own = caster.rays(sample);
        all.resize(own.count());
        std::iota(all.begin(), all.end(), 0u);
        caster.cast(own, sample, all, found[begin / kGrain]);
      }
      progress.advance(rays_.first(first + end) - rays_.first(first + begin));
    });
    for (const CastRays& block : found) set(block);
  }
}

void Change::merge(const Change& later) {
  scene.merge(later.scene);
  const auto add = [](std::vector<uint8_t>& to, const std::vector<uint8_t>& from) {
    to.resize(std::max(to.size(), from.size()), 0);
    for (size_t i = 0; i < from.size(); ++i) to[i] |= from[i];
  };
  add(samples, later.samples), add(points, later.points);
}

void GatherHits::note(const Context& context, const Change& change) {
  if (!samples()) return;
  if (!pending_) {
    pending_.emplace();
    pending_->change = change;
  } else {
    pending_->change.merge(change);
  }
  pending_->done = 0;
  // Estimate the distance once per block, since its samples are close together.
  constexpr float kLast = std::numeric_limits<float>::infinity();
  const std::vector<uint8_t>& fresh = pending_->change.samples;
  std::vector<Task>& order = pending_->order;
  order.clear();
  for (size_t first = 0; first < samples(); first += kBlock) {
    const size_t end = std::min(samples(), first + kBlock);
    const direct::Receiver& one = context.receivers[end - 1];
    const Vec3f p = one.point;
    float distance = std::numeric_limits<float>::max();
    for (const trace::MovedObject& moved : pending_->change.scene.objects)
      for (const Box& box : moved.passed) {
        // For samples on the moved object, use the object's extent: they may keep their old light
        // for a moment, but the object's shadow must not lag behind.
        const Vec3f off = one.object == moved.object ? box.extent()
                                                     : max(max(box.low - p, p - box.high), Vec3f{});
        distance = std::min(distance, dot(off, off));
      }
    const auto begin = fresh.begin();
    const bool all = std::any_of(begin + long(first), begin + long(end), std::identity{});
    order.push_back({uint32_t(first / kBlock), 0, all ? 1 : kParts, distance});
  }
  const size_t blocks = order.size();
  for (uint32_t part = 1; part < kParts; part *= 2)
    for (size_t i = 0; i < blocks; ++i)
      if (order[i].end < kParts) order.push_back({order[i].block, part, 2 * part, kLast});
  std::stable_sort(order.begin(), order.end(),
                   [](const Task& a, const Task& b) { return a.distance < b.distance; });
}

double GatherHits::pending_share() const {
  return pending_ ? 1 - double(pending_->done) / double(pending_->order.size()) : 0.0;
}

GatherHits::Cast GatherHits::follow(const Context& context, const Workers& workers,
                                    Progress& progress, const std::function<void(size_t)>& renew,
                                    const std::function<bool()>& more) {
  if (!pending_) return {};
  bound_chains(context, workers);
  const Caster caster(*this, context);
  const StaleRays stale(*this, context, pending_->change);
  const std::vector<Task>& order = pending_->order;
  const std::vector<uint8_t>& fresh = pending_->change.samples;
  Cast cast;
  progress.announce("cast gather rays", order.size() - pending_->done);
  Step next;
  do {
    const Stopwatch watch;
    const size_t first = pending_->done;
    // A sample that casts all rays casts them in parts; a step takes blocks of one part only.
    size_t step = 1;
    while (step < next.size() && first + step < order.size() &&
           order[first + step].part == order[first].part)
      ++step;
    // If there are few blocks, they are expensive ones: divide them more finely.
    const size_t grain = step < kFew ? kBlock / 8 : kBlock;
    std::vector<CastRays> found(step * kBlock / grain);
    workers.for_blocks(step * kBlock, grain, [&](size_t begin, size_t end) {
      const Task& task = order[first + begin / kBlock];
      const size_t from = task.block * kBlock + begin % kBlock;
      const size_t to = std::min(samples(), from + (end - begin));
      if (from >= to) return;
      // Test many samples at once, since most are far from the change.
      Box all_near;
      for (size_t i = from; i < to; ++i) all_near.grow(near_[i]);
      const bool apart = stale.is_apart(all_near);
      StaleRays::Around around;
      for (size_t i = from; i < to; ++i) {
        // Samples that only recast some rays are processed together with the first part of the
        // others.
        const bool all = fresh[i];
        if (!all && (task.part > 0 || caster.blind(i))) continue;
        if (all && task.part == 0) renew(i);
        if (all) parts_[i] = uint8_t(task.end);
        CastRays& own = found[begin / grain];
        const size_t before = own.vertices.size();
        if (!all) stale.look_around(near_[i], apart, around);
        changed_[i] |= caster.renew(i, rays_of(i, task.part), stale, all ? nullptr : &around, own);
        own.grow_by_bends(before, near_[i]);
      }
    });
    progress.advance(step);
    for (const CastRays& own : found) cast += set(own);
    pending_->done += step;
    next.took(watch.milliseconds());
  } while (pending_->done < order.size() && more());
  if (pending_->done == order.size()) pending_.reset();
  return cast;
}

void GatherHits::bound_chains(const Context& context, const Workers& workers) {
  const bool all = near_.empty();
  near_.resize(samples());
  workers.for_blocks(samples(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const direct::Receiver& receiver = context.receivers[i];
      if (receiver.normal == Vec3f{}) continue;  // casts no rays
      Box& own = near_[i];
      own.grow(receiver.point + receiver.normal * receiver.slack());
      for (size_t place = rays_.first(i); all && place < rays_.first(i + 1); ++place)
        if (is_chain(targets_[place]))
          chains_.each_bend(chain_of(targets_[place]), [&](Vec3f p) { own.grow(p); });
    }
  });
}

double GatherHits::PerRay::bytes(bool weighted) const {
  return sizeof(uint32_t) + (weighted ? sizeof(float) : 0) + chains * double(ChainPool::kBytes) +
         vertices * vertex_bytes;
}

GatherHits::PerRay GatherHits::per_ray() const {
  const double rays = std::max(1.0, double(targets_.size()));
  return {double(chains_.size()) / rays, double(chains_.vertex_count()) / rays,
          double(chains_.vertex_bytes())};
}

double GatherHits::forecast_working_bytes(size_t samples, double rays, const PerRay& per_ray) {
  return double(std::min(samples, kPortion)) * rays *
         (sizeof(CastRays::Ray) + per_ray.chains * sizeof(CastRays::Chained) +
          per_ray.vertices * per_ray.vertex_bytes);
}

size_t GatherHits::bytes_in_use() const {
  return (targets_.size() + weights_.size()) * sizeof(uint32_t) +
         in_beam_.size() * sizeof(uint64_t) + changed_.size() + parts_.size() +
         chains_.size() * ChainPool::kBytes + chains_.vertex_count() * chains_.vertex_bytes();
}

size_t GatherHits::bytes() const {
  return targets_.capacity() * sizeof(uint32_t) + weights_.capacity() * sizeof(float) +
         in_beam_.capacity() * sizeof(uint64_t) + changed_.capacity() + parts_.capacity() +
         chains_.bytes();
}

}  // namespace deltalux::gather
