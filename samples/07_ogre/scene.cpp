// SPDX-License-Identifier: MIT
// See scene.h.
#include "scene.h"

#include "shaders.h"

#include <OgreCamera.h>
#include <OgreEntity.h>
#include <OgreHardwarePixelBuffer.h>
#include <OgreHighLevelGpuProgram.h>
#include <OgreHighLevelGpuProgramManager.h>
#include <OgreLight.h>
#include <OgreManualObject.h>
#include <OgreMaterialManager.h>
#include <OgrePass.h>
#include <OgreSceneManager.h>
#include <OgreShadowCameraSetup.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>

#include <glm/geometric.hpp>

#include <cmath>
#include <memory>

namespace {

constexpr Ogre::uint16 kSunSide = 2048, kLampSide = 512, kLights = 7;

Ogre::Vector3 vector(const glm::vec3& v) { return {v.x, v.y, v.z}; }

// Shadow textures that hold the whole level, wherever the camera is: surfels behind it are lit, too.
class LevelShadows : public Ogre::ShadowCameraSetup {
 public:
  explicit LevelShadows(const Level& level)
      : middle_(0.5f * (level.low + level.high)), radius_(0.5f * glm::distance(level.low, level.high) + 0.1f) {}

  float radius() const { return radius_; }

  void getShadowCamera(const Ogre::SceneManager*, const Ogre::Camera*, const Ogre::Viewport*, const Ogre::Light* light,
                       Ogre::Camera* camera, size_t) const override {
    const Ogre::Vector3 direction = light->getDerivedDirection();
    const bool isSun = light->getType() == Ogre::Light::LT_DIRECTIONAL;
    camera->setProjectionType(isSun ? Ogre::PT_ORTHOGRAPHIC : Ogre::PT_PERSPECTIVE);
    camera->setAspectRatio(1.0f);
    camera->setNearClipDistance(0.02f);
    if (isSun) {
      camera->setOrthoWindow(2.0f * radius_, 2.0f * radius_);
      camera->setFarClipDistance(2.0f * radius_);
    } else {
      camera->setFOVy(Ogre::Degree(91.0f));  // a texel more than its side of the cube
      camera->setFarClipDistance(radius_ + (light->getDerivedPosition() - vector(middle_)).length());
    }
    Ogre::SceneNode* const node = camera->getParentSceneNode();
    node->setPosition(isSun ? vector(middle_) - radius_ * direction : light->getDerivedPosition());
    node->setOrientation(Ogre::Vector3::NEGATIVE_UNIT_Z.getRotationTo(direction, Ogre::Vector3::UNIT_Y));
  }

 private:
  glm::vec3 middle_;
  float radius_;
};

}  // namespace

relume::Result<Scene> Scene::create(const Level& level, const RelumeLight& relume, Ogre::SceneManager& manager) {
  Scene made(level, manager);
  if (relume::Status compiled = made.makePrograms(relume.glsl()); !compiled) return compiled.error();
  made.makeLights();
  made.makeMaterials(relume);
  made.makeMesh();
  return made;
}

Scene::Scene(const Level& level, Ogre::SceneManager& manager) : level_(&level), manager_(&manager) {
  camera_ = manager.createCamera("camera");
  camera_->setFOVy(Ogre::Radian(level.fovYRad));
  camera_->setNearClipDistance(0.05f);
  camera_->setFarClipDistance(4.0f * glm::distance(level.low, level.high));
  const glm::mat4& m = level.worldFromCamera;
  Ogre::SceneNode* const node = manager.getRootSceneNode()->createChildSceneNode(vector(glm::vec3(m[3])));
  node->setOrientation(Ogre::Quaternion(vector(glm::vec3(m[0])), vector(glm::vec3(m[1])), vector(glm::vec3(m[2]))));
  node->attachObject(camera_);
  for (const Ogre::SceneManager::PrefabType shape : {Ogre::SceneManager::PT_SPHERE, Ogre::SceneManager::PT_CUBE}) {
    Ogre::Entity* const entity = manager.createEntity(shape);
    entity->setVisibilityFlags(kSolids);
    moving_.push_back(manager.getRootSceneNode()->createChildSceneNode());
    moving_.back()->attachObject(entity);
    moving_.back()->setScale(Ogre::Vector3(0.004f));  // OGRE's are 100 across
  }
}

