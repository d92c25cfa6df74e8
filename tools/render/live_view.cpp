// SPDX-License-Identifier: MIT
// See live_view.h.
#include "tools/render/live_view.h"

#include "bake/base/memory_budget.h"
#include "bake/base/parallel.h"
#include "bake/base/printed.h"
#include "bake/rays/seen_surface.h"
#include "formats/octahedron.h"
#include "runtime/cones/rsm_voxels.h"
#include "runtime/cones/surfel_voxels.h"
#include "tools/render/context_threads.h"
#include "tools/render/converge_live.h"
#include "tools/render/ray_shadows.h"
#include "tools/render/rsm_maps.h"
#include "tools/render/scene_bounds.h"
#include "tools/render/voxel_scene.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace relume {
namespace {

constexpr int kBouncesOfMaps = 12;         // where they are not counted
constexpr std::uint32_t kCellsSide = 256;  // [texel] of a map that lights cells alone
constexpr double kDepthPixels = 1e6;       // at least, of the picture whose depths tell which cells are seen
constexpr std::uint32_t kSkySamples = 4;   // along a texel's side

// One receiver a pixel, as a frame of a game reads: their time is a pass of its own.
void resolvePixels(const RayTracer& tracer, const RenderRequest& request, RsmLight& light, Context& context) {
  const CameraRays rays(request.camera, request.width, request.height);
  std::vector<glm::vec3> position(std::size_t{request.width} * request.height), normal = position, light3 = position;
  parallelChunks(context, "", request.height, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin * request.width; p < end * request.width; ++p) {
      Ray ray;
      rays.at(static_cast<float>(p % request.width) + 0.5f, static_cast<float>(p / request.width) + 0.5f, ray.origin,
              ray.direction);
      const Hit hit = tracer.trace(ray);
      if (!hit) continue;
      const SeenSurface seen = seenAt(tracer.scene(), ray, hit);
      position[p] = seen.positionWorld;
      normal[p] = seen.normal;
    }
  });
  light.resolve(position, normal, light3);
}

glm::vec3 emissionScaleOf(const RenderRequest& request) { return glm::vec3(request.drawsEmission() ? 1.0f : 0.0f); }

// By reflective shadow maps: frames of other samples, averaged.
Result<LiveView> lightByMaps(const RayTracer& tracer, const RenderRequest& request, VoxelView voxels,
                             Context& context) {
  const RsmRequest& rsm = *request.live->rsm;
  if (request.drawsEmission() || !request.sky.isDark())
    context.message(
        Severity::warning,
        "light by reflective shadow maps is of punctual lights: emitting surfaces and the sky send none, but "
        "to what is mirrored");
  RsmOptions options = rsm.options;
  options.bounces = request.bounces > 0 ? request.bounces : kBouncesOfMaps;
  auto light = RsmLight::create(options);
  if (!light) return light.error();
  LiveView view{std::move(voxels)};
  view.rsm.emplace(std::move(*light));

  std::vector<RsmMap> maps;
  const bool lightsVoxels = request.drawsCones() || request.voxels;
  const std::uint32_t side = rsm.side > 0 ? rsm.side : lightsVoxels ? kRsmVoxelsSide : kCellsSide;
  for (const SceneLight& l : request.lights) maps.push_back(renderRsm(tracer, l, side, context));
  std::vector<RsmImage> images;
  for (const RsmMap& map : maps) images.push_back(map.image());
  DepthPicture seen;
  RsmFrame frame;
  if (options.occupancy == CellOccupancy::depth) {
    const auto scale = static_cast<std::uint32_t>(
        std::ceil(std::sqrt(kDepthPixels / (static_cast<double>(request.width) * request.height))));
    const std::uint32_t wide = std::max(scale, 1u);
    seen = renderDepth(tracer, request.camera, wide * request.width, wide * request.height, context);
    frame.depth = &seen.view;
  }
  frame.images = images;
  frame.averagedFrames = static_cast<float>(rsm.frames);
  frame.presence = rsm.presence;
  frame.bleeding = rsm.bleeding;
  frame.averageAlbedo = averageAlbedoOf(view.voxels.volume());
  for (std::uint32_t f = 0; f < rsm.frames && !context.cancelled(); ++f) {
    frame.sampleSet = f;
    frame.keep = static_cast<float>(f) / static_cast<float>(f + 1);
    if (Status ok = view.rsm->update(view.voxels.volume(), frame); !ok) return ok.error();
    ++view.frames;
  }
  resolvePixels(tracer, request, *view.rsm, context);
  if (lightsVoxels && !context.cancelled()) {
    view.voxels.byMaps.emplace();
    if (Status ok = view.voxels.byMaps->light(view.voxels.volume(), images, emissionScaleOf(request)); !ok)
      return ok.error();
  }
  return view;
}

}  // namespace

