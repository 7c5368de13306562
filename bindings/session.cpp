// SPDX-License-Identifier: Apache-2.0
// Bindings of sessions: bake, edit, update, read.
#include "session/session.h"

#include <cstddef>
#include <cstdio>
#include <cstring>
#include <optional>
#include <tuple>

#include "base/error.h"
#include "plan_values.h"
#include "session_options.h"

namespace deltalux::python {
namespace {

using session::Session;

/// Sums in four dimensions.
using Blocks = nb::ndarray<const int64_t, nb::numpy, nb::ndim<4>, nb::c_contig, nb::device::cpu>;

std::vector<int64_t> to_numbers(const Blocks& blocks) {
  return {blocks.data(), blocks.data() + blocks.size()};
}

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

/// Arrays that a Python object reads from a file: bytes(name) -> int or None; read_into(name,
/// buffer) reads the next bytes.
class PythonSource : public ArchiveSource {
 public:
  explicit PythonSource(nb::object source) : source_(std::move(source)) {}

  std::optional<size_t> bytes(const std::string& name) override {
    nb::gil_scoped_acquire acquire;
    const nb::object found = source_.attr("bytes")(name);
    return found.is_none() ? std::nullopt : std::optional(nb::cast<size_t>(found));
  }
  void read(const std::string& name, std::span<std::byte> to) override {
    if (to.empty()) return;
    nb::gil_scoped_acquire acquire;
    const nb::object buffer = nb::steal(PyMemoryView_FromMemory(
        reinterpret_cast<char*>(to.data()), Py_ssize_t(to.size()), PyBUF_WRITE));
    source_.attr("read_into")(name, buffer);
    buffer.attr("release")();
  }

