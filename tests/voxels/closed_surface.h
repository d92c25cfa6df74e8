// SPDX-License-Identifier: MIT
// A closed mesh by chance.
#pragma once

#include <glm/vec3.hpp>

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

namespace relume::test {

// A closed surface of random shape around a place: a sphere of large and small triangles, dented.
inline std::vector<glm::vec3> closedSurface(std::mt19937& random, const glm::vec3& middle, float radius) {
  std::uniform_real_distribution<float> dent(0.35f, 1.0f);
  const int rings = 5, sectors = 7;
  std::vector<std::vector<glm::vec3>> ring;
  for (int r = 0; r <= rings; ++r) {
    ring.emplace_back();
    const float polar = 3.14159265f * static_cast<float>(r) / rings;
    for (int s = 0; s < sectors; ++s) {
      const float turn = 6.2831853f * static_cast<float>(s) / sectors;
      const glm::vec3 d(std::sin(polar) * std::cos(turn), std::cos(polar), std::sin(polar) * std::sin(turn));
      ring.back().push_back(r == 0 || r == rings ? middle + radius * glm::vec3(0, r == 0 ? 1 : -1, 0)
                                                 : middle + radius * dent(random) * d);
    }
  }
  std::vector<glm::vec3> corners;
  for (int r = 0; r < rings; ++r) {
    for (int s = 0; s < sectors; ++s) {
      const auto &a = ring[static_cast<std::size_t>(r)][static_cast<std::size_t>(s)],
                 &b = ring[static_cast<std::size_t>(r)][static_cast<std::size_t>((s + 1) % sectors)],
                 &c = ring[static_cast<std::size_t>(r + 1)][static_cast<std::size_t>(s)],
                 &d = ring[static_cast<std::size_t>(r + 1)][static_cast<std::size_t>((s + 1) % sectors)];
      corners.insert(corners.end(), {a, b, c, b, d, c});
    }
  }
  return corners;
}

}  // namespace relume::test
