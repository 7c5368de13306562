// SPDX-License-Identifier: Apache-2.0
// A session: one bake, then edits. The only class that changes a scene together with its segments
// and sums.
#pragma once
#include <array>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/archive.h"
#include "base/assertion.h"
#include "base/progress.h"
#include "base/stopwatch.h"
#include "direct/direct_light.h"
#include "gather/choose/lit_cells.h"
#include "gather/looks/pool_errors.h"
#include "scene/edit.h"
#include "session/flow/affected.h"
#include "session/flow/path_update.h"
#include "session/rays/kept_places.h"
#include "session/shared/awaited.h"
#include "session/shared/path_sums.h"
#include "session/state/state.h"

namespace deltalux::session {

/// Statistics of a bake, a recompute or an update.
struct Frame {
  uint64_t affected_paths = 0, removed_segments = 0, retraced_segments = 0;
  uint64_t scanned_segments = 0, candidates = 0;
  /// Gather rays that were cast, and of those of an update, how many brought something else than
  /// before.
  uint64_t gathered_rays = 0, changed_rays = 0;
  /// The smallest of three shares: of pending paths replaced, of direct light and of gather rays
  /// that are up to date.
  double done = 1;
  std::vector<std::pair<std::string, double>> milliseconds;  ///< by stage, wall clock

  /// Records the time since the last stage under `name`.
  void end_stage(const char* name, Stopwatch& watch) {
    milliseconds.emplace_back(name, watch.lap());
  }
};

/// Energy balance per channel, in quanta, of the paths held: emitted = absorbed + escaped.
/// `quantum` is in the scene's unit of power.
struct EnergyAudit {
  __extension__ using Quanta = std::array<__int128, 3>;
  Quanta emitted{}, absorbed{}, escaped{};
  double quantum = 0;
};

class EditLog;

/// Expected memory, from a few pilot paths and pilot rays.
struct Forecast {
  uint64_t segments = 0;
  size_t bytes = 0;
  double bytes_per_path = 0;
  uint64_t paths_that_fit = 0;
  gather::Looks::PerRay per_ray;  ///< of sessions with a final gather
};

class Session {
 public:
  /// Takes ownership. All expensive work happens in bake(). Throws SceneError, OptionError.
  Session(scene::Scene scene, samples::SampleSet samples, const Options& options);
  ~Session();

  /// Computes everything: acceleration structures, discs if any count, paths, direct light, gather
  /// rays. Throws Cancelled and leaves the session as it was. Throws OptionError before tracing if
  /// the memory limit would be exceeded. `leave_direct`: leave shadow rays of samples to others,
  /// see take_direct().
  Frame bake(Progress& progress, bool leave_direct = false);
  /// Recomputes everything that depends on poses, lights and reflectances.
  Frame recompute(Progress& progress);
  /// Applies `edits` together. Throws Cancelled; then either nothing changed, or the remaining work
  /// is pending and the next update() finishes it. With `budget_ms` > 0, stops after about that
  /// time.
  Frame update(std::span<const scene::Edit> edits, double budget_ms, Progress& progress);
  /// Throws OptionError or SceneError if `edit` cannot be applied after the edits `before` it, none
  /// of which has been applied yet.
  void check(const scene::Edit& edit, std::span<const scene::Edit> before) const;

  /// Predicts the cost of every method for each part, the static part first. Only for a session
  /// that is not baked. Throws Cancelled.
  const std::vector<plan::PartPlan>& plan(Progress& progress);
  /// Sets how the planner chooses methods where the options leave the choice to it. `frames`: the
  /// expected number of updates; nullopt means kExpectedFrames. `rebuilds`: plan as if estimators
  /// were built anew in every frame, which a session never does.
  void set_planning(const plan::Machine& machine, plan::Policy policy, std::optional<double> frames,
                    bool rebuilds);

