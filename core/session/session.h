// SPDX-License-Identifier: Apache-2.0
// A session: bake once, then edits. The only object that changes a scene, its segments and sums.
#pragma once
#include <array>
#include <future>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/archive.h"
#include "base/progress.h"
#include "base/stopwatch.h"
#include "direct/direct_light.h"
#include "gather/lit_cells.h"
#include "gather/pool_errors.h"
#include "scene/edit.h"
#include "session/affected.h"
#include "session/kept_places.h"
#include "session/path_update.h"
#include "session/state.h"

namespace deltalux::session {

/// What a bake, a recompute or an update did.
struct Frame {
  uint64_t affected_paths = 0, removed_segments = 0, retraced_segments = 0;
  uint64_t scanned_segments = 0, candidates = 0;
  uint64_t gathered_rays = 0;
  double done = 1;  ///< share of the pending paths that were replaced
  std::vector<std::pair<std::string, double>> milliseconds;  ///< by stage, wall clock

  void end_stage(const char* name, Stopwatch& watch) {
    milliseconds.emplace_back(name, watch.lap());
  }
};

/// Power per channel in the unit of the scene: emitted = absorbed + escaped, in quanta.
struct EnergyAudit {
  std::array<int64_t, 3> emitted{}, absorbed{}, escaped{};
  double quantum = 0;
};

class EditLog;
struct Parts;
struct PilotPaths;

struct Forecast {
  uint64_t segments = 0;
  size_t bytes = 0;
  double bytes_per_path = 0;
  uint64_t paths_that_fit = 0;
  gather::Looks::PerRay per_ray;  ///< of a session that gathers
};

class Session {
 public:
  /// Takes ownership; nothing heavy happens before bake(). Throws SceneError, OptionError.
  Session(scene::Scene scene, samples::SampleSet samples, const Options& options);
  ~Session();

  /// Everything: acceleration structures, discs, paths, direct light. Throws Cancelled and leaves
  /// the session as before; throws OptionError before tracing where memory would not suffice.
  Frame bake(Progress& progress);
  /// Everything that depends on poses, lights and reflectances, from scratch.
  Frame recompute(Progress& progress);
  /// Applies `edits` together. Throws Cancelled: then either nothing changed, or the rest is
  /// pending and the next update() finishes it. With `budget_ms` > 0 stops after about that time.
  Frame update(std::span<const scene::Edit> edits, double budget_ms, Progress& progress);
  /// Throws OptionError or SceneError where `edit` cannot be applied after the edits `before` it,
  /// none of which has been applied yet.
  void check(const scene::Edit& edit, std::span<const scene::Edit> before) const;

  /// What every method would cost in each part, the static one first. For a session that is not
  /// baked. Throws Cancelled.
  const std::vector<plan::PartPlan>& plan(Progress& progress);
  /// How methods are chosen where the options leave it to the planner. `frames`: as many as are
  /// expected, nullopt = kExpectedFrames. `rebuilds`: plan as if estimators were made anew in every
  /// frame, which a session never does.
  void set_planning(const plan::Machine& machine, plan::Policy policy, std::optional<double> frames,
                    bool rebuilds);

