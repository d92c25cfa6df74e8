// SPDX-License-Identifier: MIT
// Shadows of punctual lights by a ray each: the CPU backend's visibility.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/lights.h"

#include <memory>
#include <span>

namespace relume {

// Share of a light that reaches a point: one shadow ray, started off the surface. None once the work is cancelled. What
// it is given must outlive it.
Visibility rayVisibility(const RayTracer& tracer, std::span<const Light> lights, const Context& context);

// A tracer of a level for tools that trace nothing else. Dynamic instances stand where the level has them.
class RayShadows {
 public:
  // Errors of RayTracer. The scene must outlive it.
  static Result<RayShadows> create(const Scene& scene);
  Visibility visibility(std::span<const Light> lights) const { return rayVisibility(*tracer_, lights, *context_); }

 private:
  RayShadows(std::unique_ptr<RayTracer> tracer, std::unique_ptr<Context> context)
      : tracer_(std::move(tracer)), context_(std::move(context)) {}
  std::unique_ptr<RayTracer> tracer_;
  std::unique_ptr<Context> context_;
};

}  // namespace relume
