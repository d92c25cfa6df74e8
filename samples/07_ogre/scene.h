// SPDX-License-Identifier: MIT
// The level as OGRE's: meshes, materials, lights with their shadow textures, two things that move.
#pragma once

#include "level.h"
#include "relume_light.h"

#include <OgrePrerequisites.h>
#include <OgreSceneNode.h>

#include <string>
#include <vector>

class Scene {
 public:
  // failed: a program does not compile.
  static relume::Result<Scene> create(const Level& level, const RelumeLight& relume, Ogre::SceneManager& manager);

  Ogre::Camera& camera() const { return *camera_; }
  static constexpr Ogre::uint32 kSolids = 1, kSurfels = 2;  // visibility flags
  static const char* surfelMaterial() { return "surfels"; }

  void setSun(const glm::vec3& direction, const glm::vec3& irradiance);
  void setLamp(const glm::vec3& intensity);
  // 0 all light, 1 direct, 2 indirect; the last two as irradiance / pi.
  void show(int what);
  // Things that move, `seconds` into the game; not there where it is negative.
  void move(float seconds);

 private:
  Scene(const Level& level, Ogre::SceneManager& manager);
  relume::Status makePrograms(const std::string& resolve);
  Ogre::Pass* makePass(const std::string& name, const char* vertex, const char* fragment) const;
  void addShadows(Ogre::Pass& pass) const;
  void makeMaterials(const RelumeLight& relume);
  void makeMesh();
  void makeLights();

  const Level* level_;
  Ogre::SceneManager* manager_;
  Ogre::Camera* camera_ = nullptr;
  std::vector<Ogre::SceneNode*> lights_;  // the sun, then the lamp's six sides
  std::vector<Ogre::SceneNode*> moving_;
  std::vector<Ogre::Pass*> passes_;  // of all that is in the picture
  float sunTexel_ = 0.0f;
};
