// SPDX-License-Identifier: MIT
// See live_gl.h.
#include "tools/gl_scene/egl_context.h"

#include "tools/render/live_gl.h"

#include "bake/rays/ray_tracer.h"
#include "relume/bake/options.h"
#include "tools/render/converge_live.h"
#include "tools/render/relight_by_rays.h"

namespace relume {
namespace {

// By the bake, on the CPU: rays shadow what its surfels do not know.
Result<VoxelView> byBake(const Scene& scene, const RenderRequest& request, Context& context) {
  const auto tracer =
      RayTracer::create(scene, BakeOptions{}.embreeIsa, context, RayStructure::thorough, RayGeometry::drawn);
  if (!tracer) return tracer.error();
  const auto relit = relightByRays(*tracer, request, context);
  if (context.cancelled()) return cancelledError();
  if (!relit) return relit.error();
  return lightByBake(*tracer, request, *relit->all, context);
}

// By the passes of the caches.
Status lightCaches(const RenderRequest& request, const ShadowMaps& shadows, std::span<const Light> lights, LiveGl& live,
                   Context& context) {
  const LiveCachesGlOptions options{{request.live->rays}, EglContext::getProcAddress, ShadowMaps::glsl(), {}};
  auto all = LiveCachesGl::create(options);
  if (!all) return all.error();
  live.all.emplace(std::move(*all));
  if (request.straight) {
    auto straight = LiveCachesGl::create(options);
    if (!straight) return straight.error();
    live.straight.emplace(std::move(*straight));
  }
  LiveFrame frame;
  frame.emissionScale = glm::vec3(request.drawsEmission() ? 1.0f : 0.0f);
  frame.sky = live.voxels.sky();
  NestedVolumes& volumes = live.voxels.volumes;
  const auto frames = convergeLive(
      *live.all, live.straight ? &*live.straight : nullptr, volumes, frame, request.bounces,
      [&] {
        shadows.setUniforms(live.all->directProgram());
        shadows.bind();
        LightSetup setup;
        setup.lights = lights;
        return live.all->lightDirectly(volumes, setup);
      },
      context);
  if (!frames) return frames.error();
  live.frames = *frames;
  if (!request.voxels) return done();
  // What the CPU draws of the voxels
  for (std::size_t level = 0; level < volumes.size(); ++level) {
    const std::vector<glm::vec3> radiance = live.all->radiance(level);
    for (std::uint32_t s = 0; s < volumes[level].sideCount(); ++s) volumes[level].setRadiance(s, radiance[s]);
  }
  return done();
}

}  // namespace

Result<LiveGl> lightLiveGl(const Scene& scene, const RenderRequest& request, const ShadowMaps& shadows,
                           std::span<const Light> lights, Context& context) {
  const bool isBaked = request.bake != nullptr && request.live->lit;
  auto voxels = isBaked ? byBake(scene, request, context) : darkVoxels(scene, request, context);
  if (!voxels) return voxels.error();
  LiveGl live{std::move(*voxels)};
  if (!isBaked && request.live->lit) {
    if (Status ok = lightCaches(request, shadows, lights, live, context); !ok) return ok.error();
  }
  if (context.cancelled()) return cancelledError();
  if (!request.drawsCones()) return live;
  // All cones for each sub-pixel, as the CPU draws them.
  ConesGlOptions options{{.interleaved = false, .gather = false, .blur = false, .keep = false},
                         request.live->directions,
                         request.occlusionFalloff.has_value(),
                         EglContext::getProcAddress};
  options.pixels.falloff = request.occlusionFalloff.value_or(0.0f);
  auto cones = ConesGl::create(options);
  if (!cones) return cones.error();
  live.cones.emplace(std::move(*cones));
  std::vector<const gl::LitSides*> lit;
  for (std::size_t level = 0; live.all && level < live.voxels.volumes.size(); ++level)
    lit.push_back(&live.all->sides(level));
  if (Status ok = live.cones->fill(live.voxels.volumes, lit); !ok) return ok.error();
  return live;
}

std::vector<PassTime> LiveGl::passTimes() const {
  std::vector<PassTime> times = voxels.passTimes();
  const auto add = [&](const std::vector<PassTime>& more) { times.insert(times.end(), more.begin(), more.end()); };
  if (all) {
    // The volume's own passes of light have not run.
    std::erase_if(times, [](const PassTime& pass) { return pass.ms == 0.0; });
    add(all->passTimes());
  }
  if (cones) add(cones->passTimes());
  return times;
}

std::vector<std::pair<std::string, std::size_t>> LiveGl::bufferSizes() const {
  auto sizes = voxels.bufferSizes();
  const auto add = [&](const auto& more) { sizes.insert(sizes.end(), more.begin(), more.end()); };
  if (all) add(all->bufferSizes());
  if (cones) add(cones->bufferSizes());
  return sizes;
}

}  // namespace relume
