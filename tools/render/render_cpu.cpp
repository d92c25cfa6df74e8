// SPDX-License-Identifier: MIT
// See render_cpu.h. Rays meet what the tracer has: with RayGeometry::drawn, dynamic instances are seen, lit by the grid
// and cast the punctual lights' shadows, onto what is drawn and onto surfels alike. A chunk is a run of pixel rows:
// their primary rays are traced together, some thousands at a time, then each hit is shaded.
#include "tools/render/render_cpu.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/reference/path_tracer.h"
#include "relume/glossy.h"
#include "runtime/cones/cone_light.h"
#include "tools/render/edited_light.h"
#include "tools/render/live_view.h"
#include "tools/render/relight_by_rays.h"
#include "tools/render/seen_surface.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <limits>
#include <optional>

namespace relume {
namespace {

constexpr float kInvPi = glm::one_over_pi<float>();
constexpr std::uint32_t kRaysAtOnce = 16384;      // of a row, in each thread
constexpr std::uint32_t kLobeStage = 0x6c6f6265;  // the random streams' stage

class CpuRenderer {
 public:
  // One of `relit` and `live` has the light, or neither; `voxels` are of either. Both may be null.
  CpuRenderer(const RayTracer& tracer, const RenderRequest& request, const Relit& relit, const LiveView* live,
              const VoxelView* voxels, const EditedLight* edited, RenderedFrame& frame)
      : tracer_(tracer),
        request_(request),
        relit_(relit),
        live_(live),
        voxels_(voxels),
        edited_(edited),
        frame_(frame),
        rays_(request.camera, request.width, request.height) {
    if (request.drawsCones()) cones_.emplace(voxels->volumes.all(), voxels->mips.all(), voxels->sky());
  }

  // Shade the pixels of one row; incomplete when cancelled.
  void row(std::uint32_t y, std::vector<Ray>& rays, std::vector<Hit>& hits, const Context& context) const {
    const std::uint32_t width = kRaysAtOnce / (request_.samples * request_.samples);
    for (std::uint32_t x = 0; x < request_.width; x += width)
      span(y, x, std::min(x + width, request_.width), rays, hits, context);
    if (request_.centres && !context.cancelled()) centres(y);
    if (request_.voxels && !context.cancelled()) voxels(y);
  }

 private:
  // Shade the pixels [begin, end) of a row.
  void span(std::uint32_t y, std::uint32_t begin, std::uint32_t end, std::vector<Ray>& rays, std::vector<Hit>& hits,
            const Context& context) const {
    if (context.cancelled()) return;
    const std::uint32_t samples = request_.samples;
    const float step = 1.0f / static_cast<float>(samples);
    rays.clear();
    for (std::uint32_t x = begin; x < end; ++x) {
      for (std::uint32_t s = 0; s < samples * samples; ++s) {
        rays.push_back(ray(static_cast<float>(x) + (static_cast<float>(s % samples) + 0.5f) * step,
                           static_cast<float>(y) + (static_cast<float>(s / samples) + 0.5f) * step));
      }
    }
    hits.resize(rays.size());
    tracer_.trace(rays, hits);
    for (std::size_t i = 0; i < rays.size() && !context.cancelled(); ++i) {
      addSample(std::size_t{y} * request_.width + begin + i / (samples * samples),
                static_cast<std::uint32_t>(i % (samples * samples)), rays[i], hits[i]);
    }
  }

  Ray ray(float x, float y) const {
    Ray r;
    rays_.at(x, y, r.origin, r.direction);
    return r;
  }

  void addSample(std::size_t pixel, std::uint32_t sample, const Ray& ray, const Hit& hit) const {
    const float weight = 1.0f / static_cast<float>(request_.samples * request_.samples);
    if (!hit) {
      frame_.emission[pixel] += weight * request_.sky.along(ray.direction);
      if (request_.occlusionFalloff) frame_.open[pixel] += weight;
      return;
    }
    const Scene& scene = tracer_.scene();
    SeenSurface seen = seenAt(scene, ray, hit);
    glm::vec3 albedo = albedoAt(scene, seen.point);
    if (request_.gloss) addMirrored(pixel, sample, ray, seen, albedo);
    const glm::vec3 reflected = weight * kInvPi * albedo;
    frame_.albedo[pixel] += weight * albedo;
    frame_.direct[pixel] += reflected * directIrradiance(tracer_, request_.lights, seen.positionWorld, seen.normal);
    if (relit_.all) addLinks(pixel, reflected, seen);
    if (live_) addLive(pixel, reflected, seen);
    if (cones_) addCones(pixel, weight, ray, seen);
    if (request_.exponent && relit_.all && !cones_) {
      frame_.glossy[pixel] += weight * linkGlossy(scene, *request_.bake, *relit_.all, seen, ray, *request_.exponent);
    }
    frame_.emission[pixel] += weight * emissionOf(hit, seen);
  }

