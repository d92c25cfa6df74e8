// SPDX-License-Identifier: MIT
// The pipeline: a scene in, a bake out. What a build tool includes first; CMake's target relume::bake links it.
//   loadScene()    (load_scene.h)          the level, imported and repaired
//   presetOptions(), setOption(), optionsFromJson()   (options.h)
//   bake()
//   writeBake()    (relume/bake_file.h)    the file: the bytes that `relume bake` writes of the same level and options
// What the bake was made from stands in Bake::provenance; provenance.h says what a scene of today would have there.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"

namespace relume {

// Bake how light travels through a scene. usage for options out of range, unsupported for an embreeIsa that the
// processor lacks, failed when the scene has no surface to bake or the context was cancelled, or has not the memory.
// Same scene, options and seed give the same bytes at any thread count. Any thread; bakes that run at once need a
// context each.
Result<Bake> bake(const Scene& scene, const BakeOptions& options, Context& context);

}  // namespace relume
