// SPDX-License-Identifier: MIT
// Light over links by the CPU backend, drawn by OpenGL: relights on the processor's cores, with shadows by rays, and
// puts what the caches hold where the GL backend keeps its own (GlResolveInputs). Dynamic objects cast shadows from
// where the level has them.
#pragma once

#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "runtime/shared/bands.h"
#include "tools/base/worker_threads.h"
#include "tools/render/ray_shadows.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace relume {

class CpuLight {
 public:
  // `like`: the GL relighter of the same bake that draws, whose bands it has; `previous`: whose light it begins with,
  // null = none; `options`: its images. Errors of Relighter and RayTracer. Scene and bake must outlive it.
  static Result<CpuLight> create(const Scene& scene, const Bake& bake, const Relighter& like, const Relighter* previous,
                                 RelightOptions options);

  // Relighter::relight(), the setup's visibility being its own.
  Status relight(LightSetup setup);
  // Put its light into what `inputs` names, of the relighter that it was made like.
  void upload(const GlResolveInputs& inputs) const;
  Relighter& relighter() { return relighter_; }
  const Relighter& relighter() const { return relighter_; }

 private:
  CpuLight(const Bake& bake, RayShadows shadows, std::unique_ptr<WorkerThreads> threads, Relighter relighter)
      : bake_(&bake), shadows_(std::move(shadows)), threads_(std::move(threads)), relighter_(std::move(relighter)) {}

  const Bake* bake_;
  RayShadows shadows_;
  std::unique_ptr<WorkerThreads> threads_;
  Relighter relighter_;
};

}  // namespace relume