  // The bake's light, corrected where the level has been edited since.
  void addLinks(std::size_t pixel, const glm::vec3& reflected, const SeenSurface& seen) const {
    const LiveIrradiance light = links(seen, request_.gridLookup);
    frame_.indirect[pixel] += reflected * light.all;
    if (relit_.straight) frame_.straight[pixel] += reflected * light.straight;
  }

  LiveIrradiance links(const SeenSurface& seen, GridLookup lookup) const {
    const auto of = [&](const Relighter& relighter) {
      return linkIrradiance(tracer_.scene(), *request_.bake, relighter, seen, lookup);
    };
    LiveIrradiance light{of(*relit_.all)};
    if (relit_.straight) light.straight = of(*relit_.straight);
    return edited_ ? edited_->at(light, seen.point.instance, seen.positionWorld, seen.normal) : light;
  }

  // Light of the caches in the volume's cells.
  void addLive(std::size_t pixel, const glm::vec3& reflected, const SeenSurface& seen) const {
    const LiveIrradiance light = live_->irradiance(seen.positionWorld, seen.normal);
    frame_.indirect[pixel] += reflected * light.all;
    if (request_.straight) frame_.straight[pixel] += reflected * light.straight;
  }

  void addCones(std::size_t pixel, float weight, const Ray& ray, const SeenSurface& seen) const {
    if (request_.occlusionFalloff) {
      const Gathered around =
          cones_->hemisphere(seen.positionWorld, seen.geometricNormal, seen.normal, *request_.occlusionFalloff);
      frame_.open[pixel] += weight * (1.0f - around.occlusion);
    }
    if (request_.exponent) {
      const float share = relit_.all ? glossyShare(glossyRoughness(*request_.exponent)) : 0.0f;
      glm::vec3 light = (1.0f - share) * cones_->glossy(seen.positionWorld, seen.geometricNormal,
                                                        glm::reflect(ray.direction, seen.normal), *request_.exponent);
      if (share > 0.0f)
        light += share * linkGlossy(tracer_.scene(), *request_.bake, *relit_.all, seen, ray, *request_.exponent);
      frame_.glossy[pixel] += weight * light;
    }
  }

  // Add what a surface mirrors as its material says. Its normal is bent by the normal map, and its albedo becomes what
  // it scatters.
  void addMirrored(std::size_t pixel, std::uint32_t sample, const Ray& ray, SeenSurface& seen,
                   glm::vec3& albedo) const {
    const Scene& scene = tracer_.scene();
    seen.normal = (seen.back ? -1.0f : 1.0f) * mappedNormal(scene, seen.point);
    const SurfaceGloss gloss = glossAt(scene, seen.point);
    const ReflectanceSplit split =
        splitReflectance(albedo, gloss.metalness, gloss.roughness, -glm::dot(ray.direction, seen.normal));
    albedo = split.diffuse;
    const float exponent = glossyExponent(gloss.roughness), share = glossyShare(gloss.roughness);
    const glm::vec3 reflected = glm::reflect(ray.direction, seen.normal);
    glm::vec3 light =
        directHighlights(tracer_, request_.lights, seen.positionWorld, seen.geometricNormal, reflected, exponent);
    // The caches carry wide lobes; a ray takes the part of sharp ones.
    if (share > 0.0f && relit_.all)
      light += share * linkGlossy(scene, *request_.bake, *relit_.all, seen, ray, exponent);
    if (cones_) {
      light += (relit_.all ? 1.0f - share : 1.0f) *
               cones_->glossy(seen.positionWorld, seen.geometricNormal, reflected, exponent);
    } else if (share < 1.0f) {
      const std::uint64_t item = std::uint64_t{pixel} * request_.samples * request_.samples + sample;
      light += (1.0f - share) * alongLobe(seen, reflected, exponent, item);
    }
    const float weight = 1.0f / static_cast<float>(request_.samples * request_.samples);
    frame_.glossy[pixel] += weight * split.specular * light;
  }

  // What a ray drawn from the lobe meets above the surface; nothing where next to none of the lobe is above it.
  glm::vec3 alongLobe(const SeenSurface& seen, const glm::vec3& reflected, float exponent, std::uint64_t item) const {
    RandomStream random(0, kLobeStage, item);
    const glm::vec3 direction = lobeDirectionAbove(reflected, exponent, seen.geometricNormal, random);
    if (direction == glm::vec3(0.0f)) return direction;
    const glm::vec3 origin = seen.positionWorld + seen.geometricNormal * tracer_.epsilonAt(seen.positionWorld);
    return radianceAlong({origin, 0.0f, direction});
  }

  // What a ray sees: a diffuse surface in the relit light and what it emits, or the sky.
  glm::vec3 radianceAlong(const Ray& ray) const {
    const Hit hit = tracer_.trace(ray);
    if (!hit) return request_.sky.along(ray.direction);
    const Scene& scene = tracer_.scene();
    const SeenSurface seen = seenAt(scene, ray, hit);
    glm::vec3 irradiance = directIrradiance(tracer_, request_.lights, seen.positionWorld, seen.normal);
    if (relit_.all) irradiance += links(seen, GridLookup::stencil).all;
    if (live_) irradiance += live_->irradiance(seen.positionWorld, seen.normal).all;
    return kInvPi * albedoAt(scene, seen.point) * irradiance + emissionOf(hit, seen);
  }

