// SPDX-License-Identifier: MIT
// Shadow maps of all punctual lights: the host's share of a frame (step 1 of include/relume/relighter.h). Directional
// lights and narrow spots have a layer of a depth array each, points and wide spots six layers of another, the sides of
// a cube. Where a directional light's texels are coarse, for the level is wide, up to two more layers about the eye
// have texels an eighth and a 64th as large.
//
// glsl() defines float relumeVisibility(uint light, vec3 positionWorld, vec3 normal) both for the surfel pass
// (RelightOptions::visibilityGlsl) and for pixels, so that both see the same shadows.
#pragma once

#include "relume/lights.h"
#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"
#include "tools/gl_scene/gl_level.h"

#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relume {

class ShadowMaps {
 public:
  static constexpr std::uint32_t kMaxLights = 32;
  static constexpr int kFlatUnit = 8, kSideUnit = 9;  // texture units

  // `size` texels a side of a flat map, half as many of a cube's side. failed: a shader did not compile.
  static Result<ShadowMaps> create(std::uint32_t size);

  // Render the maps of these lights. `moved`: where the dynamic instances are, as for GlLevel::drawDynamic(); null
  // leaves them out. eyeWorld [m]: what finer maps lie about; null = none. Changes the framebuffer binding, the
  // viewport, depth and cull state and the program. usage: more than kMaxLights lights; failed: no memory for the maps.
  Status update(const GlLevel& level, std::span<const Light> lights, const std::vector<glm::mat4>* moved = nullptr,
                const glm::vec3* eyeWorld = nullptr);
  // Whether update() would place the maps as they are for this eye, lights and level being the same.
  bool isAbout(const glm::vec3& eyeWorld) const;
  // Tell a program that contains glsl() where the maps are. Call after update().
  void setUniforms(GLuint program) const;
  // Bind the maps to their units; before drawing and before relight().
  void bind() const;

  static std::string glsl();

 private:
  static constexpr std::uint32_t kMaxInner = 2;
  struct Map {
    glm::mat4 fromOrigin{1.0f};                // flat: [0..1] map coordinates, after division by w
    glm::vec4 light{0.0f};                     // origin [m]: the light's position, of a directional one the level's
                                               // middle; 1 / farthest distance [1/m], 0 = directional
    glm::vec4 layer{-1.0f, 0.0f, 0.0f, 0.0f};  // 0 flat, 1 cube; first layer; texel: [m] or [m a metre of distance]
    // Finer maps of a directional light, in the layers after its own: middle, in map coordinates; how many times as
    // fine, 0 = none.
    std::array<glm::vec3, kMaxInner> inner{};
  };
  Status allocate(std::uint32_t flat, std::uint32_t cubes);
  glm::vec3 innerMap(const Map& map, const glm::vec3& eyeWorld, float finer) const;
  void renderLayer(const GlLevel& level, const std::vector<glm::mat4>* moved, const glm::mat4& clip,
                   const glm::vec4& light, GLuint texture, std::uint32_t layer, std::uint32_t size) const;

  GlProgram depthProgram_, distanceProgram_;  // of directional lights, and of those with a position
  GlFramebuffer framebuffer_;
  GlTexture flat_, sides_;
  std::uint32_t size_ = 0, flatLayers_ = 0, cubes_ = 0;
  std::vector<Map> maps_;
};

}  // namespace relume
