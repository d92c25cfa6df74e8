// SPDX-License-Identifier: MIT
// The pipeline: a scene in, a bake out.
#pragma once

#include "bake/base/context.h"
#include "bake/options.h"
#include "bake/scene/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"

namespace relume {

// Bake how light travels through a scene. usage for options out of range, failed when the scene has no surface to bake
// or the context was cancelled. Same scene, options and seed give the same bytes at any thread count.
Result<Bake> bake(const Scene& scene, const BakeOptions& options, Context& context);

}  // namespace relume
