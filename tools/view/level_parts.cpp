// SPDX-License-Identifier: MIT
// See level_parts.h.
#include "tools/view/level_parts.h"

#include "tools/render/moving_parts.h"

#include <algorithm>
#include <utility>

namespace relume {
namespace {

// Materials of what moves that emit, or may.
std::vector<std::uint32_t> movingEmitters(const LoadedLevel& level) {
  std::vector<std::uint32_t> emitters;
  for (const Instance& instance : level.scene.instances) {
    const std::uint32_t m = level.scene.meshes[instance.mesh].material;
    if (instance.baked() || m == kNone || !isDrivable(level.materials[m])) continue;
    if (std::ranges::find(emitters, m) == emitters.end()) emitters.push_back(m);
  }
  return emitters;
}

// What moves of a level, with what its colours are read from.
Scene movingScene(const LoadedLevel& level) {
  const Scene& scene = level.scene;
  Scene moving;
  moving.materials = level.materials;
  moving.meshes.resize(scene.meshes.size());
  moving.images.resize(scene.images.size());
  const auto take = [&](const TextureRef& texture) {
    if (texture.image != kNone && moving.images[texture.image].levels.empty())
      moving.images[texture.image] = scene.images[texture.image];
  };
  for (const Instance& instance : scene.instances) {
    if (instance.baked()) continue;
    moving.instances.push_back(instance);
    Mesh& mesh = moving.meshes[instance.mesh];
    if (mesh.triangle.empty()) mesh = scene.meshes[instance.mesh];
    if (mesh.material == kNone) continue;
    for (const auto* materials : {&level.materials, &scene.materials}) {
      take((*materials)[mesh.material].albedoTexture);
      take((*materials)[mesh.material].emissionTexture);
    }
  }
  return moving;
}

}  // namespace

Result<LevelParts> LevelParts::create(const LoadedLevel& level, const ViewState& state) {
  LevelParts parts;
  parts.level_ = &level;
  std::vector<MovingPart> home = movingParts(level.scene);
  if (home.empty() || home.size() > kMaxMovingParts) return parts;
  parts.nodes_ = movingNodes(level.scene);
  parts.emitters_ = movingEmitters(level);
  if (!parts.emitters_.empty()) parts.scene_ = movingScene(level);
  parts.home_ = home;
  parts.parts_ = std::move(home);
  if (Status ok = parts.emit(state); !ok) return ok.error();
  return parts;
}

Status LevelParts::emit(const ViewState& state) {
  emissionScale_ = state.emission;
  if (parts_.empty()) return done();
  const bool isDriven = std::ranges::any_of(emitters_, [&](std::uint32_t m) {
    return std::ranges::any_of(
        state.emitters, [&](const ViewedEmitter& e) { return e.isDriven && e.name == level_->materials[m].name; });
  });
  // The scale is of the bake's emitters as well: what is not to be scaled by it is divided.
  if (isDriven && emissionScale_ == 0.0f) emissionScale_ = 1.0f;
  bool isNew = !shapes_;
  for (const std::uint32_t m : emitters_) {
    const Material& own = level_->materials[m];
    ShownEmission emission{own.emission, own.emissionTexture};
    if (isDriven) {
      emission = shownEmission(*level_, state, m);
      emission.radiance /= emissionScale_;
    }
    Material& material = scene_.materials[m];
    isNew = isNew || material.emission != emission.radiance || material.emissionTexture.image != emission.texture.image;
    material.emission = emission.radiance;
    material.emissionTexture = emission.texture;
  }
  if (!isNew) return done();
  auto shapes = movingShapes(emitters_.empty() ? level_->scene : scene_);
  if (!shapes) return shapes.error();
  shapes_.emplace(std::move(*shapes));
  return done();
}

void LevelParts::place(std::span<const glm::mat4> moved) {
  std::size_t part = 0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    for (std::uint32_t i = 0; i < nodes_[k].instanceCount; ++i, ++part)
      parts_[part].toWorld = glm::mat4x3(moved[k] * glm::mat4(home_[part].toWorld));
  }
}

void LevelParts::addTo(LightSetup& setup) const {
  setup.movingShapes = shapes_ ? &*shapes_ : nullptr;
  setup.movingParts = parts_;
  setup.emissionScale = glm::vec3(emissionScale_);
}

}  // namespace relume
