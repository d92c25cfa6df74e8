// SPDX-License-Identifier: MIT
// What `relume preview` makes a picture from: rays through the level, and the bake that is named or a draft made in
// memory.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/bake.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/result.h"
#include "tools/render/render_preview.h"

#include <optional>
#include <string>

namespace relume {

// Rays are of two kinds, which are one where nothing is dynamic.
struct PreviewLevel {
  std::optional<Bake> bake;  // none where rays are to find direct light alone
  std::optional<RayTracer> transport, withDynamic;
  const RayTracer& drawn() const { return withDynamic ? *withDynamic : *transport; }
};

struct PreviewLevelOptions {
  std::string scene, bake;  // paths; no bake: a draft is made
  bool allowStale = false;
  bool needsBake = false;  // else direct light will do where no draft can be made, with a warning
  RayStructure structure = RayStructure::bundles;
};

// A bake is read while rays are built. `source` becomes direct where there is no bake. Errors of readBakeOf(),
// reserveRays() and RayTracer::create(); of bake() where one is needed.
Result<PreviewLevel> makePreviewLevel(const Scene& scene, const PreviewLevelOptions& options, PreviewSource& source,
                                      Context& context);

}  // namespace relume
