// SPDX-License-Identifier: MIT
// See ray_shadows.h.
#include "tools/render/ray_shadows.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <utility>
#include <vector>

namespace relume {

Visibility rayVisibility(const RayTracer& tracer, std::span<const Light> lights, const Context& context) {
  return [&tracer, lights, &context](std::uint32_t index, const glm::vec3& position, const glm::vec3& normal) {
    if (context.cancelled()) return 0.0f;
    const Light& light = lights[index];
    const float epsilon = tracer.epsilonAt(position);
    Ray ray;
    ray.origin = position + normal * epsilon;
    if (light.kind == LightKind::directional) {
      ray.direction = -light.direction;
    } else {
      const glm::vec3 toLight = light.positionWorld - ray.origin;
      const float distance = glm::length(toLight);
      if (!(distance > 0.0f)) return 1.0f;
      ray.direction = toLight / distance;
      ray.tMax = distance;
    }
    return tracer.occluded(ray) ? 0.0f : 1.0f;
  };
}

Visibility throughBoth(Visibility first, Visibility second) {
  return [first = std::move(first), second = std::move(second)](std::uint32_t light, const glm::vec3& position,
                                                                const glm::vec3& normal) {
    const float seen = first(light, position, normal);
    return seen > 0.0f ? seen * second(light, position, normal) : 0.0f;
  };
}

std::unique_ptr<Scene> shadowScene(const Scene& scene) {
  auto copy = std::make_unique<Scene>();
  copy->meshes = scene.meshes;
  copy->instances = scene.instances;
  copy->materials = scene.materials;
  copy->solid = scene.solid;
  copy->images.resize(scene.images.size());
  for (const Material& material : scene.materials) {
    const std::uint32_t image = material.albedoTexture.image;
    if (material.alphaMode == AlphaMode::mask && image < scene.images.size()) copy->images[image] = scene.images[image];
  }
  return copy;
}

void place(Instance& instance, const glm::mat4& toWorld) {
  instance.toWorld = toWorld;
  instance.flipped = glm::determinant(glm::mat3(toWorld)) < 0.0f;
}

Result<RayShadows> RayShadows::create(const Scene& scene) {
  auto context = std::make_unique<Context>();
  auto standing = RayTracer::create(scene, "", *context, RayStructure::thorough, RayGeometry::fixed);
  if (!standing) return standing.error();
  RayShadows shadows(scene, std::move(*standing), std::move(context));
  if (std::none_of(scene.instances.begin(), scene.instances.end(),
                   [](const Instance& each) { return each.mode == BakeMode::dynamic; }))
    return shadows;
  shadows.scene_ = shadowScene(scene);
  std::vector<glm::mat4> home;
  for (Instance& instance : shadows.scene_->instances) {
    home.push_back(instance.toWorld);
    if (instance.mode != BakeMode::dynamic) instance.mode = BakeMode::ignore;
  }
  if (Status ok = shadows.place(home); !ok) return ok.error();
  return shadows;
}

// Static instances that are no longer where the level has them are traced with what moves, for good.
Status RayShadows::lift(std::span<const glm::mat4> toWorld) {
  std::vector<std::size_t> lifted;
  for (std::size_t i = 0; i < toWorld.size(); ++i) {
    const bool stands = level_->instances[i].baked() && (!scene_ || scene_->instances[i].mode == BakeMode::ignore);
    if (stands && toWorld[i] != level_->instances[i].toWorld) lifted.push_back(i);
  }
  if (lifted.empty()) return done();
  auto others = shadowScene(*level_), moving = shadowScene(*level_);
  for (std::size_t i = 0; i < others->instances.size(); ++i) {
    const bool moves = scene_ && scene_->instances[i].mode != BakeMode::ignore;
    const bool isLifted = moves || std::find(lifted.begin(), lifted.end(), i) != lifted.end();
    (isLifted ? others : moving)->instances[i].mode = BakeMode::ignore;
  }
  auto standing = RayTracer::create(*others, "", *context_, RayStructure::shadows, RayGeometry::fixed);
  if (!standing) return standing.error();
  standing_ = std::make_unique<RayTracer>(std::move(*standing));
  others_ = std::move(others);
  moving_.reset();
  scene_ = std::move(moving);
  return done();
}

Status RayShadows::place(std::span<const glm::mat4> toWorld) {
  if (Status ok = lift(toWorld); !ok) return ok;
  if (!scene_) return done();
  const std::vector<Instance> before = scene_->instances;
  for (std::size_t i = 0; i < scene_->instances.size(); ++i) {
    if (scene_->instances[i].mode != BakeMode::ignore) relume::place(scene_->instances[i], toWorld[i]);
  }
  auto moving = RayTracer::create(*scene_, "", *context_, RayStructure::shadows, RayGeometry::drawn);
  if (!moving) {
    scene_->instances = before;
    return moving.error();
  }
  moving_ = std::make_unique<RayTracer>(std::move(*moving));
  return done();
}

Visibility RayShadows::visibility(std::span<const Light> lights) const {
  Visibility standing = rayVisibility(*standing_, lights, *context_);
  return moving_ ? throughBoth(std::move(standing), rayVisibility(*moving_, lights, *context_)) : standing;
}

}  // namespace relume
