// SPDX-License-Identifier: Apache-2.0
// Light at a sample, with what is known of its error.
#pragma once

namespace deltalux::gather {

/// By channel.
struct SampleLight {
  double irradiance[3] = {};
  double error[3] = {};  ///< standard error; 0 if the evaluation was made without errors
  double lucky[3] = {};  ///< variance from single rays that bring much; part of `error`
};

}  // namespace deltalux::gather
