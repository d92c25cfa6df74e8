// SPDX-License-Identifier: MIT
// Many small discs in the level: surfels in the colour of their light.
#pragma once

#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <span>

namespace relume {

// In place of a colour: such a disc is not drawn.
inline constexpr glm::vec3 kHiddenDisc{-1.0f};

class Discs {
 public:
  // Normals of zero face the camera. [Size normal == position] failed: the shader did not compile.
  static Result<Discs> create(std::span<const glm::vec3> position, std::span<const glm::vec3> normal);
  // Linear colours. [Size color == position]
  void draw(std::span<const glm::vec3> color, float radius, const glm::mat4& clipFromWorld, const glm::vec3& eye,
            float exposure, bool encode) const;

 private:
  GlProgram program_;
  GlVertexArray layout_;
  GlBuffer position_, normal_, color_;
  GLsizei count_ = 0;
};

}  // namespace relume
