// SPDX-License-Identifier: MIT
// What a bake says of its own error: how far the light that the runtime reads from it is from what rays find, under
// lights of the baker's choice, at pixels of the level's cameras or of what players see (docs/notes/certificate.md).
//
// Errors are squared and relative, as in docs/ACCURACY.md: the mean of (E - E_rays)² over receivers and channels, after
// one bounce, over the square of the mean light of all bounces. (Until algorithm version 12: over its mean square.)
// Each is an unbiased estimate, (r1 - t)(r2 - t) with two independent sets of rays, so it may be below 0.
#pragma once

#include "relume/array.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace relume {

// The lights that a bake is tried with, one at a time.
enum class TestLightKind : std::uint32_t { sky = 0, sun = 1, lamp = 2 };

// All empty in bakes that carry none: of format versions 3 to 5.
struct Certificate {
  Array<std::uint32_t> lightKind;      // [Size lights] TestLightKind
  Array<float> squaredError;           // [Size lights] of the whole level under each
  Array<float> standardError;          // [Size lights] [>= 0] of squaredError
  Array<std::uint32_t> partReceivers;  // [Size instances] how many receivers lie on each
  Array<float> partError;              // [Size instances] what each adds to the mean of squaredError over the lights

  bool empty() const { return lightKind.empty(); }
};

// The root of the middle squared error of all lights: 0.1 is an error of 10 %. Half of the lights are beyond it, so
// that one lamp in a corner does not decide. 0 without a certificate, or where the noise is larger than the error.
inline float certifiedError(const Certificate& certificate) {
  std::vector<float> errors = certificate.squaredError.toVector();
  if (errors.empty()) return 0.0f;
  std::sort(errors.begin(), errors.end());
  const float middle = 0.5f * (errors[(errors.size() - 1) / 2] + errors[errors.size() / 2]);
  return std::sqrt(std::max(middle, 0.0f));
}

}  // namespace relume
