// SPDX-License-Identifier: MIT
// See moving_parts.h.
#include "tools/render/moving_parts.h"

#include "formats/limits.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

namespace relume {

Result<MovingShapes> movingShapes(const Scene& scene) {
  const auto solid = static_cast<std::size_t>(std::count_if(scene.instances.begin(), scene.instances.end(),
                                                            [](const Instance& each) { return !each.baked(); }));
  if (solid > kMaxMovingParts)
    return Error{ErrorCode::usage, "--dynamic solid: the level has " + std::to_string(solid) +
                                       " dynamic parts, and at most " + std::to_string(kMaxMovingParts) +
                                       " can shadow a bake's light; leave it out, or bake those that stand still"};
  struct Colors {
    std::vector<glm::vec3> albedo, emission;
  };
  std::vector<Colors> colors;
  colors.reserve(scene.instances.size());
  std::vector<MovingMesh> meshes;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (instance.baked()) continue;
    const Mesh& mesh = scene.meshes[instance.mesh];
    Colors& of = colors.emplace_back();
    const glm::mat3 linear(instance.toWorld);
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      const glm::uvec3& v = mesh.triangle[t];
      const glm::vec3 a = mesh.position[v.x];
      const float width =
          std::sqrt(glm::length(glm::cross(linear * (mesh.position[v.y] - a), linear * (mesh.position[v.z] - a))));
      const SurfacePoint middle{i, t, glm::vec2(1.0f / 3.0f)};
      of.albedo.push_back(glm::clamp(albedoAt(scene, middle, width), 0.0f, 1.0f));
      of.emission.push_back(glm::clamp(emissionAt(scene, middle, width), 0.0f, kMaxRadiance));
    }
    meshes.push_back({mesh.position, mesh.triangle, of.albedo, of.emission});
  }
  return MovingShapes::create(meshes);
}

std::vector<MovingPart> movingParts(const Scene& scene) {
  std::vector<MovingPart> parts;
  for (const Instance& instance : scene.instances) {
    if (!instance.baked()) parts.push_back({static_cast<std::uint32_t>(parts.size()), glm::mat4x3(instance.toWorld)});
  }
  return parts;
}

}  // namespace relume
