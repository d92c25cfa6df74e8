// SPDX-License-Identifier: MIT
// The sky behind the level: an equirectangular map, looked up along the rays of the pixels.
#pragma once

#include "bake/scene/sky.h"
#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"

#include <glm/mat4x4.hpp>

namespace relume {

class Backdrop {
 public:
  // failed: a shader's log. A map wider than 2048 texels is shown reduced.
  static Result<Backdrop> create(const SkyMap& map);

  // Fill the viewport. clip: clip space from the world; rotationDeg as Sky's. The depth test must be off.
  void draw(const glm::mat4& clip, float rotationDeg, float exposure, bool encode) const;

 private:
  GlProgram program_;
  GlTexture texture_;
  GlVertexArray nothing_;
};

}  // namespace relume
