// SPDX-License-Identifier: MIT
// Caches as spheres that show their light: on each side what a white surface with that normal would reflect.
#pragma once

#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <vector>

namespace relume {

// What has become of a position at which a cache was wanted.
enum class CacheState { valid, moved, off };

// A sphere: caches in their order, then what is off.
struct CacheSphere {
  glm::vec3 centreWorld{0.0f};  // [m]
  float radius = 0.0f;          // [m]
  CacheState state = CacheState::valid;
};
// moved: not where the grid has it, for that is inside of something. off: points of the grid without a cache.
std::vector<CacheSphere> cacheSpheres(const Bake& bake);

class Spheres {
 public:
  // failed: the shader did not compile.
  static Result<Spheres> create(const Bake& bake);
  void draw(const Relighter& relighter, const glm::mat4& clipFromWorld, const glm::vec3& eye, float exposure,
            bool encode) const;

 private:
  GlProgram program_;
  GlVertexArray layout_;
  GlBuffer spheres_, light_;
  GLsizei count_ = 0;
};

}  // namespace relume
