// SPDX-License-Identifier: MIT
// A level in OpenGL 4.3: its triangles with their light-map coordinates in one vertex buffer, its textures, and draws
// sorted by material. What a game's own renderer would do, as plainly as it can be done.
//
// Programs that draw it put levelVertexGlsl() into their vertex shader, levelMaterialGlsl() into their fragment shader.
#pragma once

#include "relume/bake/scene.h"
#include "relume/caches.h"
#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"
#include "tools/gl_scene/level_view.h"

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relume {

// What moves together: the instances of one node, or of one of its GPU instances.
struct MovingNode {
  std::string name;
  std::uint32_t firstInstance = 0, instanceCount = 0;
  glm::vec3 centreWorld{0.0f};  // [m] of its bounds, where the level has it
};
// The dynamic nodes of a level, or all that it draws.
enum class Movable { dynamic, all };
std::vector<MovingNode> movingNodes(const Scene& scene, Movable movable = Movable::dynamic);
// Where all instances of a scene are once moved[k] comes after the own transforms of nodes[k]. [Size moved: nodes]
std::vector<glm::mat4> placedInstances(const Scene& scene, std::span<const MovingNode> nodes,
                                       std::span<const glm::mat4> moved);

class GlLevel {
 public:
  // Uploads the level. `lightmap` may be null: everything is lit by the grid. movable: what drawDynamic() draws.
  // isEdited: instances that are not what the bake has there, for shaders that ask levelIsEdited. [Size instances, or
  // 0 = none] failed: out of GPU memory.
  static Result<GlLevel> create(const Scene& scene, const Lightmap* lightmap, Movable movable = Movable::dynamic,
                                std::span<const std::uint8_t> isEdited = {});

  // Draw what stands with the program in use. Binds a vertex array, and textures and samplers on kMaterialUnits.
  // `gloss`: levelNormal() bends normals by normal maps.
  void draw(const LevelView& view, bool gloss = false) const;
  // Draw what moves, lit by the grid; what the bake knows is on the light map where it has not been moved. moved[k] is
  // applied after the own transforms of movingNodes()[k]. [Size moved: theirs, or 0 = they are where the level has
  // them]
  void drawDynamic(const LevelView& view, std::span<const glm::mat4> moved, bool gloss = false) const;

  // Let a material of the scene emit another radiance [W/m²/sr] from now on: times its emissive texture, or evenly.
  void setEmission(std::uint32_t material, const glm::vec3& radiance, const TextureRef& texture);

  glm::vec3 boundsMin() const { return boundsMin_; }  // [m] of all instances, dynamic ones where the level has them
  glm::vec3 boundsMax() const { return boundsMax_; }
  std::uint32_t triangleCount() const { return triangleCount_; }

  // Texture units: albedo, emission; metalness and roughness, normal map. Shadow maps have 8 and 9, the resolve 12
  // to 15.
  static constexpr std::array<int, 4> kMaterialUnits{10, 11, 6, 7};

 private:
  struct Batch {  // triangles of one material, contiguous in the vertex buffer
    GLint firstVertex = 0;
    GLsizei vertexCount = 0;
    std::uint32_t material = kNone;
    std::uint32_t moving = kNone;           // index into movingNodes(); kNone = fixed
    bool isBaked = true, isEdited = false;  // a part that the bake knows; but has another one there
  };
  void drawBatches(const LevelView& view, std::span<const glm::mat4> moved, bool dynamic, bool gloss) const;
  void bindMaterial(const Material& material, bool gloss) const;
  void bindTexture(int unit, const TextureRef& texture) const;

  GlBuffer vertices_, glossVertices_, colors_;  // of a level with images of numbers, with vertex colours alone
  GlVertexArray layout_;
  std::vector<Batch> batches_;
  std::vector<Material> materials_;  // the scene's, then glTF's default
  std::vector<GlTexture> images_;
  GlTexture white_;
  std::vector<GlSampler> samplers_;  // wrapU + 3 wrapV + 9 nearest
  glm::vec3 boundsMin_{0.0f}, boundsMax_{0.0f};
  std::uint32_t triangleCount_ = 0;
};

// For vertex shaders: the inputs, and levelVertex(), which sets gl_Position and the outputs below.
std::string levelVertexGlsl();
// For fragment shaders: those inputs, and
//   bool levelOpaque()       false where the alpha test cuts the surface away
//   vec3 levelAlbedo()       [0..1] linear
//   vec3 levelEmission()     [W/m²/sr] zero on the back of a one-sided material
//   vec3 levelNormal()       unit, toward the viewer, bent by the normal map where the draw has gloss
//   vec2 levelMetalRough()   [0..1] metalness, roughness
//   bool levelOnLightmap(out vec2 uv)   whether this side of the triangle is on the light map, and where
//   levelPosition            [m] in the world
//   levelPlace               [m] from LevelView::originWorld: without the rounding of places far out
//   levelIsEdited            whether what is drawn is a part of the bake's level that has been changed or moved
std::string levelMaterialGlsl();

}  // namespace relume