  // Emitted radiance toward the viewer.
  glm::vec3 emissionOf(const Hit& hit, const SeenSurface& seen) const {
    const Scene& scene = tracer_.scene();
    const bool emits =
        request_.drawsEmission() && (!hit.back || scene.bothSides(scene.instances[hit.instance], hit.triangle));
    return emits ? emissionAt(scene, seen.point) : glm::vec3(0.0f);
  }

  void centres(std::uint32_t y) const {
    for (std::uint32_t x = 0; x < request_.width; ++x) {
      const Ray r = ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      const Hit hit = tracer_.trace(r);
      if (!hit) continue;
      SeenSurface seen = seenAt(tracer_.scene(), r, hit);
      if (request_.gloss) seen.normal = (seen.back ? -1.0f : 1.0f) * mappedNormal(tracer_.scene(), seen.point);
      const std::size_t pixel = std::size_t{y} * request_.width + x;
      frame_.normal[pixel] = seen.normal;
      frame_.position[pixel] = seen.positionWorld;
      frame_.depth[pixel] = glm::dot(seen.positionWorld - rays_.origin, rays_.forward);
    }
  }

  // The lit side of the first voxel that each pixel's ray meets.
  void voxels(std::uint32_t y) const {
    for (std::uint32_t x = 0; x < request_.width; ++x) {
      const Ray r = ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      frame_.voxels[std::size_t{y} * request_.width + x] = voxels_->volumes.radianceAlong(r.origin, r.direction);
    }
  }

  const RayTracer& tracer_;
  const RenderRequest& request_;
  const Relit& relit_;
  const LiveView* live_;
  const VoxelView* voxels_;
  const EditedLight* edited_;
  RenderedFrame& frame_;
  CameraRays rays_;
  std::optional<ConeTracer> cones_{};
};

}  // namespace

Result<RenderedFrame> renderCpu(const RayTracer& tracer, const RenderRequest& request, Context& context) {
  context.progress("relight", 0.0);
  const auto relit = relightByRays(tracer, request, context);
  if (context.cancelled()) return cancelledError();
  if (!relit) return relit.error();
  std::optional<LiveView> live;
  std::optional<VoxelView> byBake;
  if (request.live && relit->all && (request.drawsCones() || request.voxels || !request.edited)) {
    auto lit = lightByBake(tracer, request, *relit->all, context);
    if (context.cancelled()) return cancelledError();
    if (!lit) return lit.error();
    byBake.emplace(std::move(*lit));
  } else if (request.live && !relit->all) {
    auto lit = lightLive(tracer, request, context);
    if (context.cancelled()) return cancelledError();
    if (!lit) return lit.error();
    live.emplace(std::move(*lit));
  }

  std::optional<EditedLight> edited;
  if (request.edited != nullptr && relit->all) {
    auto lit = lightEdited(tracer, request, context);
    if (context.cancelled()) return cancelledError();
    if (!lit) return lit.error();
    edited.emplace(std::move(*lit));
  }

  VoxelView* const voxels = live ? &live->voxels : byBake ? &*byBake : nullptr;
  if (request.drawsCones()) {
    if (Status ok = voxels->mips.update(voxels->volumes.all()); !ok) return ok.error();
  }

  // Draw, a row of pixels at a time
  RenderedFrame frame;
  frame.renderer = "cpu";
  frame.resize(request);
  const CpuRenderer renderer(tracer, request, *relit, live ? &*live : nullptr, voxels, edited ? &*edited : nullptr,
                             frame);
  parallelChunks(context, "draw", request.height, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    for (std::size_t y = begin; y < end; ++y) renderer.row(static_cast<std::uint32_t>(y), rays, hits, context);
  });
  if (context.cancelled()) return cancelledError();
  frame.frames = relit->frames;
  if (relit->all) {
    frame.bands = bandsName({relit->all->lumaBands(), relit->all->chromaBands()});
    frame.passTimes = relit->all->passTimes();
    frame.bufferBytes = relit->all->bufferSizes();
  }
  if (live) {
    frame.frames = live->frames;
    frame.bands = live->name();
    frame.passTimes = live->passTimes();
    frame.bufferBytes = live->bufferSizes();
  }
  if (byBake) {
    for (const PassTime& pass : byBake->passTimes()) frame.passTimes.push_back(pass);
    for (const auto& buffer : byBake->bufferSizes()) frame.bufferBytes.push_back(buffer);
  }
  if (edited) {
    for (const PassTime& pass : edited->passTimes()) frame.passTimes.push_back(pass);
    for (const auto& buffer : edited->bufferSizes()) frame.bufferBytes.push_back(buffer);
  }
  return frame;
}

}  // namespace relume
