// SPDX-License-Identifier: MIT
// Shadows of punctual lights by a ray each: the CPU backend's visibility.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/lights.h"

#include <glm/mat4x4.hpp>

#include <memory>
#include <span>

namespace relume {

// Share of a light that reaches a point: one shadow ray, started off the surface. None once the work is cancelled. What
// it is given must outlive it.
Visibility rayVisibility(const RayTracer& tracer, std::span<const Light> lights, const Context& context);

// Light that two visibilities let through, one after the other.
Visibility throughBoth(Visibility first, Visibility second);

// A copy of a level for rays alone: its geometry, and the images whose alpha lets them through.
std::unique_ptr<Scene> shadowScene(const Scene& scene);
// Put an instance elsewhere.
void place(Instance& instance, const glm::mat4& toWorld);

// A tracer of a level for tools that trace nothing else.
class RayShadows {
 public:
  // Dynamic instances stand where the level has them. Errors of RayTracer. The scene must outlive it.
  static Result<RayShadows> create(const Scene& scene);
  // Instances stand there from now on. Costs as many triangles as those have that are dynamic or have ever been moved,
  // and the level's where a further static one is. Errors of RayTracer: nothing has moved. [Size toWorld: the scene's
  // instances]
  Status place(std::span<const glm::mat4> toWorld);
  // Until the next place().
  Visibility visibility(std::span<const Light> lights) const;

 private:
  RayShadows(const Scene& level, RayTracer standing, std::unique_ptr<Context> context)
      : level_(&level), standing_(std::make_unique<RayTracer>(std::move(standing))), context_(std::move(context)) {}
  Status lift(std::span<const glm::mat4> toWorld);

  const Scene* level_;
  std::unique_ptr<Scene> others_;        // what stands, once something that stood has been moved
  std::unique_ptr<RayTracer> standing_;  // what is baked and has not been moved
  std::unique_ptr<Scene> scene_;         // of all others; null: there are none
  std::unique_ptr<RayTracer> moving_;    // those
  std::unique_ptr<Context> context_;
};

}  // namespace relume