std::vector<glm::vec3> liveSkyMap(const Sky& sky) {
  std::vector<glm::vec3> map;
  if (sky.isConstant()) return map;
  map.reserve(std::size_t{kLiveSkySide} * kLiveSkySide);
  constexpr float kStep = 2.0f / static_cast<float>(kLiveSkySide * kSkySamples);
  for (std::uint32_t t = 0; t < kLiveSkySide * kLiveSkySide; ++t) {
    glm::vec3 sum(0.0f);
    for (std::uint32_t s = 0; s < kSkySamples * kSkySamples; ++s) {
      const glm::vec2 at(static_cast<float>(t % kLiveSkySide * kSkySamples + s % kSkySamples),
                         static_cast<float>(t / kLiveSkySide * kSkySamples + s / kSkySamples));
      sum += sky.along(fromOctahedron((at + 0.5f) * kStep - 1.0f));
    }
    map.push_back(sum / static_cast<float>(kSkySamples * kSkySamples));
  }
  return map;
}

LiveSky VoxelView::sky() const { return {skyRadiance, skyMap, skyMap.empty() ? 0 : kLiveSkySide}; }

LiveIrradiance LiveView::irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const {
  LiveIrradiance light;
  if (rsm) {
    light.all = rsm->irradiance(positionWorld, normal);
    return light;
  }
  if (!all) return light;
  const NestedStencil stencil = all->stencil(positionWorld, normal);
  light.all = all->irradianceBy(stencil, normal);
  if (straight) light.straight = straight->irradianceBy(stencil, normal);
  return light;
}

std::string LiveView::name() const {
  return rsm ? "live light by reflective shadow maps" : all ? "live light" : "voxels without light";
}

std::vector<PassTime> VoxelView::passTimes() const {
  std::vector<PassTime> times = volumes.passTimes();
  if (byMaps) {
    for (const PassTime& pass : byMaps->passTimes()) times.push_back(pass);
  }
  if (mips.empty()) return times;
  for (const PassTime& pass : mips.passTimes()) times.push_back(pass);
  return times;
}

std::vector<std::pair<std::string, std::size_t>> VoxelView::bufferSizes() const {
  auto sizes = volumes.bufferSizes();
  if (byMaps) sizes.emplace_back("flux of sides", byMaps->sizeBytes());
  if (!mips.empty()) sizes.emplace_back("mips", mips.sizeBytes());
  return sizes;
}

std::vector<PassTime> LiveView::passTimes() const {
  std::vector<PassTime> times = voxels.passTimes();
  if (rsm || all) {
    for (const PassTime& pass : rsm ? rsm->passTimes() : all->passTimes()) times.push_back(pass);
  }
  return times;
}

std::vector<std::pair<std::string, std::size_t>> LiveView::bufferSizes() const {
  auto sizes = voxels.bufferSizes();
  if (rsm || all) {
    for (const auto& buffer : rsm ? rsm->bufferSizes() : all->bufferSizes()) sizes.push_back(buffer);
  }
  return sizes;
}

