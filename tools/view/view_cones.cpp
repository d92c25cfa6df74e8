// SPDX-License-Identifier: MIT
// See view_cones.h.
#include "tools/view/view_cones.h"

#include "relume/glossy.h"
#include "tools/gl_scene/level_shader.h"
#include "tools/render/live_view.h"
#include "tools/render/view_options.h"

#include <glm/gtc/type_ptr.hpp>

namespace relume {
namespace {

constexpr GLuint kConeUnit = 19;  // and the next: what is mirrored, and light with occlusion

// After `const bool coneGloss`. What cones start from.
const char* kSurfaces = R"(
layout(location = 0) out vec4 outPlace;
layout(location = 1) out vec4 outPlane;
layout(location = 2) out vec4 outNormal;
layout(location = 3) out vec4 outMirrored;
layout(location = 23) uniform vec3 coneEye;
layout(location = 24) uniform float coneExponent;  // of all surfaces, where materials do not say it
void main() {
  if (!levelOpaque()) discard;
  vec3 n = levelNormal(), p = levelPosition, ray = normalize(p - coneEye);
  outPlace = vec4(p, 1.0 / gl_FragCoord.w);
  outPlane = vec4(levelPlane(-ray), 0.0);
  outNormal = vec4(n, 0.0);
  outMirrored = vec4(reflect(ray, n), coneGloss ? levelExponent(levelMetalRough().y) : coneExponent);
}
)";

const char* kRead = R"(
layout(binding = 19) uniform sampler2D coneGlossyTexels;
layout(binding = 20) uniform sampler2D coneLightTexels;
vec3 coneGlossy() { return texelFetch(coneGlossyTexels, ivec2(gl_FragCoord.xy), 0).rgb; }
float coneOpen() { return 1.0 - texelFetch(coneLightTexels, ivec2(gl_FragCoord.xy), 0).w; }
)";

}  // namespace

Result<std::unique_ptr<ViewCones>> ViewCones::create(bool occlusion, const GetProcAddress& getProcAddress) {
  PixelConeOptions pixels;
  pixels.falloff = kOcclusionFalloff;
  auto cones = ConesGl::create({pixels, RadianceMips::Directions::six, occlusion, getProcAddress});
  if (!cones) return cones.error();
  return std::unique_ptr<ViewCones>(new ViewCones(occlusion, std::move(*cones)));
}

Result<GLuint> ViewCones::program(bool gloss) {
  const std::size_t which = gloss ? 1 : 0;
  if (!isMade_[which]) {
    auto made = makeLevelProgram(nullptr, levelConstant("coneGloss", gloss) + kSurfaces);
    if (!made) return made.error();
    programs_[which] = std::move(*made);
    isMade_[which] = true;
  }
  return programs_[which].name();
}

Status ViewCones::update(const ViewState& state, VolumeRange volumes, std::span<const gl::LitSides* const> lit,
                         const ConeView& view) {
  if (lit_ != view.lit) {
    if (Status ok = cones_.fill(volumes, lit); !ok) return ok;
    lit_ = view.lit;
  }
  // 1. What the view sees
  const bool gloss = state.gloss && !occlusion_;
  const Result<GLuint> surfaces = program(gloss);
  if (!surfaces) return surfaces.error();
  if (surfaces_.width() != view.width || surfaces_.height() != view.height)
    surfaces_ = DrawTargets(view.width, view.height);
  surfaces_.begin(view.width, view.height);
  glUseProgram(*surfaces);
  glUniform3fv(23, 1, glm::value_ptr(state.camera.position));
  glUniform1f(24, glossyExponent(state.roughness));
  view.draw(gloss);

  // 2. Cones from there
  const std::vector<glm::vec3> map = liveSkyMap(state.sky);
  const LiveSky sky{state.sky.radiance, map, map.empty() ? 0 : kLiveSkySide};
  PixelTextures pixels{view.width,           view.height,          surfaces_.texture(0),
                       surfaces_.texture(1), surfaces_.texture(2), occlusion_ ? 0u : surfaces_.texture(3)};
  pixels.clipFromWorld = view.clipFromWorld;
  return cones_.trace(pixels, sky);
}

std::string ViewCones::glsl() { return kRead; }

void ViewCones::bind() const {
  const GLuint found[] = {cones_.glossyTexture(), cones_.lightTexture()};
  for (GLuint i = 0; i < 2; ++i) {
    glActiveTexture(GL_TEXTURE0 + kConeUnit + i);
    glBindTexture(GL_TEXTURE_2D, found[i]);
  }
  glActiveTexture(GL_TEXTURE0);
}

}  // namespace relume
