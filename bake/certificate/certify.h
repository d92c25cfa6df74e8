// SPDX-License-Identifier: MIT
// Holds what the runtime reads of a bake against what rays have found:
//
//   E[(r1 - t)(r2 - t)] = (R - t)²     r1, r2: irradiance by independent rays, of mean R; t: by the bake
//
// The noise of the rays drops out in the mean, so that few of them at a receiver are enough.
#pragma once

#include "bake/certificate/test_rays.h"
#include "relume/bake/context.h"
#include "relume/bake_data.h"
#include "relume/certificate.h"
#include "relume/result.h"

namespace relume {

// The certificate of a bake whose test rays these are, as a game would read it: with the bands that it recommends.
// Empty where no receiver was found. Lights that reach no receiver are left out. Relights on the instruction set that
// all processors have, so that it is the same on all. failed: cancelled; errors of Relighter::create().
Result<Certificate> certify(const Bake& bake, const TestRays& rays, Context& context);

}  // namespace relume