relume::Status Scene::makePrograms(const std::string& resolve) {
  const std::string direct = kDirect;
  const std::vector<std::pair<const char*, std::string>> programs{{"solidVertex", kVertex},
                                                                  {"solidFragment", direct + resolve + kFragment},
                                                                  {"casterFragment", kCasterFragment},
                                                                  {"surfelVertex", kSurfelVertex},
                                                                  {"surfelFragment", direct + kSurfelFragment}};
  for (const auto& [name, source] : programs) {
    const bool isVertex = std::string(name).ends_with("Vertex");
    const Ogre::HighLevelGpuProgramPtr program = Ogre::HighLevelGpuProgramManager::getSingleton().createProgram(
        name, Ogre::RGN_DEFAULT, "glsl", isVertex ? Ogre::GPT_VERTEX_PROGRAM : Ogre::GPT_FRAGMENT_PROGRAM);
    program->setSource("#version 330\n" + source);
    program->load();
    if (program->hasCompileError())
      return relume::Error{relume::ErrorCode::failed, std::string("a shader does not compile: ") + name};
  }
  return relume::done();
}

Ogre::Pass* Scene::makePass(const std::string& name, const char* vertex, const char* fragment) const {
  Ogre::Pass* const pass =
      Ogre::MaterialManager::getSingleton().create(name, Ogre::RGN_DEFAULT)->getTechnique(0)->getPass(0);
  pass->setVertexProgram(vertex);
  pass->setFragmentProgram(fragment);
  pass->setCullingMode(Ogre::CULL_NONE);
  pass->setManualCullingMode(Ogre::MANUAL_CULL_NONE);
  pass->getVertexProgramParameters()->setIgnoreMissingParams(true);
  pass->getFragmentProgramParameters()->setIgnoreMissingParams(true);
  pass->getVertexProgramParameters()->setNamedAutoConstant("worldFromModel",
                                                           Ogre::GpuProgramParameters::ACT_WORLD_MATRIX);
  pass->getVertexProgramParameters()->setNamedAutoConstant("clipFromModel",
                                                           Ogre::GpuProgramParameters::ACT_WORLDVIEWPROJ_MATRIX);
  return pass;
}

// What kDirect reads, of OGRE's lights and their shadow textures.
void Scene::addShadows(Ogre::Pass& pass) const {
  using Parameters = Ogre::GpuProgramParameters;
  const Ogre::GpuProgramParametersSharedPtr parameters = pass.getFragmentProgramParameters();
  for (int i = 0; i < kLights; ++i) {
    parameters->setNamedConstant("shadow" + std::to_string(i), static_cast<int>(pass.getNumTextureUnitStates()));
    Ogre::TextureUnitState* const unit = pass.createTextureUnitState();
    unit->setContentType(Ogre::TextureUnitState::CONTENT_SHADOW);
    unit->setTextureAddressingMode(Ogre::TAM_CLAMP);
    unit->setTextureFiltering(Ogre::TFO_BILINEAR);
    unit->setTextureCompareEnabled(true);
    unit->setTextureCompareFunction(Ogre::CMPF_LESS_EQUAL);
  }
  parameters->setNamedAutoConstant("lightPosition", Parameters::ACT_LIGHT_POSITION_ARRAY, 2);
  parameters->setNamedAutoConstant("lightDirection", Parameters::ACT_LIGHT_DIRECTION_ARRAY, kLights);
  parameters->setNamedAutoConstant("lightIntensity", Parameters::ACT_LIGHT_DIFFUSE_COLOUR_ARRAY, 2);
  parameters->setNamedAutoConstant("mapFromWorld", Parameters::ACT_TEXTURE_VIEWPROJ_MATRIX_ARRAY, kLights);
  parameters->setNamedConstant("sunTexel", sunTexel_);
}