  bool baked() const { return baked_; }
  /// Of the last update(): false when it threw before its edits took effect.
  bool edits_applied() const { return edits_applied_; }
  double pending_share() const;
  /// Irradiance and standard error, both samples x 3. As of all that read: not from two threads at
  /// a time, since what was found is kept.
  void read(double* irradiance, double* standard_error) const;
  /// The same without errors, sooner.
  void read_irradiance(double* irradiance) const;
  /// The part of that which comes straight from lamps.
  void read_direct(double* irradiance) const;
  /// For displays, samples x 4: irradiance, and the standard error of its weighted sum, the
  /// channels' errors taken as correlated, or 0 without `errors`, which takes half of the time.
  void read_packed(const std::array<double, 3>& weights, bool errors, float* values) const;
  /// read_packed() without errors for what moves while one looks on: after an update that moved
  /// something, gathered light is read of samples whose rays were cast again and of an eighth of
  /// the others, in turn; the rest keep theirs.
  void glance(float* values);
  struct Asked {
    uint32_t rays = 0;      ///< to gather along; 0: as the session does
    bool by_need = false;   ///< see direct::light_by_need
    size_t keep_bytes = 0;  ///< what places saw is kept for the next time, at most so much of it
  };
  /// Direct and indirect irradiance at any points, each x 3: of sessions that gather. What is null
  /// is not asked for. `noise`: of indirect light, standard error of the channels' sum by the
  /// choice of rays alone, somewhat overrated; one each. Throws Cancelled.
  void gather_at(std::span<const Vec3f> points, std::span<const Vec3f> normals, const Asked& asked,
                 double* direct, double* indirect, double* noise, Progress& progress);
  /// Surface gradient, samples x 3 channels x 3 axes (world), from all stored segments.
  void read_gradient(double* gradient, Progress& progress);
  /// Sums of all batches and groups in quanta, samples x 3, without direct light by shadow rays.
  void read_sums(int64_t* sums) const;
  /// 1 where nothing lies between points from[i] and to[i] at present.
  std::vector<uint8_t> visible(std::span<const Vec3f> from, std::span<const Vec3f> to) const;
  /// Of each sample, what its disc counts (square metres) and its radius.
  std::vector<float> areas() const { return as_given(state_->area); }
  std::vector<float> radii() const { return as_given(state_->samples.radius); }
  /// Samples that take light, but that no path has reached: their standard error is what a single
  /// one would bring.
  size_t unreached() const;
  std::array<uint64_t, 4> digest() const;
  EnergyAudit audit() const;
  Forecast forecast() const { return forecast_; }
  size_t bytes() const;

  const State& state() const { return *state_; }
  const direct::DirectLight* direct() const { return direct_.get(); }
  /// Null where nothing is kept.
  const KeptPlaces* kept() const { return kept_.get(); }

  /// Snapshot: named arrays, see snapshot.cpp. Valid until the session changes.
  ArchiveView save() const;
  /// Wants a session freshly made from the same scene, samples and options; where it throws, that
  /// session is of no use. Throws FormatError, OptionError, SceneError, Cancelled.
  void restore(ArchiveSource& archive, Progress& progress);

