// SPDX-License-Identifier: MIT
// Coloured lines in the level.
#pragma once

#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <span>

namespace relume {

struct LinePoint {
  glm::vec3 positionWorld{0.0f};  // [m]
  glm::vec3 color{1.0f};          // linear
};

class Lines {
 public:
  // failed: the shader did not compile.
  static Result<Lines> create();
  // Two points a line.
  void draw(std::span<const LinePoint> points, const glm::mat4& clipFromWorld, float exposure, bool encode) const;

 private:
  GlProgram program_;
  GlVertexArray layout_;
  GlBuffer points_;
};

}  // namespace relume