  bool baked() const { return baked_; }
  /// Whether the edits of the last update() are in effect: false if it threw before that.
  bool edits_applied() const { return edits_applied_; }
  /// Before an update() that may not come about.
  void expect_edits() { edits_applied_ = false; }
  /// The share of the work that remains after the last update(): the largest of the shares of
  /// paths, direct light and gather rays.
  double pending_share() const;
  /// Writes irradiance and standard error, each samples x 3. Returns the RMS of relative standard
  /// errors over what it would be without rays that hit rare bright places, which a bake may find
  /// and aim at; 1 without a final gather. This and the other functions that read irradiance update
  /// caches, so no two threads may call them at the same time.
  double read(double* irradiance, double* standard_error) const;
  /// Writes irradiance only, which is faster.
  void read_irradiance(double* irradiance) const;
  /// Writes the part of the irradiance that comes straight from lights.
  void read_direct(double* irradiance) const;
  /// For displays, samples x 4: irradiance, and the standard error of its weighted sum, for which
  /// the errors of the channels are taken as fully correlated. Without `errors`, which take half of
  /// the time, the fourth value is not written.
  void read_packed(const std::array<double, 3>& weights, bool errors, float* values) const;
  /// Like read_packed() without errors, for light that changes while the user watches. After an
  /// update that moved something, reads gathered light only for samples whose rays were cast again,
  /// and for an eighth of the others in turn; the rest keep the values read last.
  void glance(float* values);
  /// Options of gather_at().
  struct Asked {
    uint32_t rays = 0;     ///< gather rays per point; 0: as many as the session uses
    bool by_need = false;  ///< see direct::light_by_need
    /// Keep what gather rays met, and direct light, for the next call, up to this many bytes.
    size_t keep_bytes = 0;
  };
  /// Direct and indirect irradiance at arbitrary points, each x 3, for sessions with a final
  /// gather. A null output is not computed. `noise`: one number per point, the standard error of
  /// the indirect light's sum of channels, due to the random choice of rays alone; somewhat
  /// overestimated. Throws Cancelled.
  void gather_at(std::span<const Vec3f> points, std::span<const Vec3f> normals, const Asked& asked,
                 double* direct, double* indirect, double* noise, Progress& progress);
  /// Surface gradients of irradiance, samples x 3 channels x 3 axes (world), from all stored
  /// segments. `others`: of the paths that other sessions hold, for a session without paths.
  void read_gradient(double* gradient, Progress& progress, const SlopeSums& others = {});
  /// Sums of all batches and groups in quanta, samples x 3; without direct light by shadow rays.
  void read_sums(int64_t* sums) const;
  /// 1 for each i for which nothing lies between from[i] and to[i] at present.
  std::vector<uint8_t> visible(std::span<const Vec3f> from, std::span<const Vec3f> to) const;
  /// For each sample: the area that its disc counts (square metres), and its radius.
  /// Values in the order in which the user gave the samples.
  std::vector<float> areas();
  std::vector<float> radii(Progress& progress);
  /// Number of present samples that no path and no gather ray with light has reached. Without a
  /// final gather, their standard error is estimated from the power of a single path, see
  /// UnreachedError.
  size_t unreached() const;
  /// Fingerprint of the state, equal for equal states, whatever the order of work was. `others`:
  /// the segments of paths that other sessions hold.
  std::array<uint64_t, 4> digest(const std::optional<SegmentsHash>& others = {}) const;
  EnergyAudit audit() const;
  /// What the bake predicted.
  Forecast forecast() const { return forecast_; }
  size_t bytes() const;

  /// Another one after every bake, recompute and update.
  const State& state() const { return *state_; }
  const direct::DirectLight* direct() const { return state_->direct.light.get(); }
  /// Null if nothing is kept.
  const KeptPlaces* kept() const { return kept_.get(); }