void Scene::makeMaterials(const RelumeLight& relume) {
  std::vector<Ogre::TexturePtr> images;
  const auto addImage = [&](int width, int height, const unsigned char* rgba) {
    images.push_back(Ogre::TextureManager::getSingleton().createManual(
        "image" + std::to_string(images.size()), Ogre::RGN_DEFAULT, Ogre::TEX_TYPE_2D, static_cast<Ogre::uint>(width),
        static_cast<Ogre::uint>(height), Ogre::MIP_UNLIMITED, Ogre::PF_BYTE_RGBA,
        Ogre::TU_DEFAULT | Ogre::TU_AUTOMIPMAP, nullptr, true));
    images.back()->getBuffer()->blitFromMemory(Ogre::PixelBox(images.back()->getWidth(), images.back()->getHeight(), 1,
                                                              Ogre::PF_BYTE_RGBA, const_cast<unsigned char*>(rgba)));
  };
  const unsigned char white[4] = {255, 255, 255, 255};
  for (const Image& image : level_->images) {
    if (image.rgba.empty())
      addImage(1, 1, white);
    else
      addImage(image.width, image.height, image.rgba.data());
  }
  addImage(1, 1, white);

  const auto fill = [&](Ogre::Pass& pass, const Material& m) {
    const Ogre::GpuProgramParametersSharedPtr parameters = pass.getFragmentProgramParameters();
    Ogre::TextureUnitState* const unit = pass.createTextureUnitState();
    unit->setTexture(m.image >= 0 ? images[static_cast<std::size_t>(m.image)] : images.back());
    unit->setTextureFiltering(Ogre::TFO_TRILINEAR);
    parameters->setNamedConstant("image", 0);
    parameters->setNamedConstant("color", Ogre::Vector4(m.color.r, m.color.g, m.color.b, m.color.a));
    parameters->setNamedConstant("emission", Ogre::Vector4(m.emission.r, m.emission.g, m.emission.b, m.alphaCutoff));
  };
  const auto make = [&](const std::string& name, const Material& m) {
    fill(*makePass(name + " caster", "solidVertex", "casterFragment"), m);
    Ogre::Pass* const pass = makePass(name, "solidVertex", "solidFragment");
    pass->getParent()->setShadowCasterMaterial(name + " caster");
    pass->getFragmentProgramParameters()->setNamedAutoConstant("eye", Ogre::GpuProgramParameters::ACT_CAMERA_POSITION);
    fill(*pass, m);
    addShadows(*pass);
    relume.addTo(*pass);
    passes_.push_back(pass);
  };
  for (std::size_t i = 0; i < level_->materials.size(); ++i) make("level " + std::to_string(i), level_->materials[i]);
  make("moving", {.color = {0.7f, 0.7f, 0.7f, 1.0f}});
  for (Ogre::SceneNode* const node : moving_)
    static_cast<Ogre::Entity*>(node->getAttachedObject(0))->setMaterialName("moving");
  addShadows(*makePass(surfelMaterial(), "surfelVertex", "surfelFragment"));
}

void Scene::makeMesh() {
  Ogre::ManualObject* const object = manager_->createManualObject("level");
  for (const Draw& draw : level_->draws) {
    object->begin("level " + std::to_string(draw.material), Ogre::RenderOperation::OT_TRIANGLE_LIST);
    const auto first = level_->indices.begin() + draw.firstIndex, end = first + draw.indexCount;
    const auto [low, high] = std::minmax_element(first, end);
    for (std::uint32_t i = *low; i <= *high; ++i) {
      const Vertex& v = level_->vertices[i];
      object->position(vector(v.position));
      object->normal(vector(v.normal));
      object->textureCoord(v.uv.x, v.uv.y);
      object->textureCoord(static_cast<float>(v.lightmapUv[0]) / 65535.0f,
                           static_cast<float>(v.lightmapUv[1]) / 65535.0f);
    }
    for (auto i = first; i != end; ++i) object->index(*i - *low);
    object->end();
  }
  Ogre::Entity* const entity = manager_->createEntity(object->convertToMesh("level"));
  entity->setVisibilityFlags(kSolids);
  manager_->getRootSceneNode()->attachObject(entity);
  manager_->destroyManualObject(object);
}

