// SPDX-License-Identifier: MIT
// The program that shades a level: direct light of punctual lights with the shadows of shadow_maps.h, light over links
// by the runtime's resolve, albedo, emission. What it writes is decided by the caller's main().
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"

#include <glm/vec3.hpp>

#include <span>
#include <string>

namespace relume {

// Links a program whose fragment shader ends in `mainGlsl`, which may call the functions of levelMaterialGlsl() and
//   vec3 levelDirect(vec3 p, vec3 n)   irradiance [W/m²] of the lights, shadowed
//   vec3 levelLinks(vec3 p, vec3 n)    irradiance [W/m²] over links, zero without a relighter
// `relighter` is of the GL backend, or null. failed: a shader did not compile.
Result<GlProgram> makeLevelProgram(const Relighter* relighter, const std::string& mainGlsl);

// Set the lights of such a program; at most ShadowMaps::kMaxLights.
void setLevelLights(GLuint program, std::span<const Light> lights);

}  // namespace relume
