// SPDX-License-Identifier: MIT
// See render_frame.h.
#include "tools/render/render_frame.h"

#include "tools/render/kept_shadows.h"
#include "tools/render/read_sky_map.h"

#include <algorithm>
#include <functional>

namespace relume {
namespace {

// Radiance with albedo -> irradiance / pi, a channel at a time.
glm::vec3 withoutAlbedo(const glm::vec3& radiance, const glm::vec3& albedo) {
  glm::vec3 result(0.0f);
  for (int c = 0; c < 3; ++c) {
    if (albedo[c] > 0.0f) result[c] = radiance[c] / albedo[c];
  }
  return result;
}

}  // namespace

const std::vector<std::string>& aovNames() {
  static const std::vector<std::string> names{"indirect",  "bounced", "direct",  "glossy",   "full",
                                              "unbounced", "albedo",  "normal",  "position", "depth",
                                              "occlusion", "voxels",  "records", "weight"};
  return names;
}

bool needsBake(Aov aov) {
  return aov == Aov::indirect || aov == Aov::bounced || aov == Aov::glossy || aov == Aov::full || aov == Aov::unbounced;
}

void RenderedFrame::resize(const RenderRequest& request) {
  width = request.width;
  height = request.height;
  const std::size_t pixels = std::size_t{width} * height;
  for (auto* layer : {&albedo, &emission, &direct, &indirect, &straight}) layer->assign(pixels, glm::vec3(0.0f));
  mirrors = request.gloss;
  if (request.drawsGlossy()) glossy.assign(pixels, glm::vec3(0.0f));
  if (request.voxels) voxels.assign(pixels, glm::vec3(0.0f));
  if (request.occlusionFalloff) open.assign(pixels, 0.0f);
  if (!request.centres) return;
  normal.assign(pixels, glm::vec3(0.0f));
  position.assign(pixels, glm::vec3(0.0f));
  depth.assign(pixels, 0.0f);
}

std::vector<glm::vec3> composeAov(const RenderedFrame& f, Aov aov) {
  std::vector<glm::vec3> image(std::size_t{f.width} * f.height);
  for (std::size_t i = 0; i < image.size(); ++i) {
    switch (aov) {
      case Aov::indirect:
        image[i] = withoutAlbedo(f.indirect[i], f.albedo[i]);
        break;
      case Aov::bounced:
        image[i] = withoutAlbedo(f.indirect[i] - f.straight[i], f.albedo[i]);
        break;
      case Aov::direct:
        image[i] = withoutAlbedo(f.direct[i], f.albedo[i]);
        break;
      case Aov::glossy:
        image[i] = f.glossy[i];
        break;
      case Aov::full:
        image[i] = f.direct[i] + f.indirect[i] + f.emission[i];
        if (f.mirrors) image[i] += f.glossy[i];
        break;
      case Aov::unbounced:
        image[i] = f.direct[i] + f.straight[i] + f.emission[i];
        break;
      case Aov::albedo:
        image[i] = f.albedo[i];
        break;
      case Aov::normal:
        image[i] = f.normal[i];
        break;
      case Aov::position:
        image[i] = f.position[i];
        break;
      case Aov::depth:
        image[i] = glm::vec3(f.depth[i]);
        break;
      case Aov::occlusion:
        image[i] = glm::vec3(f.open[i]);
        break;
      case Aov::voxels:
        image[i] = f.voxels[i];
        break;
      case Aov::records:
        image[i] = glm::vec3(f.records[i]);
        break;
      case Aov::weight:
        image[i] = glm::vec3(f.weight[i]);
        break;
    }
  }
  return image;
}

Light toRuntimeLight(const SceneLight& light) {
  return {light.kind,  light.intensity,    light.positionWorld, light.direction,
          light.range, light.innerConeRad, light.outerConeRad};
}

std::vector<Light> toRuntimeLights(const std::vector<SceneLight>& lights) {
  std::vector<Light> result;
  for (const SceneLight& light : lights) result.push_back(toRuntimeLight(light));
  return result;
}

namespace {

// What the request drives of the bake's materials, by their names. Where emitting surfaces are off, the others are dark
// one by one: LightSetup::emissionScale is that of moving parts as well.
std::vector<MaterialEmission> emissionsOf(const RenderRequest& request) {
  std::vector<MaterialEmission> list;
  if (request.driven.empty()) return list;
  const Array<DrivableMaterial>& materials = request.bake->emitters.materials;
  for (std::uint32_t m = 0; m < materials.size(); ++m) {
    const auto driven = std::find_if(request.driven.begin(), request.driven.end(),
                                     [&](const DrivenMaterial& d) { return d.name == materials[m].name; });
    if (driven == request.driven.end() && request.emissive) continue;
    MaterialEmission& emission = list.emplace_back();
    emission.material = m;
    emission.radiance = driven != request.driven.end() ? driven->radiance : glm::vec3(0.0f);
    if (driven != request.driven.end()) emission.image = driven->image;
  }
  return list;
}

}  // namespace

Result<Relit> relightRequest(const RenderRequest& request, const RelightOptions& common, const Visibility& visibility,
                             const std::function<void(const Relighter&)>& prepare) {
  Relit relit;
  if (!request.bake) return relit;
  RelightOptions options = common;
  for (const DrivenMaterial& d : request.driven) {
    if (!d.image.empty() && findMaterial(request.bake->emitters, d.name))
      options.drivenImages.push_back({d.name, d.width, d.height});
  }
  const std::vector<Light> lights = toRuntimeLights(request.lights);
  LightSetup setup;
  setup.lights = lights;
  const std::vector<MaterialEmission> emissions = emissionsOf(request);
  setup.materialEmissions = emissions;
  KeptShadows shadows(visibility);
  if (visibility) setup.visibilityBatch = std::ref(shadows);
  setup.emissionScale = glm::vec3(request.drawsEmission() ? 1.0f : 0.0f);
  // Where the bake knows none, as that of file format 3, it is dark as a whole.
  const bool darkens = request.drawsEmission() && !request.emissive && emissions.empty();
  const std::vector<glm::vec3> darkness(darkens ? request.bake->surfels.count() : 0, glm::vec3(0.0f));
  setup.surfelEmission = darkness;
  setup.skyRadiance = request.sky.radiance;
  const std::vector<glm::vec3> patches = skyPatchesOf(request.sky, request.bake->hierarchy.skyDirection.span());
  setup.skyPatches = patches;

  options.movingParts = static_cast<std::uint32_t>(request.movingParts.size());
  options.movingLag = 1;  // one picture, of the last frame
  setup.movingParts = request.movingParts;
  setup.movingShapes = request.movingShapes;

  // All light, after the frames asked for
  auto all = Relighter::create(*request.bake, options);
  if (!all) return all.error();
  if (prepare) prepare(*all);
  if (request.bounces > 0) {
    for (int frame = 0; frame < request.bounces; ++frame) {
      if (Status ok = all->relight(setup); !ok) return ok.error();
    }
    relit.frames = request.bounces;
  } else {
    const Result<int> frames = relightUntilConverged(*all, setup);
    if (!frames) return frames.error();
    relit.frames = *frames;
  }
  relit.all.emplace(std::move(*all));
  if (!request.straight) return relit;

  // What emitters and sky send straight to the caches: one frame with nothing reflected
  auto straight = Relighter::create(*request.bake, options);
  if (!straight) return straight.error();
  if (prepare) prepare(*straight);
  setup.lights = {};
  setup.bounceScale = 0.0f;
  if (Status ok = straight->relight(setup); !ok) return ok.error();
  relit.straight.emplace(std::move(*straight));
  return relit;
}

}  // namespace relume
