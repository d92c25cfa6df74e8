// SPDX-License-Identifier: MIT
// Nodes of a product rule over the hemisphere about +z.
#pragma once

#include "bake/preview/hsh.h"

#include <glm/vec3.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace relume::test {

struct HemisphereNode {
  glm::dvec3 direction;
  double weight;  // [sr]
};

// Heights by Gauss and Legendre in u, z = sin²(u); azimuths evenly.
template <std::size_t heights, int azimuths>
std::vector<HemisphereNode> hemisphereNodes() {
  constexpr double kPi = std::numbers::pi;
  std::array<double, heights> u{}, weight{};
  gaussLegendre(0.0, 0.5 * kPi, u, weight);
  std::vector<HemisphereNode> nodes;
  nodes.reserve(heights * azimuths);
  for (std::size_t i = 0; i < heights; ++i) {
    const double z = std::sin(u[i]) * std::sin(u[i]), r = std::sqrt(1.0 - z * z);
    for (int k = 0; k < azimuths; ++k) {
      const double phi = 2.0 * kPi * (k + 0.5) / azimuths;
      nodes.push_back(
          {{r * std::cos(phi), r * std::sin(phi), z}, weight[i] * std::sin(2.0 * u[i]) * 2.0 * kPi / azimuths});
    }
  }
  return nodes;
}

}  // namespace relume::test
