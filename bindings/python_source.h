// SPDX-License-Identifier: Apache-2.0
// Arrays that the core restores from a Python object.
#pragma once
#include <optional>
#include <string>
#include <utility>

#include "base/archive.h"
#include "common.h"

namespace deltalux::python {

/// What a Python object reads from a file, or holds: bytes(name) -> int or None; read_into(name,
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

}  // namespace deltalux::python
