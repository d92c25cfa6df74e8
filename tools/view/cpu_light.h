// SPDX-License-Identifier: MIT
// Light over links by the CPU backend, drawn by OpenGL: relights on the processor's cores, with shadows by rays, and
// puts what the caches hold where the GL backend keeps its own (GlResolveInputs). Dynamic objects cast shadows from
// where they are.
#pragma once

#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "runtime/shared/bands.h"
#include "tools/base/worker_threads.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/render/ray_shadows.h"

#include <glm/mat4x4.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace relume {

class CpuLight {
 public:
  // `like`: the GL relighter of the same bake that draws, whose bands it has; `previous`: whose light it begins with,
  // null = none; `options`: its images, and how many parts move. Errors of Relighter and RayTracer. Scene and bake must
  // outlive it.
  static Result<CpuLight> create(const Scene& scene, const Bake& bake, const Relighter& like, const Relighter* previous,
                                 RelightOptions options, Movable movable = Movable::dynamic);

  // Relighter::relight(), the visibility of the setup being its own. moved[k] comes after the own transforms of
  // movingNodes()[k], of those that create() was told. Errors of RayTracer as well. [Size moved: movingNodes()]
  Status relight(LightSetup setup, std::span<const glm::mat4> moved);
  // Put its light into what `inputs` names, of the relighter that it was made like: what is drawn by; and that of the
  // nodes, for voxels.
  void upload(const GlResolveInputs& inputs) const;
  void uploadNodes(const GlResolveInputs& inputs) const;
  Relighter& relighter() { return relighter_; }
  const Relighter& relighter() const { return relighter_; }

 private:
  CpuLight(const Scene& scene, const Bake& bake, Movable movable, RayShadows shadows,
           std::unique_ptr<WorkerThreads> threads, Relighter relighter);
  Status place(std::span<const glm::mat4> moved);

  const Scene* scene_;
  const Bake* bake_;
  std::vector<MovingNode> nodes_;
  std::vector<glm::mat4> moved_;  // as they were last placed [Size nodes_]
  RayShadows shadows_;
  std::unique_ptr<WorkerThreads> threads_;
  Relighter relighter_;
};

}  // namespace relume
