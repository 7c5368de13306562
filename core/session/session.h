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
#include <vector>

#include "base/archive.h"
#include "base/progress.h"
#include "scene/edit.h"
#include "session/exchange/exchange.h"
#include "session/read/audit.h"
#include "session/state/frame.h"
#include "session/state/state.h"

namespace deltalux::session {

class Session {
 public:
  /// Takes ownership. All expensive work happens in bake(). Throws SceneError, OptionError.
  Session(scene::Scene scene, samples::SampleSet samples, const Options& options);
  ~Session();

  /// Computes everything: acceleration structures, discs if any count, paths, direct light, gather
  /// rays. Throws Cancelled and leaves the session as it was. Throws OptionError before tracing if
  /// the memory limit would be exceeded. `leave_direct`: leave shadow rays of samples to others,
  /// see Exchange::take_direct().
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

  bool baked() const { return state_->baked; }
  /// Whether the edits of the last update() are in effect: false if it threw before that.
  bool edits_applied() const { return edits_applied_; }
  /// Before an update() that may not come about.
  void expect_edits() { edits_applied_ = false; }
  /// The share of the work that remains after the last update(): the largest of the shares of
  /// paths, direct light and gather rays.
  double pending_share() const { return state_->pending_share(); }
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
  Forecast forecast() const { return state_->forecast; }
  size_t bytes() const { return state_->bytes(); }

  /// Another one after every bake, recompute and update.
  const State& state() const { return *state_; }
  const direct::DirectLight* direct() const { return state_->direct.light.get(); }
  /// Null if nothing is kept.
  const KeptPlaces* kept() const { return state_->images.kept.get(); }

  /// What sessions that share the paths of a bake exchange.
  Exchange exchange() const { return Exchange(*state_); }
  SegmentsHash segments_hash() const;
  SlopeSums slope_sums(Progress& progress);
  /// The session is as before its first bake, but for edits.
  void forget_bake();

  /// Snapshot as named arrays, see file/snapshot.h. Valid until the session changes. `shared`: of a
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
  /// A copy of what the user gave, and of what edits made of it.
  std::unique_ptr<State> unbaked() const;
  /// Puts `fresh` in the place of the state once compute(fresh) has returned. If that throws, the
  /// session is as it was.
  Frame replace(std::unique_ptr<State> fresh, const std::function<Frame(State&)>& compute);
  /// Frees a state, possibly gigabytes, without making the caller wait.
  void dispose(std::unique_ptr<State> waste);

  std::unique_ptr<State> state_;
  std::future<void> disposal_;
  bool edits_applied_ = true;
};

}  // namespace deltalux::session
