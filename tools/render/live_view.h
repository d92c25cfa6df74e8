// SPDX-License-Identifier: MIT
// The light of a view without a bake: a level's voxels, and caches that gather from them (runtime/live/live_light.h).
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/result.h"
#include "runtime/live/live_light.h"
#include "runtime/live/rsm_light.h"
#include "runtime/voxels/voxel_volume.h"
#include "tools/render/render_frame.h"

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// Irradiance [W/m²], and the part of it that comes unreflected from emission and sky.
struct LiveIrradiance {
  glm::vec3 all{0.0f}, straight{0.0f};
};

struct LiveView {
  VoxelVolume volume;
  std::optional<LiveLight> all;       // one of this and `rsm`
  std::optional<LiveLight> straight;  // of unreflected emission and sky, where `bounced` or `unbounced` is wanted
  std::optional<RsmLight> rsm;
  int frames = 0;

  // At a receiver with unit normal.
  LiveIrradiance irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const;
  std::string name() const;  // of the light
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;
};

// A level's volume with so many cells on its longest side. Errors of VoxelScene and VoxelVolume.
Result<VoxelVolume> voxeliseScene(const Scene& scene, std::uint32_t cells, const ParallelFor& parallelFor,
                                  Context& context);

// Light it until bounces and rays have converged, or for as many bounces as are asked for (by maps: 12 where they are
// not counted); `tracer` casts the shadows of the punctual lights. [request.live holds]
Result<LiveView> lightLive(const RayTracer& tracer, const RenderRequest& request, Context& context);

}  // namespace relume
