// SPDX-License-Identifier: MIT
// Relume in a game of OGRE's: what to copy. OGRE draws the surfels as points with the game's own lights and shadow
// textures, the CPU relights, and textures that OGRE's shaders read take the light. No OpenGL call of its own.
#pragma once

#include <relume/bake_data.h>
#include <relume/relighter.h>

#include <OgreTexture.h>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <string>
#include <vector>

class RelumeLight {
 public:
  static relume::Result<RelumeLight> create(const relume::Bake& bake);

  // GLSL 3.30 for after #version: relumeIrradianceLightmap(), relumeIrradianceGrid().
  const std::string& glsl() const { return glsl_; }
  // Texture units and uniforms of a pass whose fragment program has that GLSL.
  void addTo(Ogre::Pass& pass) const;

  // The surfels of `bake`, once, as points of a material whose vertex program puts them at uv0 and whose fragment
  // program writes irradiance. Visible to viewports with `visibilityFlag`, which no other object has.
  void addSurfels(const relume::Bake& bake, Ogre::SceneManager& scene, Ogre::Camera& camera,
                  const std::string& material, Ogre::uint32 visibilityFlag);
  // Each frame, after OGRE has drawn it: its shadow textures are read. The light is for the next frame.
  relume::Status update();

  const relume::Relighter& relighter() const { return relighter_; }

 private:
  RelumeLight(relume::Relighter relighter, std::string glsl, relume::TextureResolve resolve);
  relume::Status write(std::size_t i);

  relume::Relighter relighter_;
  std::string glsl_;
  relume::TextureResolve resolve_;
  std::vector<Ogre::TexturePtr> textures_;  // of resolve_
  std::vector<std::byte> texels_;           // of the largest
  Ogre::TexturePtr target_;                 // irradiance of the surfels
  std::vector<glm::vec4> readBack_;
  std::vector<glm::vec3> irradiance_;
};