namespace {

// Pieces, the triangles that they are cut into, and the sides of the voxels that they overlap: as many as the area has
// room for, and a few of each triangle. Volumes are found one after the other, and what is summed is of one at a time.
Status reserveVoxels(const Scene& scene, const SceneBounds& box, float voxel, std::uint32_t cascades,
                     Context& context) {
  constexpr double kPieceBytes = 84.0 + 10.0,
                   kTriangleBytes = 2 * 32.0;  // handed over and kept; found, and put together
  constexpr double kKeptBytes = 2 * 48.0, kSummedBytes = 2 * 256.0, kVoxels = 2.0;  // of a voxel
  double triangles = 0.0, area = 0.0;
  for (const Instance& instance : scene.instances) {
    const auto count = static_cast<std::uint32_t>(scene.meshes[instance.mesh].triangle.size());
    triangles += count;
    for (std::uint32_t t = 0; t < count; ++t) {
      const auto corner = scene.corners(instance, t);
      const double within = areaWithin(box, corner);
      if (std::isfinite(within)) area += within;
    }
  }
  const double faces = area / (static_cast<double>(voxel) * static_cast<double>(voxel)), pieces = triangles + faces;
  const double bytes = pieces * (kPieceBytes + kTriangleBytes) +
                       kVoxels * faces * (static_cast<double>(cascades) * kKeptBytes + kSummedBytes);
  return reserveMemory(context, "voxels", bytes, std::to_string(static_cast<std::uint64_t>(pieces)) + " pieces",
                       "use fewer cells");
}

// The name of the part that lies farthest from the middle one, along each axis by itself.
std::string farthestPart(const Scene& scene) {
  std::vector<glm::vec3> centre;
  for (const Instance& instance : scene.instances) {
    const SceneBounds box = boundsOf(scene, instance);
    centre.push_back(0.5f * box.min + 0.5f * box.max);
  }
  glm::vec3 middle(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float> along;
    for (const glm::vec3& c : centre) along.push_back(c[axis]);
    const auto half = along.begin() + static_cast<std::ptrdiff_t>(along.size() / 2);
    std::nth_element(along.begin(), half, along.end());
    middle[axis] = *half;
  }
  const auto farthest = std::max_element(centre.begin(), centre.end(), [&](const glm::vec3& a, const glm::vec3& b) {
    return glm::distance(a, middle) < glm::distance(b, middle);
  });
  return scene.instances[static_cast<std::size_t>(farthest - centre.begin())].node;
}

// A level in one piece fills a row of voxels along its longest side at least. Where all surfaces fill fewer, parts are
// far from all else, and rooms are not much larger than a cell.
void warnOfFarParts(const Scene& scene, const SceneBounds& bounds, const NestedVolumes& volumes, Context& context) {
  const VolumeGrid& grid = volumes.outermost().grid();
  const float side = longestSide(bounds);
  const std::uint32_t occupied = volumes.outermost().stats().occupied;
  if (scene.instances.size() < 2 || !(static_cast<float>(occupied) < std::floor(side / grid.voxel))) return;
  context.message(Severity::warning,
                  printed("light without a bake is coarse or missing: the level is %.4g m long, its cells are %.4g m, "
                          "and all that is drawn lies in %u of their voxels, for node \"%s\" is far from the rest; "
                          "move it or leave it out, or give the level a play volume (extras.relume.volume)",
                          static_cast<double>(side), static_cast<double>(grid.cell()), static_cast<unsigned>(occupied),
                          farthestPart(scene).c_str()));
}

}  // namespace

