// SPDX-License-Identifier: Apache-2.0
// The extension module: translates errors, runs long calls, and registers all bindings.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "base/cpu.h"
#include "base/error.h"
#include "common.h"
#include "trace/description.h"

namespace deltalux::python {
namespace {

/// Interval between two reports of progress.
std::atomic<double> report_seconds{0.02};

/// A thread of its own for `work`; the system may have no room for its stack.
template <class Work>
std::thread started(Work&& work) {
  try {
    return std::thread(std::forward<Work>(work));
  } catch (const std::system_error& e) {
    throw Error(std::string("thread: found no room for another one (") + e.what() +
                "), expected one for each call; free some memory, or raise the limits of memory "
                "and of processes (ulimit -v, ulimit -u)");
  }
}

}  // namespace

void run(nb::object callback, const std::function<void(Progress&)>& work) {
  Progress progress;
  std::mutex mutex;
  std::condition_variable finished;
  bool done = false;
  std::exception_ptr failure;
  std::thread worker = started([&] {
    try {
      work(progress);
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    done = true;
    finished.notify_one();
  });
  bool interrupted = false;
  {
    nb::gil_scoped_release release;
    std::unique_lock lock(mutex);
    const std::chrono::duration<double> interval(report_seconds);
    while (!finished.wait_for(lock, interval, [&] { return done; })) {
      lock.unlock();
      {
        nb::gil_scoped_acquire acquire;
        if (!interrupted && PyErr_CheckSignals() != 0) {
          interrupted = true;
          progress.cancel();
        }
        if (!interrupted && !callback.is_none()) {
          PyObject* answer =
              PyObject_CallFunction(callback.ptr(), "sd", progress.stage(), progress.fraction());
          // Only an explicit False cancels: a callback that returns nothing lets the work continue.
          if (!answer)
            interrupted = true;
          else if (answer == Py_False)
            progress.cancel();
          Py_XDECREF(answer);
          if (interrupted) progress.cancel();
        }
      }
      lock.lock();
    }
    lock.unlock();
    worker.join();
  }
  if (interrupted) throw nb::python_error();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace deltalux::python

NB_MODULE(_core, m) {
  namespace nb = nanobind;
  using namespace deltalux;
  // A session that a script leaves open until the interpreter ends is no leak.
  nb::set_leak_warnings(false);
  m.doc() = "Compiled core of Deltalux; use the package, not this module.";
#if defined(__x86_64__) && defined(__AVX2__)
  if (processor_isa() < Isa::avx2)
    throw std::runtime_error(
        "deltalux was built for processors with AVX2, which this one lacks; "
        "build from source with -DDELTALUX_ISA=x86-64");
#endif
  // Never destroyed, since the interpreter may be gone by then.
  static const auto& errors = *new nb::object(nb::module_::import_("deltalux.errors"));
  nb::register_exception_translator([](const std::exception_ptr& p, void*) {
    const auto raise = [](const char* type, const std::exception& e) {
      PyErr_SetString(nb::getattr(errors, type).ptr(), e.what());
    };
    try {
      std::rethrow_exception(p);
    } catch (const Cancelled& e) {
      raise("Cancelled", e);
    } catch (const SceneError& e) {
      raise("SceneError", e);
    } catch (const OptionError& e) {
      raise("OptionError", e);
    } catch (const FormatError& e) {
      raise("FormatError", e);
    } catch (const Error& e) {
      raise("Error", e);
    }
  });
  m.def("description", &trace::description,
        "What bits of results depend on: Embree, instruction set, build, and how it reckons.");
  m.def(
      "set_report_seconds", [](double seconds) { python::report_seconds = seconds; },
      nb::arg("seconds"), "Sets how often long calls report progress (tests report more often).");
  python::bind_scene(m);
  python::bind_trace(m);
  python::bind_samples(m);
  python::bind_direct(m);
  python::bind_estimate(m);
  python::bind_sphere_cache(m);
  python::bind_ray_map(m);
  python::bind_gather(m);
  python::bind_plan(m);
  python::bind_session(m);
}
