// SPDX-License-Identifier: Apache-2.0
// Irradiance and standard errors of all samples, from integer sums.
#pragma once
#include <array>

#include "session/state/state.h"

namespace deltalux::session {

// These update caches, so that no two threads may call them at the same time. They throw like
// check_readable().

/// See Session::read().
double read(State& state, double* irradiance, double* standard_error);
void read_irradiance(State& state, double* irradiance);
void read_direct(State& state, double* irradiance);
void read_packed(State& state, const std::array<double, 3>& weights, bool errors, float* values);
void glance(State& state, float* values);

/// Sums of all batches and groups in quanta, samples x 3; without direct light by shadow rays.
void read_sums(const State& state, int64_t* sums);

}  // namespace deltalux::session