Result<NestedVolumes> voxeliseScene(const Scene& scene, const SceneVolumes& wanted, const ParallelFor& parallelFor,
                                    Context& context) {
  const std::optional<SceneBounds> part = wanted.box ? wanted.box : livePartOf(scene);
  const SceneBounds bounds = part ? *part : boundsOf(scene);
  NestedOptions options;
  options.outermost.margin = kLitMargin;
  options.outermost.boxMin = bounds.min;
  options.outermost.boxMax = bounds.max;
  options.outermost.roams = part && (!wanted.box || wanted.roams);  // what lies beyond is lit by the sky alone
  options.outermost.cells = wanted.cells;
  options.outermost.parallelFor = parallelFor;
  options.cascades = wanted.cascades;
  options.eyeWorld = wanted.eyeWorld;
  constexpr float kVoxels = 2.0f;  // of a piece's longest edge, of the outermost volume alone: it is most of the memory
  const float voxel = fitGrid(bounds.min, bounds.max, wanted.cells, kLitMargin).voxel;
  if (Status ok = reserveVoxels(scene, bounds, voxel, wanted.cascades, context); !ok) return ok.error();
  const auto pieces = VoxelScene::create(scene, kVoxels * voxel, context, part ? &bounds : nullptr);
  if (!pieces) return pieces.error();
  auto volumes = NestedVolumes::create(pieces->geometry(), options);
  if (volumes && !options.outermost.roams) warnOfFarParts(scene, bounds, *volumes, context);
  if (volumes && volumes->stats().dropped > 0)
    context.message(Severity::warning, std::to_string(volumes->stats().dropped) + " of " +
                                           std::to_string(volumes->stats().occupied) +
                                           " voxels are beyond the budget and reflect nothing; use fewer cells");
  return volumes;
}

Result<VoxelView> darkVoxels(const Scene& scene, const RenderRequest& request, Context& context) {
  const SceneVolumes wanted{request.live->cells, request.live->cascades, CameraRays(request.camera, 1, 1).origin,
                            request.live->box, request.live->roams};
  auto volumes = voxeliseScene(scene, wanted, contextParallelFor(context), context);
  if (!volumes) return volumes.error();
  VoxelView view{std::move(*volumes), NestedMips(request.live->directions)};
  view.skyRadiance = request.sky.radiance;
  view.skyMap = liveSkyMap(request.sky);
  return view;
}

namespace {

template <class Volume>
Status lightDirectly(const RayTracer& tracer, const RenderRequest& request, Volume& volume, Context& context) {
  const std::vector<Light> lights = toRuntimeLights(request.lights);
  LightSetup setup;
  setup.lights = lights;
  setup.visibility = rayVisibility(tracer, lights, context);
  return volume.lightDirectly(setup);
}

}  // namespace

Result<LiveView> lightLive(const RayTracer& tracer, const RenderRequest& request, Context& context,
                           const Scene* scene) {
  auto voxels = darkVoxels(scene != nullptr ? *scene : tracer.scene(), request, context);
  if (!voxels) return voxels.error();
  if (!request.live->lit) return LiveView{std::move(*voxels)};
  if (request.live->rsm) return lightByMaps(tracer, request, std::move(*voxels), context);
  const LiveOptions options{request.live->rays};
  auto light = NestedCaches::create(options);
  if (!light) return light.error();
  LiveView view{std::move(*voxels), std::move(*light)};
  NestedVolumes& volumes = view.voxels.volumes;

  LiveFrame frame;
  frame.emissionScale = emissionScaleOf(request);
  frame.sky = view.voxels.sky();
  if (request.straight) {
    auto straight = NestedCaches::create(options);
    if (!straight) return straight.error();
    view.straight.emplace(std::move(*straight));
  }
  const auto frames = convergeLive(
      *view.all, view.straight ? &*view.straight : nullptr, volumes, frame, request.bounces,
      [&] { return lightDirectly(tracer, request, volumes, context); }, context);
  if (!frames) return frames.error();
  view.frames = *frames;
  return view;
}

Result<VoxelView> lightByBake(const RayTracer& tracer, const RenderRequest& request, const Relighter& relighter,
                              Context& context) {
  auto view = darkVoxels(tracer.scene(), request, context);
  if (!view || !request.live->lit) return view;
  if (Status ok = lightDirectly(tracer, request, view->volume(), context); !ok) return ok.error();
  auto lit = SurfelVoxels::create(view->volume(), *request.bake);
  if (!lit) return lit.error();
  if (Status ok = lit->light(view->volume(), relighter, emissionScaleOf(request)); !ok) return ok.error();
  return view;
}

}  // namespace relume