 private:
  /// What read_samples() gathers where all is asked for.
  auto all_gathered() const;
  /// Gathered light of a block of samples.
  template <class Gathered>
  std::vector<gather::Estimate> gathered_block(const gather::Evaluation& now,
                                               const Gathered& gathered, size_t begin, size_t end,
                                               bool errors) const;
  bool is_present(size_t sample) const;
  /// Calls write(sample as given, its irradiance, its standard error) for all, in parallel;
  /// gathered(evaluation, sample, irradiance, standard error) for those of sessions that gather.
  template <class Gathered, class Write>
  void read_samples(bool errors, const Gathered& gathered, const Write& write) const;
  std::vector<float> as_given(const std::vector<float>& own) const;
  void forecast_memory(const PilotPaths& paths);
  /// Adds direct light to the forecast. Throws OptionError where it exceeds the limit.
  void refuse_beyond_limit();
  /// What a few rays of a few samples tell about all.
  gather::Looks::PerRay pilot_rays() const;
  /// Whether the session may hold so many rays; then they are in its forecast.
  bool fits(const gather::RayCounts& rays);
  void check_insert(const scene::Object& object, std::span<const scene::Edit> before) const;
  void choose_direct();
  void trace_all(Progress& progress, Frame& frame);
  /// Traces all paths, in steps that touch every batch alike.
  PathCounts trace_lights(Progress& progress);
  void compute_direct(Progress& progress);
  void update_direct(std::span<const ObjectChange> changes, size_t old_lights, double budget_ms,
                     Progress& progress);
  /// Cells without light; nothing in sessions that do not gather, as the next four.
  void make_cells();
  /// Makes room for objects that came.
  void grow_cell_sums();
  /// Forgets those that an edit that failed brought.
  void shrink_cell_sums() noexcept;
  /// With new guides, as a bake wants them, or those that it chose.
  void look_around(Progress& progress, bool new_guides = false);
  /// Beams in their places and guides; what cells send then.
  gather::LitCells lit_cells(const gather::Evaluation& now) const;
  gather::Evaluation choose_guides(Progress& progress);
  /// Receivers that look around, the guides that they see, none without guides, and their light
  /// from lamps.
  struct Places {
    std::span<const direct::Receiver> receivers;
    std::span<const gather::SeenGuides> seen;
    std::span<const Vec3d> direct;
  };
  /// How many rays each sample casts. `seen`: by all of them.
  void choose_rays(const gather::Evaluation& now, std::span<const gather::SeenGuides> seen,
                   Progress& progress);
  static constexpr uint64_t kPilotSeed = 0x70696c6f74212121ull;
  /// How many receivers of so many rays each are looked at together.
  static size_t seen_together(uint32_t rays);
  /// Of so many receivers' pilots, where `rays` is the standard number.
  static gather::RayCounts pilot_rays_of(size_t receivers, uint32_t rays);
  /// What a few rays tell about each place, or about one whose pilots have cast theirs.
  std::vector<gather::PilotLook> pilots_of(const Places& places, uint32_t rays,
                                           const gather::Evaluation& now) const;
  gather::PilotLook pilot_of(const gather::Looks& pilots, size_t number,
                             const direct::Receiver& receiver, Vec3d direct,
                             const gather::Evaluation& now) const;
  /// Whether numbers of rays follow from pilots.
  bool needs_pilots() const;
  /// How often the number of `rays` doubles at each.
  std::vector<int8_t> doublings_of(std::span<const direct::Receiver> receivers,
                                   std::span<const gather::PilotLook> pilots, uint32_t rays) const;
  /// What receivers see. `direct`: their light from lamps.
  std::unique_ptr<KeptPlaces::Batch> look_from(std::vector<direct::Receiver> receivers,
                                               std::span<const Vec3d> direct, uint32_t rays,
                                               const gather::Evaluation& now) const;
  /// Their light from lamps; `kept` may be null.
  std::vector<Vec3d> direct_of(std::span<const direct::Receiver> receivers, bool by_need,
                               KeptPlaces* kept, Progress& progress) const;
  /// Per light, its group's factor.
  std::vector<double> dim_of_lights() const;
  /// Brings what is kept to the present state. Where it throws nothing is kept.
  void follow_kept(const gather::Evaluation& now, Progress& progress);
  /// Those of `kept`, as it is followed, with as many rays as they need now.
  std::vector<KeptPlaces::Place> find_kept(const KeptPlaces& kept,
                                           std::span<const direct::Receiver> receivers,
                                           std::span<const Vec3d> direct, uint32_t rays,
                                           const gather::Evaluation& now) const;
  void indirect_at(std::span<const direct::Receiver> receivers, std::span<const Vec3d> direct,
                   uint32_t rays, const gather::Evaluation& now, KeptPlaces* kept, double* indirect,
                   double* noise) const;
  std::vector<direct::Receiver> receivers_at(std::span<const Vec3f> points,
                                             std::span<const Vec3f> normals) const;
  /// Of those lights (per light: 1), by shadow rays.
  std::unique_ptr<direct::DirectLight> direct_at(std::span<const direct::Receiver> receivers,
                                                 std::span<const uint8_t> lights) const;
  /// Of `count` receivers from number `first` on.
  std::vector<Vec3d> irradiance_of(const direct::DirectLight& direct, size_t first,
                                   size_t count) const;
  void place_asked();
  /// Those worth asking for where rays land. `hits`: see Votes.
  std::vector<uint32_t> find_suns(std::span<const uint32_t> hits) const;
  /// Each sample's rays, and their shares; `now`: of a bake, which chooses their numbers.
  void aim(const std::optional<gather::Evaluation>& now, Progress& progress);
  /// Of the present sums; nullopt in sessions that do not gather.
  std::optional<gather::Evaluation> evaluation(bool errors) const;
  gather::Present present(std::span<const direct::Receiver> receivers,
                          const gather::Guiding& guiding) const;
  /// The guides that a receiver sees where `rays` is the standard number.
  gather::SeenGuides guides_at(const direct::Receiver& receiver, uint32_t rays) const;
  std::vector<gather::SeenGuides> guides_at(std::span<const direct::Receiver> receivers,
                                            uint32_t rays, Progress& progress) const;
  gather::RayShares share(size_t sample) const;
  void renew_share(size_t sample);
  std::vector<gather::RayShares> shares_of(std::span<const gather::SeenGuides> seen,
                                           const gather::RayCounts& rays) const;
  gather::Guiding guiding_of(std::span<const gather::SeenGuides> seen,
                             const gather::RayCounts& rays) const;
  gather::Looks looks_of(std::span<const direct::Receiver> receivers,
                         const gather::Guiding& guiding, const gather::RayCounts& rays,
                         uint64_t seed, const gather::Evaluation& now) const;
  /// Lets what samples see wait for Looks::follow().
  void note_looks(std::span<const ObjectChange> changes, bool lights);
  void note_beams(std::span<const uint32_t> objects, std::span<const Box> boxes,
                  gather::Change& change);
  void refresh_areas(const std::vector<ObjectChange>* changes);
  /// Renews receivers_: all of them, or those of changed objects (per object: 1).
  void place_receivers(const std::vector<uint8_t>* changed);
  /// Renews the caster, radii and discs; the parts have no estimators before make_estimators().
  /// `openness`: of each sample where it is known, as from a file; else it is found.
  Parts place_parts(Progress& progress, std::span<const float> openness = {});
  void allot_paths(Progress& progress);
  /// Renews State::plans.
  void plan_parts(Parts& parts, const PilotPaths& paths, bool thorough, Progress& progress);
  void make_estimators(Parts& parts, Progress& progress);
  void restore_scene(ArchiveSource& archive);
  /// Paths of lights and scales; returns the number of paths.
  uint64_t restore_lights(ArchiveSource& archive);
  void restore_areas(ArchiveSource& archive, std::span<const float> openness);
  void restore_segments(ArchiveSource& archive, uint64_t paths, Progress& progress);
  void restore_pending(ArchiveSource& archive);
  void restore_direct(ArchiveSource& archive);
  void restore_looks(ArchiveSource& archive, Progress& progress);
  /// Applies `edits` and finds what they affect; where it throws, everything is as before.
  Affected apply(std::span<const scene::Edit> edits, EditLog& log, double budget_ms,
                 Stopwatch& watch, Progress& progress, Frame& frame);
  /// Brings paths, rays and areas up to date with edits that were applied. Returns what
  /// run_pending() does.
  size_t follow(std::span<const scene::Edit> edits, const EditLog& log, const Affected& affected,
                double budget_ms, Stopwatch& watch, Progress& progress, Frame& frame);
  /// Cuts and traces again what `log` and the search after it found, and what waited before.
  /// Returns what run_pending() does.
  size_t replace_paths(const EditLog& log, const Affected& affected, double budget_ms,
                       Progress& progress, Frame& frame);
  /// Throws OptionError where paths between brighter surfaces would need more than the limit.
  void refuse_growth(Progress& progress);
  /// Paths and sums of the present state from scratch, after an update that failed in the middle.
  void rebuild(Progress& progress);
  /// Throws Error while neither the state before nor after an update is there.
  void check_whole() const;
  double bytes_per_segment() const;
  double choose_irradiance_quantum() const;
  std::unique_ptr<direct::DirectLight> make_direct(double irradiance_quantum) const;
  /// Returns how many paths wait because memory would not suffice for them.
  size_t run_pending(double budget_ms, Progress& progress, Frame& frame,
                     const std::function<void()>& between);

  std::unique_ptr<State> state_;
  std::unique_ptr<direct::DirectLight> direct_;
  std::vector<direct::Receiver> receivers_;  // per sample, in the present pose
  std::vector<PendingPath> pending_;
  std::unique_ptr<KeptPlaces> kept_;  // of pictures, of the state that they saw last
  /// Frees what a cancelled call left behind, gigabytes perhaps, without making the caller wait.
  template <class T>
  void dispose(T&& waste) {
    try {
      disposal_ = std::async(std::launch::async, [gone = std::forward<T>(waste)] {});
    } catch (...) {  // no thread to be had: at once, then
    }
  }

  Forecast forecast_;
  std::future<void> disposal_;
  bool baked_ = false;
  bool edits_applied_ = true;
  bool damaged_ = false;  ///< an update failed in the middle, and so did rebuild()
};

}  // namespace deltalux::session
