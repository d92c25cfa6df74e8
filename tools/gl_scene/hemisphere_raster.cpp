// SPDX-License-Identifier: MIT
// See hemisphere_raster.h. Pictures are drawn side by side into one target, which is read back once for all.
#include "tools/gl_scene/hemisphere_raster.h"

#include "tools/gl_scene/level_shader.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume {
namespace {

constexpr std::size_t kColumns = 8;       // pictures along a side of the target
constexpr float kNearOfDiagonal = 1e-5f;  // the near plane, of the level's diagonal

// In w the distance, 0 where nothing is drawn.
const char* kMain = R"(
layout(location = 0) out vec4 outLight;
void main() {
  if (!levelOpaque()) discard;
  vec3 reflected = levelAlbedo() * levelDirect(levelPosition, levelNormal()) * 0.31830988618;
  outLight = vec4(reflected, length(levelPlace));
}
)";

GlTexture storage(GLenum format, std::uint32_t side) {
  GlTexture texture = GlTexture::make();
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, format, static_cast<GLsizei>(side), static_cast<GLsizei>(side));
  glBindTexture(GL_TEXTURE_2D, 0);
  return texture;
}

}  // namespace

HemisphereRaster::HemisphereRaster(GlLevel&& level, ShadowMaps&& shadows, GlProgram&& program, const Options& options)
    : options_(options), level_(std::move(level)), shadows_(std::move(shadows)), program_(std::move(program)) {
  near_ = kNearOfDiagonal * glm::distance(level_.boundsMin(), level_.boundsMax());
  reversed_ = epoxy_gl_version() >= 45 || epoxy_has_gl_extension("GL_ARB_clip_control");
}

Result<HemisphereRaster> HemisphereRaster::create(const Scene& scene, std::span<const Light> lights,
                                                  const Options& options) {
  auto level = GlLevel::create(scene, nullptr);
  if (!level) return level.error();
  auto shadows = ShadowMaps::create(options.shadowSize);
  if (!shadows) return shadows.error();
  // Dynamic instances cast shadows where the level has them; no other light knows of them.
  const std::vector<glm::mat4> unmoved;
  if (Status ok = shadows->update(*level, lights, &unmoved); !ok) return ok.error();
  auto program = makeLevelProgram(nullptr, kMain);
  if (!program) return program.error();
  shadows->setUniforms(program->name());
  setLevelLights(program->name(), lights);

  HemisphereRaster raster(std::move(*level), std::move(*shadows), std::move(*program), options);
  const auto side = static_cast<std::uint32_t>(kColumns) * options.side;
  raster.light_ = storage(GL_RGBA32F, side);
  raster.depth_ = storage(GL_DEPTH_COMPONENT32F, side);
  raster.framebuffer_ = GlFramebuffer::make();
  glBindFramebuffer(GL_FRAMEBUFFER, raster.framebuffer_.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, raster.light_.name(), 0);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, raster.depth_.name(), 0);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return Error{ErrorCode::unsupported, "OpenGL cannot draw into 32-bit float targets"};
  return raster;
}

// The square's x is the bitangent and its y the tangent: seen along the normal these two are right and up.
LevelView HemisphereRaster::viewOf(const glm::mat4& worldFromFrame) const {
  const glm::vec3 up(worldFromFrame[0]), right(worldFromFrame[1]), forward(worldFromFrame[2]);
  const float scale = 1.0f / std::tan(0.5f * options_.fovRad);
  const glm::vec4 depth(forward, 0.0f), near(0.0f, 0.0f, 0.0f, near_);
  // Reversed: near / depth, in [0..1]. Else 1 - 2 near / depth, in [-1..1].
  return {glm::vec3(worldFromFrame[3]),
          glm::transpose(glm::mat4(glm::vec4(scale * right, 0.0f), glm::vec4(scale * up, 0.0f),
                                   reversed_ ? near : depth - 2.0f * near, depth))};
}

void HemisphereRaster::draw(std::span<const glm::mat4> worldFromFrame, std::span<glm::vec3> radiance,
                            std::span<float> distance) {
  const std::size_t pixels = std::size_t{options_.side} * options_.side;
  shadows_.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glDepthFunc(reversed_ ? GL_GREATER : GL_LESS);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClearDepth(reversed_ ? 0.0 : 1.0);
  if (reversed_) glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  for (std::size_t first = 0; first < worldFromFrame.size(); first += kColumns * kColumns) {
    const std::size_t count = std::min(kColumns * kColumns, worldFromFrame.size() - first);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(program_.name());
    const auto side = static_cast<GLsizei>(options_.side);
    for (std::size_t k = 0; k < count; ++k) {
      glViewport(static_cast<GLint>(k % kColumns) * side, static_cast<GLint>(k / kColumns) * side, side, side);
      level_.draw(viewOf(worldFromFrame[first + k]));
    }
    read(count, radiance.subspan(first * pixels, count * pixels), distance.subspan(first * pixels, count * pixels));
  }
  if (reversed_) glClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
  glClearDepth(1.0);
}

// The pictures of the target; a column of theirs is a row of the caller's.
void HemisphereRaster::read(std::size_t count, std::span<glm::vec3> radiance, std::span<float> distance) {
  const std::size_t side = options_.side, columns = std::min(count, kColumns), width = columns * side,
                    height = (count + kColumns - 1) / kColumns * side;
  pixels_.resize(width * height);
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  glReadPixels(0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height), GL_RGBA, GL_FLOAT, pixels_.data());
  for (std::size_t k = 0; k < count; ++k) {
    const glm::vec4* const picture = &pixels_[k / kColumns * side * width + k % kColumns * side];
    for (std::size_t i = 0; i < side; ++i) {
      for (std::size_t j = 0; j < side; ++j) {
        const glm::vec4& pixel = picture[i * width + j];
        const std::size_t cell = (k * side + j) * side + i;
        radiance[cell] = glm::vec3(pixel);
        distance[cell] = pixel.w > 0.0f ? pixel.w : std::numeric_limits<float>::infinity();
      }
    }
  }
}

}  // namespace relume
