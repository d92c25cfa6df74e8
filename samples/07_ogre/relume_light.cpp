// SPDX-License-Identifier: MIT
// See relume_light.h.
#include "relume_light.h"

#include <OgreHardwarePixelBuffer.h>
#include <OgreManualObject.h>
#include <OgrePass.h>
#include <OgreRenderTexture.h>
#include <OgreRoot.h>
#include <OgreSceneManager.h>
#include <OgreTextureManager.h>
#include <OgreViewport.h>

#include <algorithm>

namespace {

constexpr std::uint32_t kRow = 512;  // surfels a row of their target

// By relume::TexelFormat and relume::TextureShape
constexpr Ogre::PixelFormat kFormats[] = {Ogre::PF_FLOAT16_RGBA, Ogre::PF_FLOAT16_GR, Ogre::PF_BYTE_RGBA, Ogre::PF_R8};
constexpr Ogre::TextureType kShapes[] = {Ogre::TEX_TYPE_2D, Ogre::TEX_TYPE_2D_ARRAY, Ogre::TEX_TYPE_3D};

Ogre::PixelFormat format(const relume::ResolveTexture& t) { return kFormats[static_cast<std::size_t>(t.format)]; }

}  // namespace

relume::Result<RelumeLight> RelumeLight::create(const relume::Bake& bake) {
  relume::RelightOptions options;  // parallelFor: the game's job system
  relume::Result<relume::Relighter> relighter = relume::Relighter::create(bake, options);
  if (!relighter) return relighter.error();
  relume::Result<std::string> glsl = relighter->textureResolveGlsl();
  if (!glsl) return glsl.error();
  relume::Result<relume::TextureResolve> resolve = relighter->textureResolve();
  if (!resolve) return resolve.error();
  RelumeLight made(std::move(*relighter), std::move(*glsl), std::move(*resolve));
  for (std::size_t i = 0; i < made.textures_.size(); ++i) {
    if (relume::Status written = made.write(i); !written) return written.error();
  }
  return made;
}

RelumeLight::RelumeLight(relume::Relighter relighter, std::string glsl, relume::TextureResolve resolve)
    : relighter_(std::move(relighter)), glsl_(std::move(glsl)), resolve_(std::move(resolve)) {
  std::size_t bytes = 0;
  for (const relume::ResolveTexture& t : resolve_.textures) {
    textures_.push_back(Ogre::TextureManager::getSingleton().createManual(
        t.sampler, Ogre::RGN_DEFAULT, kShapes[static_cast<std::size_t>(t.shape)], t.size.x, t.size.y, t.size.z, 0,
        format(t), t.isLight ? Ogre::TU_DYNAMIC_WRITE_ONLY : Ogre::TU_STATIC_WRITE_ONLY));
    bytes = std::max(bytes, t.bytes);
  }
  texels_.resize(bytes);
}

relume::Status RelumeLight::write(std::size_t i) {
  const relume::ResolveTexture& t = resolve_.textures[i];
  relume::Status written = relighter_.writeResolveTexture(i, std::span(texels_).first(t.bytes));
  if (!written) return written;
  textures_[i]->getBuffer()->blitFromMemory(Ogre::PixelBox(t.size.x, t.size.y, t.size.z, format(t), texels_.data()));
  return relume::done();
}

void RelumeLight::addTo(Ogre::Pass& pass) const {
  const Ogre::GpuProgramParametersSharedPtr parameters = pass.getFragmentProgramParameters();
  for (std::size_t i = 0; i < textures_.size(); ++i) {
    parameters->setNamedConstant(resolve_.textures[i].sampler, static_cast<int>(pass.getNumTextureUnitStates()));
    Ogre::TextureUnitState* const unit = pass.createTextureUnitState();
    unit->setTexture(textures_[i]);
    unit->setTextureAddressingMode(Ogre::TAM_CLAMP);
    unit->setTextureFiltering(resolve_.textures[i].isFiltered ? Ogre::TFO_BILINEAR : Ogre::TFO_NONE);
  }
  parameters->setNamedConstant("relumeGrid", &resolve_.grid[0].x, resolve_.grid.size(), 4);
}

void RelumeLight::addSurfels(const relume::Bake& bake, Ogre::SceneManager& scene, Ogre::Camera& camera,
                             const std::string& material, Ogre::uint32 visibilityFlag) {
  const std::uint32_t count = bake.surfels.count(), rows = (count + kRow - 1) / kRow;
  irradiance_.resize(count);
  readBack_.resize(static_cast<std::size_t>(kRow) * rows);
  Ogre::ManualObject* const points = scene.createManualObject();
  points->estimateVertexCount(count);
  points->begin(material, Ogre::RenderOperation::OT_POINT_LIST);
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::vec3 p = bake.surfels.positionWorld[i], n = bake.surfels.normal[i];
    points->position(p.x, p.y, p.z);
    points->normal(n.x, n.y, n.z);
    points->textureCoord((2.0f * static_cast<float>(i % kRow) + 1.0f) / kRow - 1.0f,
                         (2.0f * static_cast<float>(i / kRow) + 1.0f) / static_cast<float>(rows) - 1.0f);
  }
  points->end();
  points->setBoundingBox(Ogre::AxisAlignedBox::BOX_INFINITE);
  points->setCastShadows(false);
  points->setVisibilityFlags(visibilityFlag);
  scene.getRootSceneNode()->attachObject(points);

  target_ =
      Ogre::TextureManager::getSingleton().createManual("relumeSurfels", Ogre::RGN_DEFAULT, Ogre::TEX_TYPE_2D, kRow,
                                                        rows, 0, Ogre::PF_FLOAT32_RGBA, Ogre::TU_RENDERTARGET);
  Ogre::RenderTarget* const target = target_->getBuffer()->getRenderTarget();
  target->setAutoUpdated(false);
  Ogre::Viewport* const viewport = target->addViewport(&camera);
  viewport->setVisibilityMask(visibilityFlag);
  viewport->setShadowsEnabled(false);  // those of the frame are there already, and stay bound
  viewport->setOverlaysEnabled(false);
  viewport->setBackgroundColour(Ogre::ColourValue::ZERO);
}

relume::Status RelumeLight::update() {
  // OGRE's own lights and shadows, one point a surfel
  target_->getBuffer()->getRenderTarget()->update();
  target_->getBuffer()->blitToMemory(
      Ogre::PixelBox(target_->getWidth(), target_->getHeight(), 1, Ogre::PF_FLOAT32_RGBA, readBack_.data()));
  std::copy_n(readBack_.begin(), irradiance_.size(), irradiance_.begin());

  relume::LightSetup setup;
  setup.surfelIrradiance = irradiance_;
  if (relume::Status lit = relighter_.relight(setup); !lit) return lit;
  for (std::size_t i = 0; i < textures_.size(); ++i) {
    if (!resolve_.textures[i].isLight) continue;
    if (relume::Status written = write(i); !written) return written;
  }
  return relume::done();
}
