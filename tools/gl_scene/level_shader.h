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
//   vec3 levelGlossy(vec3 p, vec3 n, vec3 r, float exponent)   mean radiance over links in a lobe about r, likewise
//   vec3 levelHighlights(vec3 p, vec3 r, float exponent, vec3 toEye)   radiance of the lights in it, shadowed
//   float levelCacheExponent(float exponent)   at which to ask levelGlossy() where nobody else takes what is sharper
//   float levelCacheShare(float exponent)   of what is to be asked of it where somebody does
//   float levelExponent(float roughness), void levelSplitReflectance(baseColor, metalRough, n, toEye, out diffuse, out
//   specular)                          glossyExponent() and splitReflectance() of relume/glossy.h
// `relighter` is of the GL backend, or null; lookup: how levelLinks() reads the grid. failed: a shader did not compile.
Result<GlProgram> makeLevelProgram(const Relighter* relighter, const std::string& mainGlsl,
                                   GridLookup lookup = GridLookup::stencil);

// The same for a level that was edited since: levelLinks() reads what EditFields has bound as well.
Result<GlProgram> makeEditedProgram(const Relighter& relighter, const std::string& mainGlsl,
                                    GridLookup lookup = GridLookup::stencil);

// A constant for `mainGlsl`: what it says is not so is not computed. Software rasterisers run both sides of every
// branch.
std::string levelConstant(const char* name, bool value);

// The same without a relighter: levelLinks() and levelGlossy() read what LiveField has bound.
Result<GlProgram> makeLiveProgram(const std::string& mainGlsl);

// One that writes depths alone, the same as of the programs above.
Result<GlProgram> makeDepthProgram();

// Set the lights of such a program; at most ShadowMaps::kMaxLights.
void setLevelLights(GLuint program, std::span<const Light> lights);

}  // namespace relume
