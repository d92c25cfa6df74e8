// SPDX-License-Identifier: MIT
// See shading.h.
#include "tools/view/shading.h"

#include "relume/glossy.h"
#include "tools/gl_scene/gl_program.h"
#include "tools/gl_scene/level_shader.h"
#include "tools/view/display.h"
#include "tools/view/view_cones.h"
#include "tools/view/view_records.h"

#include <glm/gtc/type_ptr.hpp>

#include <string>
#include <utility>

namespace relume {
namespace {

// After constants viewMode, viewGloss, viewMirrors, viewRecords, viewCones, viewBaked.
const char* kMain = R"(
layout(location = 23) uniform vec2 viewShare;  // 1 where it is shown: direct light, light over links
layout(location = 24) uniform vec3 viewEye;
layout(location = 25) uniform float viewReflectance;
layout(location = 26) uniform float viewExponent;
layout(location = 27) uniform vec2 viewMapSize;  // texels of the light map
layout(location = 0) out vec4 outColor;
void main() {
  if (!levelOpaque()) discard;
  vec3 n = levelNormal(), p = levelPosition;
  const float invPi = 0.31830988618;
  // Each once: compilers put in a copy for each call.
  vec3 direct = vec3(0.0), links = vec3(0.0), color = vec3(0.0);
  if (viewMode < 2 || viewMode == 9) direct = invPi * levelDirect(p, n);
  if (viewMode == 0 || viewMode == 2 || viewMode == 7 || viewMode == 9) {
    vec3 byRecords;
    links = invPi * (viewRecords && recordIrradiance(p, n, byRecords) ? byRecords : levelLinks(p, n));
  }
  // What is scattered and what is mirrored; the lobe about the reflected direction.
  vec3 diffuse = levelAlbedo(), specular = vec3(0.0), toEye = normalize(viewEye - p);
  vec3 gloss = vec3(0.0), highlights = vec3(0.0), r = reflect(-toEye, n);
  float exponent = viewExponent;
  if (viewMirrors) {
    diffuse *= 1.0 - viewReflectance;
    specular = vec3(viewReflectance);
  }
  if (viewGloss) {
    vec2 metalRough = levelMetalRough();
    levelSplitReflectance(levelAlbedo(), metalRough, n, toEye, diffuse, specular);
    exponent = levelExponent(metalRough.y);
    if (viewMode == 0 || viewMode == 3) highlights = levelHighlights(p, r, exponent, toEye);
  }
  if (viewMode == 3 || (viewMode == 0 && (viewMirrors || viewGloss))) {
    // Beside cones a bake's caches have the lobes that are wide enough for them.
    float cached = !viewCones ? 1.0 : viewBaked ? levelCacheShare(exponent) : 0.0;
    if (viewCones) gloss = coneGlossy();
    if (cached > 0.0)
      gloss = mix(gloss, levelGlossy(p, n, r, viewGloss && !viewCones ? levelCacheExponent(exponent) : exponent), cached);
  }
  if (viewMode == 0) {
    color = diffuse * (viewShare.x * direct + viewShare.y * links) + levelEmission();
    color += specular * (viewShare.y * gloss + viewShare.x * highlights);
  }
  if (viewMode == 1) color = levelAlbedo() * direct + levelEmission();
  if (viewMode == 2) color = links;
  if (viewMode == 3) color = viewGloss ? specular * (gloss + highlights) : gloss;
  if (viewMode == 4) color = levelAlbedo();
  if (viewMode == 5) color = 0.5 * n + 0.5;
  if (viewMode == 6 || viewMode == 7) {
    // Where light is read: texels of the light map as a checker, what reads the grid in orange.
    const vec3 orange = vec3(1.0, 0.4, 0.05);
    vec2 uv;
    bool onMap = levelOnLightmap(uv);
    vec2 texel = floor(uv * viewMapSize);
    float facing = 0.4 + 0.6 * abs(dot(n, normalize(viewEye - p)));
    color = facing * (onMap ? vec3(mod(texel.x + texel.y, 2.0) < 0.5 ? 0.15 : 0.9) : orange);
    if (viewMode == 7) color = (onMap ? vec3(1.0) : orange) * links;
  }
  if (viewMode == 8) color = vec3(coneOpen());
  if (viewMode == 9) {
    outColor = vec4(viewShare.x * direct + viewShare.y * links, 1.0);
    return;
  }
  outColor = vec4(display(color), 1.0);
}
)";

std::string fragmentOf(const ShadingKind& kind, bool isBaked) {
  return "const int viewMode = " + std::to_string(static_cast<int>(kind.mode)) + ";\n" +
         levelConstant("viewGloss", kind.gloss) + levelConstant("viewMirrors", kind.mirrors) +
         levelConstant("viewRecords", kind.records) + levelConstant("viewCones", kind.cones) +
         levelConstant("viewBaked", isBaked) + displayGlsl() + ViewRecords::glsl() + ViewCones::glsl() + kMain;
}

}  // namespace

ShadingKind shadingKind(const ViewState& state, bool hasRecords, bool hasCones) {
  ShadingKind kind;
  kind.mode = state.mode == ViewMode::occlusion && !hasCones ? ViewMode::full : state.mode;
  const bool isMirrored = kind.mode == ViewMode::full || kind.mode == ViewMode::glossy;
  kind.gloss = isMirrored && state.gloss;
  kind.mirrors = isMirrored && !state.gloss && state.reflectance > 0.0f;
  const bool isLinked = kind.mode == ViewMode::full || kind.mode == ViewMode::links || kind.mode == ViewMode::grid ||
                        kind.mode == ViewMode::irradiance;
  kind.records = isLinked && hasRecords && state.records;
  const bool mirrors = kind.gloss || kind.mirrors || kind.mode == ViewMode::glossy;
  kind.cones = hasCones && (kind.mode == ViewMode::occlusion || (state.cones && mirrors));
  return kind;
}

Result<GLuint> Shading::program(const ShadingKind& kind, const Relighter* relighter) {
  const auto there = programs_.find(kind);
  if (there != programs_.end()) return there->second.name();
  auto made = relighter && kind.edited ? makeEditedProgram(*relighter, fragmentOf(kind, true))
              : relighter              ? makeLevelProgram(relighter, fragmentOf(kind, true))
                                       : makeLiveProgram(fragmentOf(kind, false));
  if (!made) return made.error();
  return programs_.emplace(kind, std::move(*made)).first->second.name();
}

void Shading::set(const ViewState& state, ViewMode shown, const glm::uvec2& mapSize, bool encode) {
  setDisplay(showsLight(shown) ? state.exposure : encode ? 0.5f : 0.0f, encode);  // a shoulder takes half a stop
  glUniform2f(23, state.direct ? 1.0f : 0.0f, state.indirect ? 1.0f : 0.0f);
  glUniform3fv(24, 1, glm::value_ptr(state.camera.position));
  glUniform1f(25, state.reflectance);
  glUniform1f(26, glossyExponent(state.roughness));
  glUniform2f(27, static_cast<float>(mapSize.x), static_cast<float>(mapSize.y));
}

}  // namespace relume
