// SPDX-License-Identifier: MIT
// The synthetic room with two materials that a frame can drive: its ceiling, "screen", an emitter, and one wall,
// "panel", which is dark. Images lie on both as the walls' own coordinates run.
#pragma once

#include "formats/pack.h"
#include "tests/runtime/synthetic_bake.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
#include <vector>

namespace relume::test {

inline constexpr std::uint32_t kScreen = 0, kPanel = 1;

inline Bake makeDrivenBake(const SyntheticOptions& options) {
  Bake bake = makeSyntheticBake(options);
  const Surfels& s = bake.surfels;
  glm::vec3 low(std::numeric_limits<float>::max()), high(-low);
  for (const glm::vec3& p : s.positionWorld) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  std::vector<glm::vec3> emission(s.count(), glm::vec3(0.0f));
  std::vector<std::uint32_t> surfel, tap;
  std::vector<float> width;
  std::vector<DrivableMaterial> materials;
  const auto add = [&](const char* name, const glm::vec3& normal, int u, int v, const glm::vec3& radiance, bool clamp) {
    DrivableMaterial material;
    material.name = name;
    material.firstEntry = static_cast<std::uint32_t>(surfel.size());
    material.textured = true;
    material.marked = radiance == glm::vec3(0.0f);
    material.clampU = material.clampV = clamp;
    for (std::uint32_t i = 0; i < s.count(); ++i) {
      if (glm::dot(s.normal[i], normal) < 0.9f) continue;
      emission[i] = radiance;
      surfel.push_back(i);
      const glm::vec3 at = (s.positionWorld[i] - low) / (high - low);
      for (std::uint32_t k = 0; k < kFootprintTaps; ++k) tap.push_back(packUnorm16x2({at[u], at[v]}));
    }
    material.entryCount = static_cast<std::uint32_t>(surfel.size()) - material.firstEntry;
    for (std::uint32_t i = 0; i < material.entryCount; ++i)
      width.push_back(0.5f / std::sqrt(static_cast<float>(material.entryCount)));
    materials.push_back(material);
  };
  add("screen", {0, -1, 0}, 0, 2, {2, 1, 0.5f}, true);
  add("panel", {1, 0, 0}, 2, 1, {0, 0, 0}, false);
  bake.surfels.emission = emission;
  bake.emitters.materials = materials;
  bake.emitters.surfel = surfel;
  bake.emitters.tap = tap;
  bake.emitters.tapWidth = width;
  return bake;
}

// Stripes along both axes that no level of which is uniform. [Size width * height]
inline std::vector<glm::vec3> makeStripes(std::uint32_t width, std::uint32_t height, float brightness = 3.0f) {
  std::vector<glm::vec3> image;
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(width),
                  v = static_cast<float>(y) / static_cast<float>(height);
      image.push_back(brightness * glm::vec3(u < 0.4f ? 1.0f : 0.1f, v, x % 2 == 0 ? 0.5f : 0.0f));
    }
  }
  return image;
}

}  // namespace relume::test