// OGRE has no shadow texture for what shines all around: six spots make the lamp.
void Scene::makeLights() {
  const auto shadows = std::make_shared<LevelShadows>(*level_);
  sunTexel_ = 2.0f * shadows->radius() / kSunSide;
  manager_->setShadowTechnique(Ogre::SHADOWTYPE_TEXTURE_ADDITIVE_INTEGRATED);
  manager_->setShadowTextureSelfShadow(true);
  manager_->setShadowCasterRenderBackFaces(false);
  manager_->setShadowTextureCount(kLights);
  for (std::size_t i = 0; i < kLights; ++i) {
    const Ogre::uint16 side = i == 0 ? kSunSide : kLampSide;
    manager_->setShadowTextureConfig(i, side, side, Ogre::PF_DEPTH32F);
  }
  manager_->setShadowCameraSetup(shadows);

  const Ogre::Vector3 sides[kLights] = {
      vector(level_->sun.direction),  Ogre::Vector3::UNIT_X, Ogre::Vector3::NEGATIVE_UNIT_X, Ogre::Vector3::UNIT_Y,
      Ogre::Vector3::NEGATIVE_UNIT_Y, Ogre::Vector3::UNIT_Z, Ogre::Vector3::NEGATIVE_UNIT_Z};
  for (int i = 0; i < kLights; ++i) {
    Ogre::Light* const light = manager_->createLight("light " + std::to_string(i));
    light->setType(i == 0 ? Ogre::Light::LT_DIRECTIONAL : Ogre::Light::LT_SPOTLIGHT);
    lights_.push_back(manager_->getRootSceneNode()->createChildSceneNode(vector(level_->lamp.positionWorld)));
    lights_.back()->attachObject(light);
    lights_.back()->setOrientation(Ogre::Vector3::NEGATIVE_UNIT_Z.getRotationTo(sides[i], Ogre::Vector3::UNIT_Y));
  }
  setSun(level_->sun.direction, level_->sun.intensity);
  setLamp(level_->lamp.intensity);
}

void Scene::setSun(const glm::vec3& direction, const glm::vec3& irradiance) {
  lights_[0]->setOrientation(Ogre::Vector3::NEGATIVE_UNIT_Z.getRotationTo(vector(direction), Ogre::Vector3::UNIT_Y));
  static_cast<Ogre::Light*>(lights_[0]->getAttachedObject(0))
      ->setDiffuseColour(irradiance.r, irradiance.g, irradiance.b);
}

void Scene::setLamp(const glm::vec3& intensity) {
  for (std::size_t i = 1; i < kLights; ++i)
    static_cast<Ogre::Light*>(lights_[i]->getAttachedObject(0))
        ->setDiffuseColour(intensity.r, intensity.g, intensity.b);
}

void Scene::show(int what) {
  for (Ogre::Pass* const pass : passes_) {
    const bool isMoving = pass == passes_.back();
    pass->getFragmentProgramParameters()->setNamedConstant("show",
                                                           Ogre::Vector4(what != 2, what != 1, what != 0, isMoving));
  }
}

void Scene::move(float seconds) {
  // Around a point in front of the camera
  const glm::vec3 ahead = glm::vec3(level_->worldFromCamera * glm::vec4(0, 0, -3.0f, 1));
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    const float angle = 0.5f * seconds + 3.14159265f * static_cast<float>(i);
    moving_[i]->setVisible(seconds >= 0.0f);
    moving_[i]->setPosition(ahead.x + 0.8f * std::cos(angle), 0.6f + 0.3f * std::sin(2.0f * angle),
                            ahead.z - 0.8f * std::sin(angle));
    moving_[i]->setOrientation(Ogre::Quaternion(Ogre::Radian(1.3f * seconds), Ogre::Vector3(0.6f, 0.8f, 0.0f)));
  }
}
