// SPDX-License-Identifier: MIT
// See driven_error.h.
#include "tests/accuracy/driven_error.h"

#include "bake/reference/path_tracer.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "tools/render/reference_layers.h"
#include "tools/render/render_cpu.h"
#include "tools/render/render_frame.h"

#include <glm/geometric.hpp>

#include <algorithm>

namespace relume {
namespace {

// [ms] of the pass over the surfels, the least of some frames.
Result<double> timeSurfels(const Bake& bake, const DrivenMaterial* driven) {
  RelightOptions options;
  LightSetup setup;
  MaterialEmission emission;
  if (driven != nullptr) {
    if (!driven->image.empty()) options.drivenImages = {{driven->name, driven->width, driven->height}};
    emission.material = *findMaterial(bake.emitters, driven->name);
    emission.radiance = driven->radiance;
    emission.image = driven->image;
    setup.materialEmissions = {&emission, 1};
  }
  Result<Relighter> relighter = Relighter::create(bake, options);
  if (!relighter) return relighter.error();
  double least = 1e9;
  for (int frame = 0; frame < 12; ++frame) {
    if (Status ok = relighter->relight(setup); !ok) return ok.error();
    if (frame > 1) least = std::min(least, relighter->passTimes()[0].ms);
  }
  return least;
}

}  // namespace

Result<DrivenError> measureDriven(const Scene& scene, const Bake& bake, const DrivenMaterial& driven,
                                  const std::string& camera, std::uint32_t width, std::uint32_t height,
                                  std::uint32_t samplesPerPixel) {
  Scene lit = scene;
  if (Status ok = driveScene(lit, {&driven, 1}, false); !ok) return ok.error();
  const auto found =
      std::find_if(lit.cameras.begin(), lit.cameras.end(), [&](const Camera& c) { return c.name == camera; });
  if (found == lit.cameras.end()) return Error{ErrorCode::usage, "no camera " + camera};
  Context context;
  const auto tracer =
      RayTracer::create(lit, BakeOptions{}.embreeIsa, context, RayStructure::thorough, RayGeometry::drawn);
  if (!tracer) return tracer.error();

  RenderRequest request;
  request.bake = &bake;
  request.camera = *found;
  request.driven = {driven};
  request.width = width;
  request.height = height;
  const auto frame = renderCpu(*tracer, request, context);
  if (!frame) return frame.error();
  ReferenceOptions options;
  options.width = width;
  options.height = height;
  options.samplesPerPixel = samplesPerPixel;
  options.emissive = true;
  const auto reference = renderReference(*tracer, *found, {}, options, context);
  if (!reference) return reference.error();

  ChannelImage candidate{width, height, {}};
  candidate.setLayer("", composeAov(*frame, Aov::indirect));
  CompareOptions compare;
  compare.layers = {"DiffDir", "DiffInd"};
  const auto difference = compareImages(toChannels(*reference, radianceOf(*reference)), candidate, compare);
  if (!difference) return difference.error();
  DrivenError error;
  error.difference = *difference;
  const Result<double> with = timeSurfels(bake, &driven), without = timeSurfels(bake, nullptr);
  if (!with) return with.error();
  if (!without) return without.error();
  error.drivenMs = *with;
  error.surfelsMs = *without;
  for (const auto& [name, bytes] : frame->bufferBytes) {
    if (name == "emission") error.emissionBytes = bytes;
  }
  return error;
}

std::vector<glm::vec3> drawSigns(std::uint32_t width, std::uint32_t height, float brightness) {
  std::vector<glm::vec3> image;
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const glm::vec2 at((static_cast<float>(x) + 0.5f) / static_cast<float>(width),
                         (static_cast<float>(y) + 0.5f) / static_cast<float>(height));
      glm::vec3 color(0.02f);
      if (glm::distance(at, {0.25f, 0.3f}) < 0.15f) color = {1.0f, 0.2f, 0.1f};
      if (glm::distance(at, {0.75f, 0.35f}) < 0.1f) color = {0.1f, 0.4f, 1.0f};
      if (at.y > 0.75f && at.y < 0.85f && at.x > 0.1f && at.x < 0.9f) color = {0.6f, 0.9f, 0.5f};
      image.push_back(brightness * color);
    }
  }
  return image;
}

}  // namespace relume