  // Several sessions of the same scene, samples and options may share the paths by Options::range.
  // Those with a part of them trace, store and sum up; they have no light to read. One without
  // paths evaluates the sums of all parts: its results, and its digest, are those of a session that
  // holds all paths. Bake it like the others, add their sums to it, and call its look(); then call
  // ask_for() of each part with the lights that look() chose. All sessions get the same edits.
  /// The sums of the paths held here, and of those added.
  PathSums path_sums() const;
  SegmentsHash segments_hash() const;
  SlopeSums slope_sums(Progress& progress);
  /// What these sums changed since the last call, or since the bake or a recompute: then all of
  /// them. Only for a baked session with a part of the paths. Throws OptionError.
  PathChanges path_changes();
  /// Adds what the sums of paths that other sessions hold changed. Only for a baked session without
  /// paths, which notes the ranges: its light cannot be read before all paths' changes by all edits
  /// are there. Throws OptionError.
  void add_path_changes(const PathChanges& more);
  /// The first flights of the paths held here. Only in sessions with a final gather; else empty.
  FirstFlights first_flights() const;
  /// Completes the bake of a session without paths once the sums of all are added: chooses guides,
  /// and casts gather rays. `others`: the sum of first_flights() of all ranges. Does nothing
  /// without a final gather. Throws Cancelled, and leaves the session as it was.
  void look(const FirstFlights& others, Progress& progress);
  /// The lights whose direct light look() left to shadow rays of the gather.
  std::vector<uint32_t> asked_lights() const;
  /// Leaves the first flights from these lights out of the cells, in a session with a part of the
  /// paths, after its bake.
  void ask_for(std::span<const uint32_t> lights);

  // Or the parts do most of what look() does: begin_look(); ask_for() and join_look() of each part;
  // number_rays() of a part for each range of the samples, and take_numbers() of all; cast_looks()
  // of a part and take_looks() for each range. Samples count in the order of World::samples. A look
  // that was begun and not completed can only be replaced by a bake, or forgotten.

  /// The session is as before its first bake, but for edits.
  void forget_bake();
  /// Chooses guides. Does nothing without a final gather. Throws Cancelled, and leaves the session
  /// as it was.
  void begin_look(const FirstFlights& others, Progress& progress);
  /// Whether a look was begun and is not complete.
  bool is_looking() const { return looking_ != nullptr; }
  /// What parts need to know for that: guides, the need for rays, and the light of the cells. Valid
  /// until the session changes.
  ArchiveView save_look() const;
  void join_look(ArchiveSource& archive);
  /// Direct light of samples [first, last), by which their numbers of rays are chosen: that of the
  /// factors of begin_look().
  std::vector<Vec3d> direct_of_samples(size_t first, size_t last) const;
  /// The numbers of rays of the samples from `first` on that have this direct light.
  RayNumbers number_rays(size_t first, std::span<const Vec3d> direct, Progress& progress) const;
  /// Takes those of all samples.
  void take_numbers(RayNumbers numbers);
  /// Cuts the samples into ranges of about so many rays.
  std::vector<uint64_t> look_cuts(uint64_t rays) const;
  /// Where the rays of samples [first, last) go. Valid until the session changes.
  ArchiveView save_aims(size_t first, size_t last) const;
  /// What rays that go there meet.
  gather::Looks cast_looks(size_t first, size_t last, ArchiveSource& aims,
                           Progress& progress) const;
  /// Puts what cast_looks() found, and saved, in place. With the last range, the look is complete.
  void take_looks(size_t first, size_t last, ArchiveSource& archive);

  // In the same way, parts may compute direct light after their bake, before the look begins:
  // place_samples() and cast_direct() of parts, and take_direct().

  void place_samples();
  /// The direct light of samples [first, last).
  direct::DirectLight cast_direct(size_t first, size_t last, Progress& progress) const;
  /// Puts what cast_direct() found, and saved, in place.
  void take_direct(size_t first, size_t last, ArchiveSource& archive);
  /// Whether a bake left direct light to others, and some is missing.
  bool awaits_direct() const { return awaited_direct_ != nullptr; }