 private:
  nb::object source_;
};

/// The sums of a session's paths: their number; discs (groups, batches, samples, 3); cells (cells,
/// groups, batches, 3).
nb::tuple path_sums(const Session& session) {
  session::PathSums sums;
  {
    nb::gil_scoped_release release;
    sums = session.path_sums();
  }
  const size_t groups = session.state().sum_groups(), batches = session::kBatches;
  const size_t cells = sums.cells.size() / (3 * groups * batches);
  return nb::make_tuple(
      sums.paths,
      make_array(std::move(sums.discs), {groups, batches, session.state().samples.size(), 3}),
      make_array(std::move(sums.cells), {cells, groups, batches, 3}));
}

/// Places and values of a row.
nb::tuple to_tuple(session::SparseRow&& row) {
  const size_t n = row.at.size();
  return nb::make_tuple(row.size, make_array(std::move(row.at), {n}),
                        make_array(std::move(row.value), {n}));
}

/// Length, places and values.
using Row = std::tuple<uint64_t, Column<uint64_t>, Column<int64_t>>;

session::SparseRow to_row(const Row& row) {
  const auto& [size, at, value] = row;
  return {size, to_vector(at), to_vector(value)};
}

/// ranges, edits, since; then length, places and values of the rows of discs, cells and openness.
nb::tuple path_changes(Session& session) {
  session::PathChanges changes;
  {
    nb::gil_scoped_release release;
    changes = session.path_changes();
  }
  nb::list ranges;
  for (const session::PathRange& range : changes.ranges)
    ranges.append(nb::make_tuple(range.first, range.last));
  return nb::make_tuple(nb::tuple(ranges), changes.edits, changes.since,
                        to_tuple(std::move(changes.discs)), to_tuple(std::move(changes.cells)),
                        to_tuple(std::move(changes.openness)));
}

/// Lights, the number of cells, places, and what lands there, (places, 3).
nb::tuple first_flights(const Session& session) {
  session::FirstFlights flights;
  {
    nb::gil_scoped_release release;
    flights = session.first_flights();
  }
  const size_t lights = flights.lights.size(), n = flights.at.size();
  std::vector<int64_t> quanta;
  for (const auto& own : flights.quanta) quanta.insert(quanta.end(), own.begin(), own.end());
  return nb::make_tuple(make_array(std::move(flights.lights), {lights}), flights.cells,
                        make_array(std::move(flights.at), {n}),
                        make_array(std::move(quanta), {n, 3}));
}

session::FirstFlights to_flights(const Column<uint32_t>& lights, uint64_t cells,
                                 const Column<uint64_t>& at, const Rows<int64_t, 3>& quanta) {
  session::FirstFlights flights{to_vector(lights), cells, to_vector(at), {}};
  for (size_t i = 0; i < quanta.shape(0); ++i)
    flights.quanta.push_back({quanta(i, 0), quanta(i, 1), quanta(i, 2)});
  return flights;
}

/// What sessions that share the paths of one bake need beside the rest, see session/session.h.
// long: a list of names.
void bind_ranges(nb::class_<Session>& bound) {
  bound.def("path_sums", &path_sums)
      .def("segments_hash",
           [](const Session& s) {
             session::SegmentsHash hash;
             {
               nb::gil_scoped_release release;
               hash = s.segments_hash();
             }
             return make_array(std::vector<uint64_t>{hash.count, hash.a, hash.b}, {3});
           })
      .def("path_changes", &path_changes)
      .def(
          "add_path_changes",
          [](Session& s, const std::vector<std::pair<uint64_t, uint64_t>>& ranges, uint64_t edits,
             std::optional<uint64_t> since, const Row& discs, const Row& cells,
             const Row& openness) {
            session::PathChanges changes{
                {}, edits, since, to_row(discs), to_row(cells), to_row(openness)};
            for (const auto& [first, last] : ranges) changes.ranges.push_back({first, last});
            nb::gil_scoped_release release;
            s.add_path_changes(changes);
          },
          nb::arg("ranges"), nb::arg("edits"), nb::arg("since").none(), nb::arg("discs"),
          nb::arg("cells"), nb::arg("openness"))
      .def(
          "gradient_sums",
          [](Session& s, nb::object callback) {
            session::SlopeSums sums;
            run(callback, [&](Progress& p) { sums = s.slope_sums(p); });
            const size_t groups = s.state().sum_groups(), n = s.state().samples.size();
            return nb::make_tuple(
                make_array(std::move(sums.discs), {groups, session::kBatches, n, 3}),
                make_array(std::move(sums.moments), {groups, session::kBatches, n, 6}));
          },
          nb::arg("progress").none())
      .def(
          "gradient_with",
          [](Session& s, const Blocks& discs, const Blocks& moments, nb::object callback) {
            const session::SlopeSums others{to_numbers(discs), to_numbers(moments)};
            const size_t n = s.state().samples.size();
            std::vector<double> gradient(9 * n);
            run(callback, [&](Progress& p) { s.read_gradient(gradient.data(), p, others); });
            return make_array(std::move(gradient), {n, 3, 3});
          },
          nb::arg("discs"), nb::arg("moments"), nb::arg("progress").none())
      .def("first_flights", &first_flights)
      .def(
          "look",
          [](Session& s, const Column<uint32_t>& lights, uint64_t cells, const Column<uint64_t>& at,
             const Rows<int64_t, 3>& quanta, nb::object callback) {
            const session::FirstFlights flights = to_flights(lights, cells, at, quanta);
            run(callback, [&](Progress& p) { s.look(flights, p); });
          },
          nb::arg("lights"), nb::arg("cells"), nb::arg("at"), nb::arg("quanta"),
          nb::arg("progress").none())
      .def("asked_lights",
           [](const Session& s) {
             std::vector<uint32_t> lights = s.asked_lights();
             const size_t n = lights.size();
             return make_array(std::move(lights), {n});
           })
      .def(
          "ask_for",
          [](Session& s, const Column<uint32_t>& lights) { s.ask_for(to_vector(lights)); },
          nb::arg("lights"));
}

constexpr size_t kSeenBytes = sizeof(gather::SeenGuides);
using Seen = Rows<uint8_t, kSeenBytes>;

/// Numbers of rays: guides seen, (n, kSeenBytes), and doublings, (n,).
nb::tuple to_tuple(session::RayNumbers&& numbers) {
  const size_t seen = numbers.seen.size(), n = numbers.doublings.size();
  std::vector<uint8_t> bytes(seen * kSeenBytes);
  if (seen) std::memcpy(bytes.data(), numbers.seen.data(), bytes.size());
  return nb::make_tuple(make_array(std::move(bytes), {seen, kSeenBytes}),
                        make_array(std::move(numbers.doublings), {n}));
}

session::RayNumbers to_ray_numbers(const Seen& seen, const Column<int8_t>& doublings) {
  session::RayNumbers numbers{std::vector<gather::SeenGuides>(seen.shape(0)), to_vector(doublings)};
  if (seen.shape(0)) std::memcpy(numbers.seen.data(), seen.data(), seen.shape(0) * kSeenBytes);
  return numbers;
}

/// All arrays of what was saved, by name.
nb::dict to_arrays(const ArchiveView& archive) {
  nb::dict arrays;
  for (const std::string& name : archive.names()) {
    std::vector<uint8_t> bytes(archive.bytes(name));
    archive.read(name, 0, std::as_writable_bytes(std::span(bytes)));
    const size_t size = bytes.size();
    arrays[name.c_str()] = make_array(std::move(bytes), {size});
  }
  return arrays;
}

/// Gather rays that sessions with a part of the paths cast for the one without, see
/// session/session.h.
void bind_shared_gather(nb::class_<Session>& bound) {
  bound
      .def(
          "begin_look",
          [](Session& s, const Column<uint32_t>& lights, uint64_t cells, const Column<uint64_t>& at,
             const Rows<int64_t, 3>& quanta, nb::object callback) {
            const session::FirstFlights flights = to_flights(lights, cells, at, quanta);
            run(callback, [&](Progress& p) { s.begin_look(flights, p); });
          },
          nb::arg("lights"), nb::arg("cells"), nb::arg("at"), nb::arg("quanta"),
          nb::arg("progress").none())
      .def("is_looking", &Session::is_looking)
      .def("save_look", [](const Session& s) { return to_arrays(s.save_look()); })
      .def(
          "join_look",
          [](Session& s, nb::object source) {
            PythonSource archive(std::move(source));
            nb::gil_scoped_release release;
            s.join_look(archive);
          },
          nb::arg("source"))
      .def(
          "direct_of_samples",
          [](const Session& s, size_t first, size_t last) {
            std::vector<double> out;
            for (const Vec3d& own : s.direct_of_samples(first, last))
              out.insert(out.end(), {own.x, own.y, own.z});
            return make_array(std::move(out), {last - first, 3});
          },
          nb::arg("first"), nb::arg("last"))
      .def(
          "number_rays",
          [](const Session& s, size_t first, const Rows<double, 3>& direct, nb::object callback) {
            std::vector<Vec3d> own(direct.shape(0));
            for (size_t i = 0; i < own.size(); ++i)
              own[i] = {direct(i, 0), direct(i, 1), direct(i, 2)};
            session::RayNumbers numbers;
            run(callback, [&](Progress& p) { numbers = s.number_rays(first, own, p); });
            return to_tuple(std::move(numbers));
          },
          nb::arg("first"), nb::arg("direct"), nb::arg("progress").none())
      .def(
          "take_numbers",
          [](Session& s, const Seen& seen, const Column<int8_t>& doublings) {
            session::RayNumbers numbers = to_ray_numbers(seen, doublings);
            nb::gil_scoped_release release;
            s.take_numbers(std::move(numbers));
          },
          nb::arg("seen"), nb::arg("doublings"))
      .def(
          "look_cuts",
          [](const Session& s, uint64_t rays) {
            std::vector<uint64_t> cuts = s.look_cuts(rays);
            const size_t n = cuts.size();
            return make_array(std::move(cuts), {n});
          },
          nb::arg("rays"))
      .def(
          "save_aims",
          [](const Session& s, size_t first, size_t last) {
            return to_arrays(s.save_aims(first, last));
          },
          nb::arg("first"), nb::arg("last"))
      .def(
          "cast_looks",
          [](const Session& s, size_t first, size_t last, nb::object source, nb::object callback) {
            PythonSource aims(std::move(source));
            std::optional<gather::Looks> looks;
            run(callback, [&](Progress& p) { looks = s.cast_looks(first, last, aims, p); });
            ArchiveView archive;
            looks->save(archive);
            return to_arrays(archive);
          },
          nb::arg("first"), nb::arg("last"), nb::arg("source"), nb::arg("progress").none())
      .def(
          "take_looks",
          [](Session& s, size_t first, size_t last, nb::object source) {
            PythonSource archive(std::move(source));
            nb::gil_scoped_release release;
            s.take_looks(first, last, archive);
          },
          nb::arg("first"), nb::arg("last"), nb::arg("source"));
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

  nb::class_<Session> bound(m, "Session");
  bind_ranges(bound);
  bind_shared_gather(bound);
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
          [](Session& s, nb::object callback) {
            session::Frame frame;
            run(callback, [&](Progress& p) { frame = s.bake(p); });
            return to_dict(frame);
          },
          nb::arg("progress").none())
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
            return to_list(s.state().plans);
          },
          nb::arg("progress").none())
      .def_prop_ro("plans", [](const Session& s) { return to_list(s.state().plans); })
      .def_prop_ro("baked", &Session::baked)
      .def_prop_ro("pending", &Session::pending_share)
      .def_prop_ro("edits_applied", &Session::edits_applied)
      .def("read",
           [](const Session& s) {
             const size_t n = s.state().samples.size();
             std::vector<double> irradiance(3 * n), error(3 * n);
             {
               nb::gil_scoped_release release;
               s.read(irradiance.data(), error.data());
             }
             return nb::make_tuple(make_array(std::move(irradiance), {n, 3}),
                                   make_array(std::move(error), {n, 3}));
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
           [](const Session& s) {
             std::vector<float> area = s.areas();
             const size_t n = area.size();
             return make_array(std::move(area), {n});
           })
      .def("radii",
           [](const Session& s) {
             std::vector<float> radius = s.radii();
             const size_t n = radius.size();
             return make_array(std::move(radius), {n});
           })
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
             out["emitted"] = audit.emitted;
             out["absorbed"] = audit.absorbed;
             out["escaped"] = audit.escaped;
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
             out["held_paths"] = state.held.size();
             out["edits"] = state.edits;
             out["lights"] = lights;
             out["segments"] = state.store.live();
             out["segment_bytes"] = state.store.bytes() + state.cut.size();
             out["bytes"] = s.bytes();
             out["forecast_bytes"] = s.forecast().bytes;
             if (state.gather) {
               const gather::Looks& looks = state.gather->looks;
               nb::dict gather;
               gather["rays"] = looks.rays().all();
               gather["chains"] = looks.chains().size();
               gather["guides"] = state.guiding.guides.size();
               gather["beams"] = state.guiding.beams.size();
               gather["suns"] = state.guiding.suns.size();
               gather["cells"] = state.gather->cells.size();
               gather["ray_bytes"] = looks.bytes();
               gather["ray_bytes_in_use"] = looks.bytes_in_use();
               gather["kept_bytes"] = s.kept() ? s.kept()->bytes() : 0;
               gather["kept_taken"] = s.kept() ? s.kept()->taken() : 0;
               out["gather"] = gather;
             }
             out["samples"] = state.samples.size();
             out["threads"] = state.workers.threads();
             return out;
           })
      .def("world",
           [](const Session& s) {
             const Box& box = s.state().scene.world();
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
