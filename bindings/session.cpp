// SPDX-License-Identifier: Apache-2.0
// Bindings of sessions: bake, edit, update, read.
#include "session/session.h"
#include "session/flow/reach.h"

#include <cstddef>
#include <cstdio>
#include <cstring>
#include <optional>
#include <tuple>

#include "base/error.h"
#include "plan_values.h"
#include "python_source.h"
#include "session_options.h"

namespace deltalux::python {
namespace {

using session::Session;

nb::dict to_dict(const session::Frame& frame) {
  nb::dict ms, out;
  for (const auto& [stage, value] : frame.milliseconds) {
    const double before = ms.contains(stage.c_str()) ? nb::cast<double>(ms[stage.c_str()]) : 0.0;
    ms[stage.c_str()] = before + value;
  }
  out["affected_paths"] = frame.affected_paths;
  out["removed_segments"] = frame.removed_segments;
  out["retraced_segments"] = frame.retraced_segments;
  out["scanned_segments"] = frame.scanned_segments;
  out["gathered_rays"] = frame.gathered_rays;
  out["changed_rays"] = frame.changed_rays;
  out["candidates"] = frame.candidates;
  out["done"] = frame.done;
  out["milliseconds"] = ms;
  return out;
}

/// An array with `width` numbers per sample, which read(pointer) fills with the GIL released.
template <class T, class Read>
auto read_array(const Session& session, size_t width, const Read& read) {
  const size_t n = session.state().samples.size();
  std::vector<T> values(width * n);
  {
    nb::gil_scoped_release release;
    read(values.data());
  }
  return make_array(std::move(values), {n, width});
}

/// The Python side's list of edits, as edits of the core.
class EditList {
 public:
  void move(uint32_t object, const Matrix& pose) {
    edits.push_back(scene::Move{object, to_pose(pose)});
  }
  void present(uint32_t object, bool yes) { edits.push_back(scene::SetPresent{object, yes}); }
  void insert(const scene::Object& object) { edits.push_back(scene::Insert{object}); }
  void dim(uint32_t group, double factor) { edits.push_back(scene::Dim{group, factor}); }
  void reflectance(uint32_t material, std::array<float, 3> rgb) {
    edits.push_back(scene::SetReflectance{material, {rgb[0], rgb[1], rgb[2]}});
  }
  std::vector<scene::Edit> edits;
};

plan::Policy to_policy(const std::string& name) {
  return name == "paper-sphere" ? plan::Policy::paper_sphere
         : name == "paper-box"  ? plan::Policy::paper_box
                                : plan::Policy::measured;
}

std::string digest(const Session& session, const std::optional<session::SegmentsHash>& others) {
  std::array<uint64_t, 4> words;
  {
    nb::gil_scoped_release release;
    words = session.digest(others);
  }
  char text[65];
  std::snprintf(
      text, sizeof text, "%016llx%016llx%016llx%016llx", static_cast<unsigned long long>(words[0]),
      static_cast<unsigned long long>(words[1]), static_cast<unsigned long long>(words[2]),
      static_cast<unsigned long long>(words[3]));
  return text;
}

nb::object read_bytes(const ArchiveView& archive, const std::string& name, size_t offset,
                      size_t count) {
  // Check the range before allocating memory.
  if (offset > archive.bytes(name) || count > archive.bytes(name) - offset)
    throw OptionError("archive: array \"" + name + "\" is shorter than that");
  nb::object out = nb::steal(PyBytes_FromStringAndSize(nullptr, Py_ssize_t(count)));
  if (!out.is_valid()) nb::raise_python_error();
  auto* to = reinterpret_cast<std::byte*>(PyBytes_AS_STRING(out.ptr()));
  nb::gil_scoped_release release;
  archive.read(name, offset, {to, count});
  return out;
}

/// Python integers, which have no bound.
nb::list whole_numbers(const session::EnergyAudit::Quanta& quanta) {
  nb::list out;
  for (const auto value : quanta) {
    const nb::int_ high{int64_t(value >> 64)}, low{uint64_t(value)};
    out.append(high.attr("__lshift__")(64).attr("__or__")(low));
  }
  return out;
}

}  // namespace

// long: a list of names.
void bind_session(nb::module_& m) {
  nb::class_<EditList>(m, "EditList")
      .def(nb::init<>())
      .def("move", &EditList::move)
      .def("present", &EditList::present)
      .def("insert", &EditList::insert)
      .def("dim", &EditList::dim)
      .def("reflectance", &EditList::reflectance)
      .def("__len__", [](const EditList& e) { return e.edits.size(); });

  nb::class_<ArchiveView>(m, "ArchiveView")
      .def("names", &ArchiveView::names)
      .def("bytes", &ArchiveView::bytes, nb::arg("name"))
      .def("read", &read_bytes, nb::arg("name"), nb::arg("offset"), nb::arg("count"))
      .def("__getitem__", [](const ArchiveView& a, const std::string& name) {
        return read_bytes(a, name, 0, a.bytes(name));
      });

  // The fields of a stored segment, for whoever joins the paths of several sessions.
  using segments::Segment;
  m.attr("SEGMENT_BYTES") = sizeof(Segment);
  m.attr("SEGMENT_LENGTH") = offsetof(Segment, length);
  m.attr("SEGMENT_PATH") = offsetof(Segment, path);
  m.attr("SEGMENT_NEXT") = offsetof(Segment, next);
  m.attr("NO_SLOT") = segments::kNoSlot;
  m.attr("NOT_CUT") = session::kNotCut;

  nb::class_<session::Reach>(m, "Reach")
      .def(
          "refusal",
          [](const session::Reach& reach, const std::array<float, 3>& low,
             const std::array<float, 3>& high) {
            return reach.refusal({{low[0], low[1], low[2]}, {high[0], high[1], high[2]}});
          },
          nb::arg("low"), nb::arg("high"));

  nb::class_<Session> bound(m, "Session");
  bind_ranges(bound);
  bind_shared_rays(bound);
  bound
      .def(
          "__init__",
          [](Session* self, const scene::Scene& scene, const Rows<float, 3>& points,
             const Rows<float, 3>& normals, const Column<float>& radius,
             const Column<uint32_t>& attached, const nb::dict& options) {
            samples::SampleSet set{to_vectors(points), to_vectors(normals), to_vector(radius),
                                   to_vector(attached)};
            const session::Options checked = to_options(options);
            nb::gil_scoped_release release;
            new (self) Session(scene, std::move(set), checked);
          },
          nb::arg("scene"), nb::arg("points"), nb::arg("normals"), nb::arg("radius"),
          nb::arg("attached"), nb::arg("options"))
      .def(
          "bake",
          [](Session& s, nb::object callback, bool leave_direct) {
            session::Frame frame;
            run(callback, [&](Progress& p) { frame = s.bake(p, leave_direct); });
            return to_dict(frame);
          },
          nb::arg("progress").none(), nb::arg("leave_direct") = false)
      .def(
          "recompute",
          [](Session& s, nb::object callback) {
            session::Frame frame;
            run(callback, [&](Progress& p) { frame = s.recompute(p); });
            return to_dict(frame);
          },
          nb::arg("progress").none())
      .def(
          "update",
          [](Session& s, const EditList& list, double budget_ms, nb::object callback) {
            session::Frame frame;
            s.expect_edits();  // there may be no thread for update()
            run(callback, [&](Progress& p) { frame = s.update(list.edits, budget_ms, p); });
            return to_dict(frame);
          },
          nb::arg("edits"), nb::arg("budget_ms"), nb::arg("progress").none())
      .def(
          "check",
          [](const Session& s, const EditList& list, const EditList& before) {
            for (const scene::Edit& edit : list.edits) s.check(edit, before.edits);
          },
          nb::arg("edits"), nb::arg("before"))
      .def(
          "set_planning",
          [](Session& s, const MachineRows& machine, const std::string& policy,
             std::optional<double> frames, bool rebuilds) {
            s.set_planning(to_machine(machine), to_policy(policy), frames, rebuilds);
          },
          nb::arg("machine"), nb::arg("policy"), nb::arg("frames").none(), nb::arg("rebuilds"))
      .def(
          "plan",
          [](Session& s, nb::object callback) {
            run(callback, [&](Progress& p) { s.plan(p); });
            return to_list(s.state().discs.plans);
          },
          nb::arg("progress").none())
      .def_prop_ro("plans", [](const Session& s) { return to_list(s.state().discs.plans); })
      .def_prop_ro("baked", &Session::baked)
      .def_prop_ro("pending", &Session::pending_share)
      .def_prop_ro("edits_applied", &Session::edits_applied)
      .def_prop_ro("is_as_loaded", [](const Session& s) { return s.state().is_as_loaded(); })
      .def("read",
           [](const Session& s) {
             const size_t n = s.state().samples.size();
             std::vector<double> irradiance(3 * n), error(3 * n);
             double gain;
             {
               nb::gil_scoped_release release;
               gain = s.read(irradiance.data(), error.data());
             }
             return nb::make_tuple(make_array(std::move(irradiance), {n, 3}),
                                   make_array(std::move(error), {n, 3}), gain);
           })
      .def("read_irradiance",
           [](const Session& s) {
             return read_array<double>(s, 3, [&](double* out) { s.read_irradiance(out); });
           })
      .def("read_direct",
           [](const Session& s) {
             return read_array<double>(s, 3, [&](double* out) { s.read_direct(out); });
           })
      .def(
          "read_packed",
          [](const Session& s, const std::array<double, 3>& weights, bool errors) {
            return read_array<float>(s, 4,
                                     [&](float* out) { s.read_packed(weights, errors, out); });
          },
          nb::arg("weights"), nb::arg("errors"))
      .def("glance",
           [](Session& s) { return read_array<float>(s, 4, [&](float* out) { s.glance(out); }); })
      .def(
          "gradient",
          [](Session& s, nb::object callback) {
            const size_t n = s.state().samples.size();
            std::vector<double> gradient(9 * n);
            run(callback, [&](Progress& p) { s.read_gradient(gradient.data(), p); });
            return make_array(std::move(gradient), {n, 3, 3});
          },
          nb::arg("progress").none())
      .def(
          "gather_at",
          [](Session& s, const Rows<float, 3>& points, const Rows<float, 3>& normals, uint32_t rays,
             bool by_need, size_t keep_bytes, bool direct, bool indirect, nb::object callback) {
            const std::vector<Vec3f> p = to_vectors(points), n = to_vectors(normals);
            if (p.size() != n.size()) throw OptionError("at: points and normals differ in length");
            std::vector<double> straight(direct ? 3 * p.size() : 0),
                around(indirect ? 3 * p.size() : 0), noise(indirect ? p.size() : 0);
            run(callback, [&](Progress& progress) {
              s.gather_at(p, n, {rays, by_need, keep_bytes}, direct ? straight.data() : nullptr,
                          indirect ? around.data() : nullptr, indirect ? noise.data() : nullptr,
                          progress);
            });
            if (direct && indirect)
              for (size_t i = 0; i < around.size(); ++i) straight[i] += around[i];
            noise.resize(p.size());
            return nb::make_tuple(
                make_array(direct ? std::move(straight) : std::move(around), {p.size(), 3}),
                make_array(std::move(noise), {p.size()}));
          },
          nb::arg("points"), nb::arg("normals"), nb::arg("rays"), nb::arg("by_need"),
          nb::arg("keep_bytes"), nb::arg("direct"), nb::arg("indirect"), nb::arg("progress").none())
      .def("visible",
           [](const Session& s, const Rows<float, 3>& from, const Rows<float, 3>& to) {
             const std::vector<Vec3f> a = to_vectors(from), b = to_vectors(to);
             std::vector<uint8_t> out;
             {
               nb::gil_scoped_release release;
               out = s.visible(a, b);
             }
             return make_array(std::move(out), {a.size()});
           })
      .def("sums",
           [](const Session& s) {
             const size_t n = s.state().samples.size();
             std::vector<int64_t> sums(3 * n);
             {
               nb::gil_scoped_release release;
               s.read_sums(sums.data());
             }
             return make_array(std::move(sums), {n, 3});
           })
      .def_prop_ro("unreached",
                   [](const Session& s) {
                     nb::gil_scoped_release release;
                     return s.unreached();
                   })
      .def("areas",
           [](Session& s) {
             std::vector<float> area;
             {
               nb::gil_scoped_release release;
               area = s.areas();
             }
             const size_t n = area.size();
             return make_array(std::move(area), {n});
           })
      .def(
          "radii",
          [](Session& s, nb::object callback) {
            std::vector<float> radius;
            run(callback, [&](Progress& p) { radius = s.radii(p); });
            const size_t n = radius.size();
            return make_array(std::move(radius), {n});
          },
          nb::arg("progress").none())
      .def("digest", [](const Session& s) { return digest(s, {}); })
      .def(
          "digest_with",
          [](const Session& s, const Column<uint64_t>& others) {
            if (others.size() != 3) throw OptionError("digest: expected a sum of segments_hash");
            return digest(s, session::SegmentsHash{others(0), others(1), others(2)});
          },
          nb::arg("others"))
      .def("audit",
           [](const Session& s) {
             const session::EnergyAudit audit = s.audit();
             nb::dict out;
             out["emitted"] = whole_numbers(audit.emitted);
             out["absorbed"] = whole_numbers(audit.absorbed);
             out["escaped"] = whole_numbers(audit.escaped);
             out["quantum"] = audit.quantum;
             return out;
           })
      .def("statistics",
           [](const Session& s) {
             const session::State& state = s.state();
             nb::dict out;
             uint64_t paths = 0;
             nb::list lights;
             for (size_t i = 0; i < state.lights.size(); ++i) {
               const trace::Light& light = state.lights[i];
               paths += light.path_count;
               nb::dict entry;
               entry["group"] = light.group;
               entry["paths"] = light.path_count;
               entry["sampled"] = i < state.light_sampled.size() && state.light_sampled[i];
               lights.append(entry);
             }
             out["paths"] = paths;
             out["held_paths"] = state.paths.held.size();
             out["edits"] = state.edits;
             out["lights"] = lights;
             out["segments"] = state.paths.store.live();
             out["segment_bytes"] = state.paths.store.bytes() + state.paths.cut.size();
             out["bytes"] = s.bytes();
             out["forecast_bytes"] = s.forecast().bytes;
             if (state.gathers()) {
               const gather::GatherHits& hits = state.rays.hits;
               nb::dict gather;
               gather["rays"] = hits.rays().all();
               gather["chains"] = hits.chains().size();
               gather["guides"] = state.rays.guiding.guides.size();
               gather["beams"] = state.rays.guiding.beams.size();
               gather["suns"] = state.rays.guiding.suns.size();
               gather["cells"] = state.cells.division.size();
               gather["ray_bytes"] = hits.bytes();
               gather["ray_bytes_in_use"] = hits.bytes_in_use();
               gather["kept_bytes"] = s.kept() ? s.kept()->bytes() : 0;
               gather["kept_taken"] = s.kept() ? s.kept()->taken() : 0;
               out["gather"] = gather;
             }
             out["samples"] = state.samples.size();
             out["threads"] = state.workers.threads();
             return out;
           })
      .def("reach", [](const Session& s) { return session::Reach(s.state()); })
      .def("world",
           [](const Session& s) {
             const Box& box = s.state().scene.first_world();
             return std::pair(std::array{box.low.x, box.low.y, box.low.z},
                              std::array{box.high.x, box.high.y, box.high.z});
           })
      .def("save", &Session::save, nb::arg("shared") = false, nb::keep_alive<0, 1>(),
           nb::call_guard<nb::gil_scoped_release>())
      .def("save_choices", &Session::save_choices, nb::keep_alive<0, 1>(),
           nb::call_guard<nb::gil_scoped_release>())
      .def(
          "restore",
          [](Session& s, nb::object source, nb::object callback) {
            PythonSource archive(std::move(source));
            run(callback, [&](Progress& p) { s.restore(archive, p); });
          },
          nb::arg("source"), nb::arg("progress").none());
}

}  // namespace deltalux::python
