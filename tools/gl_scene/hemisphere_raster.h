// SPDX-License-Identifier: MIT
// What points of a level see, drawn in OpenGL: radiance and distance through the pixels of a square in front of each
// point, lit by punctual lights with shadow maps and reflected once (RCS 5.2).
#pragma once

#include "relume/bake/scene.h"
#include "relume/lights.h"
#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/gl_scene/shadow_maps.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

class HemisphereRaster {
 public:
  struct Options {
    std::uint32_t side = 64;          // [2..256] pixels along a side of the square
    float fovRad = 2.2142974f;        // (0..pi) angle that it spans along a side
    std::uint32_t shadowSize = 2048;  // texels along a side of a shadow map
  };
  // In the current context, which must outlive it. usage: more lights than ShadowMaps has; unsupported: no targets of
  // 32-bit floats; failed: out of GPU memory.
  static Result<HemisphereRaster> create(const Scene& scene, std::span<const Light> lights, const Options& options);

  // worldFromFrame: tangent, bitangent, normal and position [m]; a picture of side * side pixels for each. Pixel (i, j)
  // is number j * side + i of its picture, i along the tangent. radiance [W/m²/sr]; distance [m] to the surface at the
  // pixel's centre, infinite where nothing is. [Size radiance = distance = poses * side * side]
  void draw(std::span<const glm::mat4> worldFromFrame, std::span<glm::vec3> radiance, std::span<float> distance);

 private:
  HemisphereRaster(GlLevel&& level, ShadowMaps&& shadows, GlProgram&& program, const Options& options);
  LevelView viewOf(const glm::mat4& worldFromFrame) const;
  void read(std::size_t count, std::span<glm::vec3> radiance, std::span<float> distance);

  Options options_;
  GlLevel level_;
  ShadowMaps shadows_;
  GlProgram program_;
  GlFramebuffer framebuffer_;
  GlTexture light_, depth_;  // kColumns * kColumns pictures
  float near_ = 0.0f;        // [m] nothing nearer is drawn
  bool reversed_ = false;    // depth is near / distance, which keeps its digits far away
  std::vector<glm::vec4> pixels_;
};

}  // namespace relume
