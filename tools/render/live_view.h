// SPDX-License-Identifier: MIT
// The light of a view by voxels: without a bake, caches that gather from them (runtime/live/nested_caches.h); with one,
// voxels that send out what its surfels do (runtime/cones/surfel_voxels.h).
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/result.h"
#include "runtime/cones/nested_cones.h"
#include "runtime/cones/rsm_voxels.h"
#include "runtime/live/nested_caches.h"
#include "runtime/live/rsm_light.h"
#include "runtime/voxels/nested_volumes.h"
#include "tools/render/render_frame.h"

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// Lit voxels, for cones.
struct VoxelView {
  NestedVolumes volumes;
  NestedMips mips{};                  // empty until it is updated
  std::optional<RsmVoxels> byMaps{};  // where reflective shadow maps light the voxels
  glm::vec3 skyRadiance{0.0f};
  std::vector<glm::vec3> skyMap{};  // octahedral; empty = skyRadiance from everywhere

  VoxelVolume& volume() { return volumes.outermost(); }
  const VoxelVolume& volume() const { return volumes.outermost(); }
  LiveSky sky() const;
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;
};

// Irradiance [W/m²], and the part of it that comes unreflected from emission and sky.
struct LiveIrradiance {
  glm::vec3 all{0.0f}, straight{0.0f};
};

struct LiveView {
  VoxelView voxels;
  std::optional<NestedCaches> all{};       // one of this and `rsm`; neither where no light is wanted
  std::optional<NestedCaches> straight{};  // of unreflected emission and sky, where `bounced` or `unbounced` is wanted
  std::optional<RsmLight> rsm{};
  int frames = 0;

  // At a receiver with unit normal.
  LiveIrradiance irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const;
  std::string name() const;                 // of the light
  std::vector<PassTime> passTimes() const;  // the voxels' too
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;
};

inline constexpr std::uint32_t kLiveSkySide = 32;  // [texel]
// An octahedral map of a sky, a texel the mean of a few directions; empty where the sky is constant. [Size 0 or side²]
std::vector<glm::vec3> liveSkyMap(const Sky& sky);

// A level's volumes, or a box's, in one another about the eye, the outermost with so many cells on its longest side.
// Errors of VoxelScene and NestedVolumes.
struct SceneVolumes {
  std::uint32_t cells = 32, cascades = 1;
  std::optional<glm::vec3> eyeWorld{};
  std::optional<SceneBounds> box{};  // empty = livePartOf() the scene, or all of it
  bool roams = false;                // the box: more of the level lies beyond it
};
Result<NestedVolumes> voxeliseScene(const Scene& scene, const SceneVolumes& wanted, const ParallelFor& parallelFor,
                                    Context& context);

// The voxels of a request, without light. [request.live holds]
Result<VoxelView> darkVoxels(const Scene& scene, const RenderRequest& request, Context& context);

// Light it until bounces and rays have converged, or for as many bounces as are asked for (by maps: 12 where they are
// not counted). `tracer` casts the shadows of the punctual lights; scene: what light goes through, null = the tracer's.
// [request.live holds]
Result<LiveView> lightLive(const RayTracer& tracer, const RenderRequest& request, Context& context,
                           const Scene* scene = nullptr);

// A level's voxels lit by its relit bake. [request.live and request.bake hold]
Result<VoxelView> lightByBake(const RayTracer& tracer, const RenderRequest& request, const Relighter& relighter,
                              Context& context);

}  // namespace relume
