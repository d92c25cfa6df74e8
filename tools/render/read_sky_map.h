// SPDX-License-Identifier: MIT
// Sky maps from files, and the light of a bake's sky patches by them.
#pragma once

#include "bake/scene/sky.h"
#include "relume/bake/context.h"
#include "relume/result.h"
#include "tools/images/image_io.h"

#include <filesystem>
#include <span>
#include <vector>

namespace relume {

// An equirectangular OpenEXR (channels R, G, B) or Radiance HDR file, whichever its first bytes say, in W/m²/sr.
// io: not readable; invalidFile: neither, broken, or a texel that is not within 0..1e9, by its place; errors of `fits`.
Result<SkyMap> readSkyMap(const std::filesystem::path& path, const MemoryCheck& fits = {});
// failed: beyond the context's budget.
Result<SkyMap> readSkyMap(const std::filesystem::path& path, Context& context);

// Mean radiance of each sky patch (LightSetup::skyPatches). [Size skyDirection, or 0 where the sky is constant]
std::vector<glm::vec3> skyPatchesOf(const Sky& sky, std::span<const glm::vec3> skyDirection);

}  // namespace relume