  /// Snapshot as named arrays, see snapshot.cpp. Valid until the session changes. `shared`: of a
  /// session without paths, with the sums that were added, to which the paths of others belong.
  ArchiveView save(bool shared = false) const;
  /// What a bake chose and edits made of the scene, without paths, direct light and gather rays:
  /// all that a session with a part of the paths needs to trace them anew, whatever its range.
  /// Valid until the session changes.
  ArchiveView save_choices() const;
  /// Restores a snapshot. The session must be freshly made from the same scene, samples and
  /// options. Of save_choices() it restores a session whose paths all wait to be traced. Throws
  /// FormatError, OptionError, SceneError, Cancelled; the session is useless then.
  void restore(ArchiveSource& archive, Progress& progress);

 private:
  /// How far an update is. Only at rest, results may be read: sums, marks and scene belong
  /// together.
  enum class Step : uint8_t {
    rest,
    applied,   ///< the scene is the new one, and what that affects is found
    marked,    ///< affected paths are cut and wait
    replaced,  ///< as many of them as were asked for are traced again
  };
  /// A callback for read_samples() that reads the gathered light of every sample.
  auto all_gathered() const;
  /// Reads the gathered light of samples [begin, end), with pooled errors if `errors`.
  template <class Gathered>
  std::vector<gather::Estimate> gathered_block(const gather::Evaluation& now,
                                               const Gathered& gathered, size_t begin, size_t end,
                                               bool errors) const;
  /// A copy of what the user gave, and of what edits made of it.
  std::unique_ptr<State> unbaked() const;
  /// Puts `fresh` in the place of the state, and computes it. If that throws, the session is as it
  /// was.
  Frame replace(std::unique_ptr<State> fresh, const std::function<Frame()>& compute);
  /// For each sample, in parallel, calls write(its index as given by the user, SampleLight). In
  /// sessions with a final gather, the part of the light that rays bring is gathered(evaluation,
  /// sample), for each present sample.
  template <class Gathered, class Write>
  void read_samples(bool errors, const Gathered& gathered, const Write& write) const;
  void forecast_memory(const PilotPaths& paths);
  /// Adds direct light and gather rays to the forecast. Throws OptionError if it exceeds the memory
  /// limit.
  void refuse_beyond_limit();
  /// Casts a few rays from a few samples, to predict the memory of all rays.
  gather::Looks::PerRay pilot_rays() const;
  /// Whether so many gather rays fit into the memory limit; if so, adds them to the forecast.
  bool fits(const gather::RayCounts& rays);
  /// The part of check() for objects that come with a new mesh.
  void check_insert(const scene::Object& object, std::span<const scene::Edit> before) const;
  void trace_all(Progress& progress, Frame& frame);
  /// Traces all paths, in steps that each take the same share of every batch.
  PathCounts trace_lights(Progress& progress);
  /// Divides the surface into cells, which hold no light yet. In sessions without a final gather
  /// this and the next functions do nothing.
  void make_cells(Progress& progress);
  /// Adds cells for objects, and cells' sums for light groups, that edits added.
  void grow_cell_sums(const Progress& progress);
  /// Adds all sums for objects and light groups that edits added.
  void grow_sums(const Progress& progress);
  /// Removes the sums for objects and light groups that a failed edit had added.
  void shrink_sums() noexcept;
  /// Lays out the sums on discs and of direct light for the present light groups.
  void lay_out_sums();
  void cover_cells(Progress& progress);
  /// Casts the gather rays of all samples. `new_guides`: choose guides and ray counts, as a bake
  /// does; otherwise keep those of the bake. `others`: first flights of paths that other sessions
  /// hold; `chosen` is called once guides are chosen. In a session with a part of the paths this
  /// does nothing.
  void look_around(Progress& progress, bool new_guides = false, const FirstFlights& others = {},
                   const std::function<void()>& chosen = {});
  /// Subtracts from sums of the cells what `flights` brought from this light.
  void leave_out(uint32_t light, const FirstFlights& flights, std::vector<int64_t>& quanta) const;
  /// The same for the present sums.
  void leave_out(uint32_t light, const FirstFlights& flights);
  /// Expected memory for what a session with a range of the paths gives to others or takes from
  /// them: first flights, and the sums that path_changes() returned last.
  size_t forecast_sharing() const;
  /// Counts edits that took effect; `complete`: whether the sums of all paths were there before.
  void count_edits(size_t edits, bool complete);
  /// In a session without paths: how many of Options::paths have their sums here, and whether all
  /// have.
  uint64_t added_paths() const;
  bool has_all_sums() const { return added_paths() == state_->options.paths; }
  /// Throws OptionError where a look cannot begin; returns whether there is anything to do.
  bool may_look(const FirstFlights& others) const;
  /// Runs `choose`; if that throws, the session is as it was.
  void choose_look(const std::function<void()>& choose);
  /// A look that was begun. `counted`: whether the numbers of rays must be there, or must not.
  /// Throws OptionError if there is no such look.
  struct Looking;
  const Looking& looking(std::optional<bool> counted = {}) const;
  /// Throws OptionError in a session that did not join a look, or has no such samples.
  void check_joined(size_t first, size_t last) const;
  /// Whether the gather rays of a baked session are cast.
  bool looked() const;
  /// The cells that send light at present, see LitCells.
  gather::LitCells lit_cells(const gather::Evaluation& now) const;
  /// Chooses beams, suns and guides; returns the light of all cells, without the direct light of
  /// beams and suns.
  gather::Evaluation choose_guides(const FirstFlights& others, Progress& progress);
  /// Receivers that cast gather rays, the guides that each sees (empty if there are no guides), and
  /// their direct light.
  struct Places {
    std::span<const direct::Receiver> receivers;
    std::span<const gather::SeenGuides> seen;
    std::span<const Vec3d> direct;
  };
  /// Chooses the rule for numbers of rays. Returns whether anything is lit.
  bool choose_need(const gather::Evaluation& now);
  /// Chooses how many rays each sample casts. `seen`: the guides seen by every sample.
  void choose_rays(const gather::Evaluation& now, std::span<const gather::SeenGuides> seen,
                   Progress& progress);
  /// How often each place doubles the standard number of rays, by pilot rays.
  std::vector<int8_t> piloted(const Places& places, const gather::Evaluation& now) const;
  /// Adds the rays chosen to the forecast; drops the choice if they exceed the memory limit.
  void fit_rays();
  /// The looks of all samples before they are cast; shares their rays among the guides seen.
  gather::Looks uncast(std::span<const gather::SeenGuides> seen);
  static constexpr uint64_t kPilotSeed = 0x70696c6f74212121ull;
  /// How many receivers, of so many rays each, are processed together.
  static size_t seen_together(uint32_t rays);
  /// Ray counts for pilot rays, where `rays` is the standard number.
  static gather::RayCounts pilot_rays_of(size_t receivers, uint32_t rays);
  /// What pilot rays tell about the noise at each place; pilot_of(): at one place whose pilot rays
  /// were cast already.
  std::vector<gather::PilotLook> pilots_of(const Places& places, uint32_t rays,
                                           const gather::Evaluation& now) const;
  gather::PilotLook pilot_of(const gather::Looks& pilots, size_t number,
                             const direct::Receiver& receiver, Vec3d direct,
                             const gather::Evaluation& now) const;
  /// Whether ray counts depend on pilot rays.
  bool needs_pilots() const;
  /// How often each receiver doubles the standard number of `rays`; negative: halves.
  std::vector<int8_t> doublings_of(std::span<const direct::Receiver> receivers,
                                   std::span<const gather::PilotLook> pilots, uint32_t rays) const;
  /// Casts the gather rays of receivers. `direct`: their direct light.
  std::unique_ptr<KeptPlaces::Batch> look_from(std::vector<direct::Receiver> receivers,
                                               std::span<const Vec3d> direct, uint32_t rays,
                                               const gather::Evaluation& now) const;
  /// Direct light of receivers, from `kept` where it is there; `kept` may be null.
  std::vector<Vec3d> direct_of(std::span<const direct::Receiver> receivers, bool by_need,
                               KeptPlaces* kept, Progress& progress) const;
  /// The dim factor of each light's group.
  std::vector<double> dim_of_lights() const;
  /// Brings what is kept for images to the present state. If it throws, nothing is kept any more.
  void follow_kept(const gather::Evaluation& now, Progress& progress);
  /// Looks receivers up among what is kept; a place counts as found only if its ray count still
  /// suits the present light. `kept` must be up to date.
  std::vector<KeptPlaces::Place> find_kept(const KeptPlaces& kept,
                                           std::span<const direct::Receiver> receivers,
                                           std::span<const Vec3d> direct, uint32_t rays,
                                           const gather::Evaluation& now) const;
  /// Indirect irradiance and noise of receivers, from kept rays or new ones; `kept` and `noise` may
  /// be null.
  void indirect_at(std::span<const direct::Receiver> receivers, std::span<const Vec3d> direct,
                   uint32_t rays, const gather::Evaluation& now, KeptPlaces* kept, double* indirect,
                   double* noise) const;
  std::vector<direct::Receiver> receivers_at(std::span<const Vec3f> points,
                                             std::span<const Vec3f> normals) const;
  /// Places beams and suns in the present scene.
  void place_beams_and_suns();
  /// The suns that are worth a shadow ray at every gather hit. `hits`: see BrightnessSurvey.
  std::vector<uint32_t> find_suns(std::span<const uint32_t> hits, const FirstFlights& others) const;
  /// Shares each sample's rays among guides and hemisphere. `now`: given at a bake, which also
  /// chooses ray counts.
  void aim(const std::optional<gather::Evaluation>& now, Progress& progress);
  /// The light of all cells at present; nullopt in sessions without a final gather.
  std::optional<gather::Evaluation> evaluation(bool errors) const;
  gather::Present present(std::span<const direct::Receiver> receivers,
                          const gather::Guiding& guiding) const;
  /// The guides that a receiver sees, where `rays` is the standard number.
  gather::SeenGuides guides_at(const direct::Receiver& receiver, uint32_t rays) const;
  std::vector<gather::SeenGuides> guides_at(std::span<const direct::Receiver> receivers,
                                            uint32_t rays, Progress& progress) const;
  /// How the sample divides its rays among the guides that it sees.
  gather::RayShares share(size_t sample) const;
  void renew_share(size_t sample);
  std::vector<gather::RayShares> shares_of(std::span<const gather::SeenGuides> seen,
                                           const gather::RayCounts& rays) const;
  gather::Guiding guiding_of(std::span<const gather::SeenGuides> seen,
                             const gather::RayCounts& rays) const;
  gather::Looks looks_of(std::span<const direct::Receiver> receivers,
                         const gather::Guiding& guiding, const gather::RayCounts& rays,
                         uint64_t seed, const gather::Evaluation& now) const;
  /// Marks the gather rays that an edit may have changed, which Looks::follow() casts again.
  void note_looks(const EditLog& log);
  void note_beams(gather::Change& change);
  /// Parts of save(): the scene as edits left it; what the bake chose.
  void save_scene(ArchiveView& archive) const;
  void save_bake(ArchiveView& archive) const;
  void restore_scene(ArchiveSource& archive);
  /// Restores the path counts of lights and the scales.
  void restore_lights(ArchiveSource& archive);
  void restore_looks(ArchiveSource& archive, Progress& progress);
  /// Applies `edits` and finds what they affect. If it throws, everything is as before.
  Affected apply(std::span<const scene::Edit> edits, EditLog& log, double budget_ms,
                 Stopwatch& watch, Progress& progress, Frame& frame);
  /// Recomputes everything after edits that changed Scene::world(): each segment that leaves the
  /// scene ends on its border, and what finds segments counts in shares of it. If it throws, only
  /// what the log knows has changed.
  void renew(Progress& progress, Frame& frame);
  /// Brings paths, gather rays and areas up to date with the edits applied. Returns the number of
  /// refused paths, as run_pending() does.
  size_t follow(std::span<const scene::Edit> edits, const EditLog& log, const Affected& affected,
                double budget_ms, Stopwatch& watch, Progress& progress, Frame& frame);
  /// Marks the paths that `log` and `affected` name, and replaces them and those that waited
  /// before. Returns the number of refused paths, as run_pending() does.
  size_t replace_paths(const EditLog& log, const Affected& affected, double budget_ms,
                       Progress& progress, Frame& frame);
  /// Throws OptionError if brighter surfaces would make paths so long that they exceed the memory
  /// limit.
  void refuse_growth(Progress& progress);
  /// Recomputes all paths and sums of the present state, after an update that failed in the middle.
  void rebuild(Progress& progress);
  /// Throws Error if an update failed in the middle and so did rebuild(), so that there is no valid
  /// state.
  void check_whole() const;
  /// Enters the next step of an update.
  void enter(Step from, Step next) {
    DELTALUX_ASSERT(step_ == from);
    step_ = next;
  }
  /// Throws OptionError in a session without paths that lacks sums of some.
  void check_added() const;
  /// Throws OptionError in a session without paths before look(), or before others gave what
  /// direct light was left to them.
  void check_looked() const;
  /// Throws OptionError, or Error as check_whole() does, unless there is light to read.
  void check_readable() const;
  /// Replaces pending paths within the time budget. Returns how many of them remain because the
  /// memory limit does not admit them.
  size_t run_pending(double budget_ms, Progress& progress, Frame& frame,
                     const std::function<void()>& between);

