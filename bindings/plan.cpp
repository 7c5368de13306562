// SPDX-License-Identifier: Apache-2.0
// Bindings of the planner on plain arrays: the machine's constants, and predicted counts.
#include <optional>

#include "base/error.h"
#include "estimate_inputs.h"
#include "plan/calibration.h"
#include "plan_values.h"

namespace deltalux::python {
namespace {

/// Pilot runs for one set of discs.
class PilotObject {
 public:
  PilotObject(const samples::DiscSet& discs, const std::string& rule, int threads)
      : workers_(threads), pilot_(discs, to_rule(rule), workers_) {}

  /// Predicted counts of a method for `total` segments in calls of `span`, of which `segments` are
  /// a sample.
  nb::dict count(const std::string& method, const SegmentColumns& segments, double total,
                 double span, double outer_radius, nb::object progress) {
    plan::Counts counts;
    run(progress, [&](Progress& p) {
      plan::SegmentSample sample;
      const auto& c = segments.column;
      for (size_t i = 0; i < segments.count(); ++i)
        sample.add({c[0][i], c[1][i], c[2][i]}, {c[3][i], c[4][i], c[5][i]}, c[6][i], c[7][i]);
      counts = pilot_.count(to_method(method), sample, {total, span, outer_radius}, &p);
    });
    return to_dict(counts);
  }

 private:
  const Workers workers_;
  plan::Pilot pilot_;
};

}  // namespace

void bind_plan(nb::module_& m) {
  m.def(
      "calibrate",
      [](nb::object progress) {
        plan::Machine machine;
        run(progress, [&](Progress& p) { machine = plan::calibrate(&p); });
        return to_rows(machine);
      },
      nb::arg("progress").none());
  m.def("typical_machine", [] { return to_rows(plan::typical_machine()); });
  m.def(
      "method_bytes",
      [](const std::string& method, double discs, double span) {
        return plan::method_bytes(to_method(method), discs, span);
      },
      nb::arg("method"), nb::arg("discs"), nb::arg("span"));
  m.attr("METHODS") =
      nb::tuple(nb::cast(std::vector(kMethodNames.begin() + 1, kMethodNames.end())));
  m.attr("PILOT_DIVISOR") = plan::kPilotDivisor;
  m.attr("LEAST_PILOT") = plan::kMinPilot;
  m.attr("PAPER_SIZE") = plan::kPaperSize;
  m.def("count_names", [] { return kCountNames; });
  m.def(
      "predicted_seconds",
      [](const std::string& name, const std::map<std::string, double>& counts, double discs,
         double span, const MachineRows& rows) {
        const plan::Method method = to_method(name);
        const plan::Constants constants = plan::constants_at(to_machine(rows)[size_t(method)],
                                                             plan::size_of(method, discs, span));
        return std::pair(constants.build * discs,
                         plan::search_seconds(to_counts(counts), constants));
      },
      nb::arg("method"), nb::arg("counts"), nb::arg("discs"), nb::arg("span"), nb::arg("machine"));
  nb::class_<PilotObject>(m, "Pilot")
      .def(nb::init<const samples::DiscSet&, const std::string&, int>(), nb::arg("discs"),
           nb::arg("rule"), nb::arg("threads"))
      .def("count", &PilotObject::count, nb::arg("method"), nb::arg("segments"), nb::arg("total"),
           nb::arg("span"), nb::arg("outer_radius"), nb::arg("progress").none());
}

}  // namespace deltalux::python
