// SPDX-License-Identifier: MIT
// The light of a view without a bake: a level's voxels, and caches that gather from them (runtime/live/live_light.h).
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/result.h"
#include "runtime/live/live_light.h"
#include "runtime/voxels/voxel_volume.h"
#include "tools/render/render_frame.h"

#include <optional>

namespace relume {

struct LiveView {
  VoxelVolume volume;
  LiveLight all;
  std::optional<LiveLight> straight;  // of unreflected emission and sky, where `bounced` or `unbounced` is wanted
  int frames = 0;
};

// A level's volume with so many cells on its longest side. Errors of VoxelScene and VoxelVolume.
Result<VoxelVolume> voxeliseScene(const Scene& scene, std::uint32_t cells, const ParallelFor& parallelFor,
                                  Context& context);

// Light it until bounces and rays have converged, or for as many bounces as are asked for; `tracer` casts the shadows
// of the punctual lights. [request.live holds]
Result<LiveView> lightLive(const RayTracer& tracer, const RenderRequest& request, Context& context);

}  // namespace relume
