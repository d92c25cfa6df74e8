// SPDX-License-Identifier: MIT
// `relume bake --verify`: the same bytes again, with another number of threads?
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"

namespace relume {

// Bake once more, on one thread (on two when the context has one), and compare with `baked`. failed: names the first
// array that differs. Errors of bake().
Status verifyBake(const Scene& scene, const BakeOptions& options, const Bake& baked, Context& context);

}  // namespace relume
