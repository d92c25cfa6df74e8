// SPDX-License-Identifier: MIT
// Made-up surfels for the tests of clustering.
#pragma once

#include "bake/base/random.h"
#include "relume/surfels.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cstdint>
#include <vector>

namespace relume {

// Uniform points on the inner faces of boxes scattered in a hall: flat parts, edges and opposite faces, as levels have.
inline Surfels makeSurfels(std::uint32_t count, std::uint64_t seed, std::uint32_t boxes = 12) {
  std::vector<glm::vec3> position(count), normal(count), albedo(count, glm::vec3(0.5f)), emission(count, glm::vec3(0));
  for (std::uint32_t i = 0; i < count; ++i) {
    RandomStream random(seed, 1, i);
    RandomStream box(seed, 2, random.below(boxes));
    const glm::vec3 center(30.0f * box.uniform(), 10.0f * box.uniform(), 20.0f * box.uniform());
    const glm::vec3 half(0.2f + 4.0f * box.uniform(), 0.2f + 4.0f * box.uniform(), 0.2f + 4.0f * box.uniform());
    const std::uint32_t face = random.below(6);
    glm::vec3 p(2.0f * random.uniform() - 1.0f, 2.0f * random.uniform() - 1.0f, 2.0f * random.uniform() - 1.0f);
    const float side = face % 2 == 0 ? 1.0f : -1.0f;
    p[static_cast<int>(face / 2)] = side;
    normal[i][static_cast<int>(face / 2)] = side;
    position[i] = center + half * p;
  }
  Surfels surfels;
  surfels.positionWorld = std::move(position);
  surfels.normal = std::move(normal);
  surfels.albedo = std::move(albedo);
  surfels.emission = std::move(emission);
  surfels.receiver = std::vector<std::uint32_t>(count, kGridReceiver);
  surfels.instance = std::vector<std::uint32_t>(count, 0);
  surfels.areaEach = 0.25f;
  return surfels;
}

inline std::vector<std::uint32_t> allOf(const Surfels& surfels) {
  std::vector<std::uint32_t> members(surfels.count());
  for (std::uint32_t i = 0; i < members.size(); ++i) members[i] = i;
  return members;
}

}  // namespace relume
