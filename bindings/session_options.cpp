// SPDX-License-Identifier: Apache-2.0
// The session's options that Python sets, by name.
#include "session_options.h"

#include "base/error.h"
#include "estimate_inputs.h"
#include "plan_values.h"

namespace deltalux::python {
namespace {

using session::Options;

// Python checks the names of choices.
void convert(const std::string& name, segments::SegmentEnd& to) { to = to_rule(name); }
void convert(const std::string& name, plan::Method& to) { to = to_method(name); }
void convert(const std::string& name, samples::DiscArea& to) {
  to = name == "whole" ? samples::DiscArea::whole : samples::DiscArea::reachable;
}
void convert(const std::string& name, session::DirectMode& to) {
  to = name == "paths"     ? session::DirectMode::paths
       : name == "sampled" ? session::DirectMode::sampled
                           : session::DirectMode::automatic;
}

/// Python: a pair, or None. Returns whether it was one of these.
bool assign(nb::handle value, std::optional<session::PathRange>& to) {
  std::pair<uint64_t, uint64_t> pair;
  to.reset();
  if (value.is_none()) return true;
  if (!nb::try_cast(value, pair)) return false;
  to = session::PathRange{pair.first, pair.second};
  return true;
}

/// Returns whether the value had the type of the field.
template <class Field>
bool assign(nb::handle value, Field& to) {
  if constexpr (std::is_enum_v<Field>) {
    std::string name;
    if (!nb::try_cast(value, name)) return false;
    convert(name, to);
    return true;
  } else {
    return nb::try_cast(value, to);
  }
}

struct Entry {
  const char* name;
  bool (*set)(nb::handle, Options&);
};

template <auto kField>
constexpr Entry entry(const char* name) {
  return {name, [](nb::handle value, Options& to) { return assign(value, to.*kField); }};
}

constexpr Entry kEntries[] = {
    entry<&Options::paths>("paths"),
    entry<&Options::seed>("seed"),
    entry<&Options::threads>("threads"),
    entry<&Options::segment_end>("segment_end"),
    entry<&Options::disc_area>("disc_area"),
    entry<&Options::direct>("direct"),
    entry<&Options::max_bounces>("max_bounces"),
    entry<&Options::gather_rays>("gather"),
    entry<&Options::static_method>("static_method"),
    entry<&Options::moving_method>("moving_method"),
    entry<&Options::memory_limit>("memory_limit"),
    entry<&Options::range>("path_range"),
};

}  // namespace

Options to_options(const nb::dict& values) {
  Options options;
  for (const Entry& entry : kEntries) {
    if (!values.contains(entry.name))
      throw OptionError(std::string("session: found no option \"") + entry.name +
                        "\", expected one; declare it in session_options.py");
    if (!entry.set(values[entry.name], options))
      throw nb::type_error((std::string("session: ") + entry.name +
                            ": found a value of another type than the core's")
                               .c_str());
  }
  for (const auto [name, value] : values) {
    const std::string found = nb::cast<std::string>(name);
    if (std::none_of(std::begin(kEntries), std::end(kEntries),
                     [&](const Entry& entry) { return found == entry.name; }))
      throw OptionError("session: found the option \"" + found +
                        "\", expected those of the core; enter it in bindings/session_options.cpp");
  }
  return options;
}

}  // namespace deltalux::python