  std::unique_ptr<State> state_;
  std::unique_ptr<KeptPlaces> kept_;  // rays and light of the last images
  /// bytes() without spare discs: whether an edit is admitted does not depend on these.
  size_t needed_bytes() const;
  /// The sums that path_changes() returned last.
  struct Told {
    std::vector<int64_t> discs, cells;
    uint32_t groups = 1;  // that `cells` is laid out for
    uint64_t edits = 0;
    void set_groups(uint32_t count);
  };
  std::unique_ptr<Told> told_;
  /// In a session without paths, between begin_look() and the last take_looks().
  struct Looking {
    bool lit = false;               ///< whether anything is
    std::vector<double> factors{};  ///< see choice_factors()
    gather::Looks looks{{}, 0};     ///< of no samples before take_numbers()
    Awaited awaited;
  };
  std::unique_ptr<Looking> looking_;
  std::vector<double> joined_factors_;       // those of the look that join_look() joined
  std::unique_ptr<Awaited> awaited_direct_;  // null: direct light is there
  /// Frees what a cancelled call leaves behind, possibly gigabytes, without making the caller wait.
  template <class T>
  void dispose(T&& waste) {
    try {
      disposal_ = std::async(std::launch::async, [gone = std::forward<T>(waste)] {});
    } catch (...) {  // no thread available: `waste` is freed on return
    }
  }

  Forecast forecast_;
  std::future<void> disposal_;
  bool baked_ = false;
  bool edits_applied_ = true;
  Step step_ = Step::rest;
  bool damaged_ = false;  ///< whether an update failed in the middle, and so did rebuild()
};

}  // namespace deltalux::session
