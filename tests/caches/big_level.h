// SPDX-License-Identifier: MIT
// A level of any number of triangles that anyone can make: terrain with hills, cliffs and noise, and pillars on it by
// the hundred, one mesh in many places.
#pragma once

#include "tests/caches/meshes.h"

#include <cmath>
#include <cstdint>

namespace relume::test {

// Height of the terrain [m]: hills, terraces with steep edges, and what looks like stones.
inline float terrainHeight(float x, float z) {
  const float hills = 6.0f * std::sin(0.05f * x) * std::cos(0.043f * z) + 2.5f * std::sin(0.13f * x + 0.09f * z);
  const float terraces = 1.5f * std::tanh(6.0f * std::sin(0.11f * z - 0.05f * x));
  std::uint32_t h = static_cast<std::uint32_t>(static_cast<int>(x * 16.0f)) * 2654435761u ^
                    static_cast<std::uint32_t>(static_cast<int>(z * 16.0f)) * 40503u;
  h = (h ^ (h >> 15)) * 2246822519u;
  return hills + terraces + 0.05f * static_cast<float>(h >> 16) / 65536.0f;
}

// 2 * side² triangles over 200 m x 200 m.
inline Mesh displacedTerrain(std::uint32_t side) {
  Mesh mesh;
  for (std::uint32_t z = 0; z <= side; ++z) {
    for (std::uint32_t x = 0; x <= side; ++x) {
      const float px = 200.0f * static_cast<float>(x) / static_cast<float>(side) - 100.0f,
                  pz = 200.0f * static_cast<float>(z) / static_cast<float>(side) - 100.0f;
      mesh.position.emplace_back(px, terrainHeight(px, pz), pz);
    }
  }
  for (std::uint32_t z = 0; z < side; ++z) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::uint32_t a = z * (side + 1) + x, b = a + 1, c = a + side + 1, d = c + 1;
      mesh.triangle.emplace_back(a, c, b);
      mesh.triangle.emplace_back(b, c, d);
    }
  }
  return mesh;
}

// Terrain, and rows x rows pillars on it.
inline Scene bigLevel(std::uint32_t side, std::uint32_t rows) {
  Scene scene;
  scene.name = "big level";
  addInstance(scene, displacedTerrain(side), "terrain");
  Mesh pillar;
  addBox(pillar, {-0.5f, -2.0f, -0.5f}, {0.5f, 5.0f, 0.5f}, false);
  std::uint32_t mesh = kNone;
  for (std::uint32_t i = 0; i < rows * rows; ++i) {
    const float x = 190.0f * (static_cast<float>(i % rows) + 0.5f) / static_cast<float>(rows) - 95.0f;
    const float z = 190.0f * (static_cast<float>(i / rows) + 0.5f) / static_cast<float>(rows) - 95.0f;
    const glm::mat4 place = glm::rotate(glm::translate(glm::mat4(1.0f), glm::vec3(x, terrainHeight(x, z), z)),
                                        0.7f * static_cast<float>(i), glm::vec3(0, 1, 0));
    if (mesh == kNone) {
      mesh = scene.instances[addInstance(scene, pillar, "pillar", place)].mesh;
      continue;
    }
    Instance instance = scene.instances.back();
    instance.nodeIndex = static_cast<std::uint32_t>(scene.instances.size());
    instance.toWorld = place;
    instance.firstTriangle = scene.instances.back().firstTriangle + 12;
    scene.instances.push_back(instance);
  }
  Camera camera;
  camera.toWorld = glm::translate(glm::mat4(1.0f), glm::vec3(0, 20, 0));
  scene.cameras.push_back(camera);
  return scene;
}

}  // namespace relume::test
