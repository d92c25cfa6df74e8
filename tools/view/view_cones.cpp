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
  outPlane = vec4(levelPlane(p, -ray), 0.0);
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

void ViewCones::resize(std::uint32_t width, std::uint32_t height) {
  if (width_ == width && height_ == height) return;
  const auto texture = [&](GLenum format) {
    GlTexture made = GlTexture::make();
    glBindTexture(GL_TEXTURE_2D, made.name());
    glTexStorage2D(GL_TEXTURE_2D, 1, format, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
    glBindTexture(GL_TEXTURE_2D, 0);
    return made;
  };
  framebuffer_ = GlFramebuffer::make();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  std::array<GLenum, 4> buffers{};
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    surfaces_[i] = texture(GL_RGBA32F);
    buffers[i] = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i);
    glFramebufferTexture2D(GL_FRAMEBUFFER, buffers[i], GL_TEXTURE_2D, surfaces_[i].name(), 0);
  }
  depth_ = texture(GL_DEPTH_COMPONENT32F);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_.name(), 0);
  glDrawBuffers(static_cast<GLsizei>(buffers.size()), buffers.data());
  width_ = width;
  height_ = height;
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

Status ViewCones::update(const ViewState& state, const LiveOnGpu& light, const ConeView& view) {
  if (lit_ != view.lit) {
    if (Status ok = cones_.fill(light.volume(), light.caches()); !ok) return ok;
    lit_ = view.lit;
  }
  // 1. What the view sees
  const bool gloss = state.gloss && !occlusion_;
  const Result<GLuint> surfaces = program(gloss);
  if (!surfaces) return surfaces.error();
  resize(view.width, view.height);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glViewport(0, 0, static_cast<GLsizei>(view.width), static_cast<GLsizei>(view.height));
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClearDepth(1.0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glUseProgram(*surfaces);
  glUniform3fv(23, 1, glm::value_ptr(state.camera.position));
  glUniform1f(24, glossyExponent(state.roughness));
  view.draw(gloss);

  // 2. Cones from there
  const std::vector<glm::vec3> map = liveSkyMap(state.sky);
  const LiveSky sky{state.sky.radiance, map, map.empty() ? 0 : kLiveSkySide};
  PixelTextures pixels{width_,
                       height_,
                       surfaces_[0].name(),
                       surfaces_[1].name(),
                       surfaces_[2].name(),
                       occlusion_ ? 0u : surfaces_[3].name()};
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
