// SPDX-License-Identifier: MIT
// See furnace_bake.h.
#include "tests/runtime/furnace_bake.h"

#include "formats/pack.h"
#include "formats/sh.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <numbers>

namespace relume::test {
namespace {

glm::vec3 inward(int wall) {
  glm::vec3 n(0.0f);
  n[wall / 2] = wall % 2 ? -1.0f : 1.0f;
  return n;
}

// The wall of the cube [-1,1]³ that a ray from inside it meets.
int wallHit(const glm::vec3& from, const glm::vec3& d) {
  int best = 0;
  float nearest = 1e30f;
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] == 0.0f) continue;
    const float t = ((d[axis] > 0.0f ? 1.0f : -1.0f) - from[axis]) / d[axis];
    if (t < nearest) {
      nearest = t;
      best = 2 * axis + (d[axis] > 0.0f ? 1 : 0);
    }
  }
  return best;
}

}  // namespace

Bake makeFurnaceBake(float albedo, float emission, std::uint32_t bands) {
  Bake bake;
  std::vector<glm::vec3> position, normal;
  std::vector<std::uint32_t> receiver, texels;
  // The air's cache is number 0; walls 0..5 are caches 1..6, one texel each in a map of 6 x 1.
  for (int wall = 0; wall < 6; ++wall) {
    normal.push_back(inward(wall));
    position.push_back(-0.999f * normal.back());
    texels.push_back(static_cast<std::uint32_t>(wall) + 1);
    receiver.push_back(packUnorm16x2({(static_cast<float>(wall) + 0.5f) / 6.0f, 0.5f}));
  }
  receiver[5] = kGridReceiver;
  bake.surfels.positionWorld = position;
  bake.surfels.normal = normal;
  bake.surfels.albedo = std::vector<glm::vec3>(6, glm::vec3(albedo));
  bake.surfels.emission = std::vector<glm::vec3>(6, glm::vec3(emission));
  bake.surfels.receiver = receiver;
  bake.surfels.instance = std::vector<std::uint32_t>(6, 0u);
  bake.surfels.areaEach = 4.0f;
  bake.instances = std::vector<BakedInstance>{{.node = "walls", .mesh = "walls", .material = ""}};
  bake.caches.lightmap.parts = std::vector<LightmapPart>(1);
  position.insert(position.begin(), glm::vec3(0.0f));
  normal.insert(normal.begin(), glm::vec3(0.0f));
  bake.caches.positionWorld = position;
  bake.caches.normal = normal;
  bake.caches.lightmap.width = 6;
  bake.caches.lightmap.height = 1;
  bake.caches.lightmap.cache = texels;
  bake.caches.grid.resolution = glm::uvec3(1);
  bake.caches.grid.spacing = glm::vec3(1.0f);
  bake.caches.grid.cache = std::vector<std::uint32_t>{0};

  // 0 -> (1, 2); 1 -> (3, 4); 2 -> (5, 6); 3 -> (7, 8); 4 -> (9, 10); leaves 5..10.
  std::vector<std::uint32_t> child = {1, 3, 5, 7, 9}, leafNode;
  for (std::uint32_t s = 0; s < 6; ++s) {
    child.push_back(kLeafBit | s);
    leafNode.push_back(5 + s);
  }
  std::vector<float> weight(11, 0.0f);
  weight[0] = 4.0f / 6.0f;
  for (std::size_t i = 1; i < 5; ++i) weight[i] = 0.5f;
  bake.hierarchy.child = child;
  bake.hierarchy.firstWeight = weight;
  bake.hierarchy.levelBegin = std::vector<std::uint32_t>{0, 1, 3, 7, 11};
  bake.hierarchy.leafNode = leafNode;
  bake.hierarchy.groupRoot = std::vector<std::uint32_t>{0};

  // Links to all six leaves, c_{s,i} = 1 / pi Int y_i V_s by quadrature over the sphere (PIC Eq. (2)).
  const std::size_t count = bands * bands;
  std::vector<std::uint32_t> rowBegin{0}, node;
  std::vector<std::uint16_t> halves;
  for (std::size_t cache = 0; cache < 7; ++cache) {
    std::vector<std::array<double, kMaxCoefficients>> c(6);
    for (auto& each : c) each.fill(0.0);
    const int rows = 128, columns = 256;
    for (int r = 0; r < rows; ++r) {
      const double z = 1.0 - (2.0 * r + 1.0) / rows, s = std::sqrt(1.0 - z * z);
      for (int k = 0; k < columns; ++k) {
        const double phi = 2.0 * std::numbers::pi * (k + 0.5) / columns;
        const glm::vec3 d(s * std::cos(phi), s * std::sin(phi), z);
        if (normal[cache] != glm::vec3(0.0f) && glm::dot(d, normal[cache]) <= 0.0f) continue;
        std::array<float, kMaxCoefficients> y;
        evaluateSh(static_cast<int>(bands), d, y);
        auto& sums = c[static_cast<std::size_t>(wallHit(position[cache], d))];
        for (std::size_t i = 0; i < count; ++i) sums[i] += y[i] * 4.0 / (rows * columns);
      }
    }
    for (std::size_t wall = 0; wall < 6; ++wall) {
      node.push_back(leafNode[wall]);
      for (std::size_t i = 0; i < count; ++i) halves.push_back(packHalf(static_cast<float>(c[wall][i])));
    }
    rowBegin.push_back(static_cast<std::uint32_t>(node.size()));
  }
  bake.links.kind = LinkKind::sh;
  bake.links.bands = bands;
  bake.links.rowBegin = rowBegin;
  bake.links.shNode = node;
  bake.links.shCoefficients = halves;
  bake.provenance.lumaBands = bake.provenance.chromaBands = bands;
  return bake;
}

}  // namespace relume::test
