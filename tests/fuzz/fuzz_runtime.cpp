// SPDX-License-Identifier: MIT
// libFuzzer: any bytes as a bake that a game loads, relights and reads, on the CPU. Nothing may crash, whatever the
// bake; and where the validator finds no error, every number that comes out is finite and not negative.
#include "formats/validate.h"
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "tests/fuzz/mutate_bake.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

using namespace relume;

namespace {

bool isLight(const glm::vec3& e) {
  return std::isfinite(e.x) && std::isfinite(e.y) && std::isfinite(e.z) && e.x >= 0.0f && e.y >= 0.0f && e.z >= 0.0f;
}

const std::vector<glm::vec3> kImage(15, glm::vec3(0.5f, 1e9f, 0.0f));

// Three setups: lights of every kind, near and far and at their bounds; emitters that the host drives, under a sky; and
// driven materials.
bool relightThrice(Relighter& relighter, const Bake& bake, const std::vector<DrivenImage>& images) {
  const std::array<Light, 5> lights = {
      Light{.kind = LightKind::point, .intensity = {60, 40, 1}, .positionWorld = {1, 1, 1}},
      Light{.kind = LightKind::point,
            .intensity = glm::vec3(1e20f),
            .positionWorld = bake.surfels.positionWorld.empty() ? glm::vec3(0.0f) : bake.surfels.positionWorld[0]},
      Light{.kind = LightKind::directional, .intensity = {1, 2, 3}, .direction = {0, -1, 0}},
      Light{.kind = LightKind::spot,
            .intensity = {9, 0, 0},
            .positionWorld = {0, 2, 0},
            .direction = {0, -1, 0},
            .range = 3.0f,
            .innerConeRad = 0.3f,
            .outerConeRad = 0.3f},
      Light{.kind = LightKind::point, .intensity = {1, 1, 1}, .positionWorld = {1e9f, -1e9f, 1e9f}, .range = 1e-20f}};
  LightSetup setup;
  setup.lights = lights;
  setup.skyRadiance = {0.5f, 0.6f, 0.7f};
  if (!relighter.relight(setup)) return false;

  const std::vector<glm::vec3> emission(bake.surfels.count(), glm::vec3(0, 1e20f, 3));
  const std::vector<glm::vec3> sky(bake.hierarchy.skyDirection.size(), glm::vec3(2, 1, 1e20f));
  setup.lights = {};
  setup.surfelEmission = emission;
  setup.skyPatches = sky;
  setup.bounceScale = 0.5f;
  if (!relighter.relight(setup)) return false;

  // Every other material by a colour, or by the image that was declared for the first.
  std::vector<MaterialEmission> emissions;
  for (std::uint32_t m = 0; m < bake.emitters.materials.size(); m += 2) {
    MaterialEmission& driven = emissions.emplace_back();
    driven.material = m;
    driven.radiance = {1e9f, 0, 2};
    if (m == 0 && !images.empty()) driven.image = kImage;
  }
  setup.surfelEmission = {};
  setup.materialEmissions = emissions;
  return static_cast<bool>(relighter.relight(setup));
}

// Receivers on the map and in the grid: at caches, at surfels, and where none can be.
bool readAll(const Relighter& relighter, const Bake& bake) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
  std::vector<glm::vec3> places = {glm::vec3(0.0f),     {kInfinity, 0, 0}, {0, -kInfinity, 0},          {0, 0, kNan},
                                   glm::vec3(-3.4e38f), {1e9f, 0, -1e9f},  bake.caches.grid.originWorld};
  const auto add = [&](const Array<glm::vec3>& positions) {
    const std::size_t step = positions.size() / 8 + 1;
    for (std::size_t i = 0; i < positions.size(); i += step) places.push_back(positions[i]);
  };
  add(bake.caches.positionWorld);
  add(bake.surfels.positionWorld);
  const std::array<glm::vec3, 5> normals = {glm::vec3(0, 1, 0), glm::vec3(-1, 0, 0), glm::vec3(0.0f), glm::vec3(kNan),
                                            glm::vec3(1e30f)};
  bool good = true;
  for (const glm::vec3& place : places) {
    for (const glm::vec3& normal : normals) {
      good &= isLight(relighter.irradianceInGrid(place, normal));
      good &= isLight(relighter.irradianceOnLightmap(glm::vec2(place), normal));
      good &= isLight(relighter.glossyInGrid(place, normal, {0, 1, 0}, 1e3f * normal.x));
      good &= isLight(relighter.glossyOnLightmap(glm::vec2(place), normal, 4.0f));
      good &= isLight(relighter.irradianceOnLightmap(glm::vec2(0.5f), {0, 0, 1}, normal));
    }
  }
  const std::vector<float> coefficients = relighter.cacheCoefficients();
  good &= std::all_of(coefficients.begin(), coefficients.end(), [](float c) { return std::isfinite(c); });
  const std::vector<glm::vec3> radiosity = relighter.nodeRadiosity();
  good &= std::all_of(radiosity.begin(), radiosity.end(), isLight);
  (void)relighter.bufferSizes();
  return good;
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max, unsigned seed) {
  fuzz::Random random(seed);
  return fuzz::store(fuzz::mutateBake({data, size}, max, random), data, max);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Result<Bake> bake = parseBake({reinterpret_cast<const std::byte*>(data), size}, nullptr, Checksums::skip);
  if (!bake) return 0;
  const std::vector<Finding> findings = validateBake(*bake);
  const bool valid = std::none_of(findings.begin(), findings.end(),
                                  [](const Finding& finding) { return finding.severity == FindingSeverity::error; });
  // The bake's own bands, and others; each set of kernels that this processor has.
  const std::array<RelightOptions, 3> choices = {
      RelightOptions{}, RelightOptions{.lumaBands = 1, .chromaBands = 1, .simd = Simd::baseline},
      RelightOptions{.lumaBands = 2, .chromaBands = 2, .simd = Simd::avx2}};
  std::vector<DrivenImage> images;
  if (!bake->emitters.materials.empty() && bake->emitters.materials[0].textured)
    images.push_back({bake->emitters.materials[0].name, 5, 3});
  for (RelightOptions options : choices) {
    options.drivenImages = images;
    Result<Relighter> relighter = Relighter::create(*bake, options);
    if (!relighter) {
      if (valid && relighter.error().code == ErrorCode::invalidFile) std::abort();  // validate promised that it loads
      continue;
    }
    if (!relightThrice(*relighter, *bake, images)) std::abort();
    if (!readAll(*relighter, *bake) && valid) std::abort();
  }
  return 0;
}
