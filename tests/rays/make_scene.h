// SPDX-License-Identifier: MIT
// Small scenes made in code, for tests with analytic answers.
#pragma once

#include "relume/bake/scene.h"

#include <glm/gtc/matrix_transform.hpp>

#include <initializer_list>
#include <string>
#include <vector>

namespace relume::test {

// Number the triangles through and note mirrored transforms, as the importer does.
inline void finish(Scene& scene) {
  std::uint32_t first = 0;
  for (Instance& instance : scene.instances) {
    instance.firstTriangle = first;
    instance.flipped = glm::determinant(glm::mat3(instance.toWorld)) < 0.0f;
    first += static_cast<std::uint32_t>(scene.meshes[instance.mesh].triangle.size());
  }
}

inline std::uint32_t addMaterial(Scene& scene, glm::vec3 albedo, glm::vec3 emission = glm::vec3(0.0f)) {
  Material material;
  material.albedo = albedo;
  material.emission = emission;
  scene.materials.push_back(material);
  return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

// A material with an alpha test whose texture's left half is clear.
inline std::uint32_t addHalfMask(Scene& scene) {
  Image image;
  image.levels.push_back({2, 1, {255, 255, 255, 0, 255, 255, 255, 255}});
  scene.images.push_back(image);
  const std::uint32_t material = addMaterial(scene, glm::vec3(1.0f));
  scene.materials[material].alphaMode = AlphaMode::mask;
  scene.materials[material].albedoTexture.image = static_cast<std::uint32_t>(scene.images.size() - 1);
  scene.materials[material].albedoTexture.nearest = true;
  return material;
}

inline std::uint32_t addInstance(Scene& scene, Mesh mesh, const glm::mat4& toWorld = glm::mat4(1.0f)) {
  scene.meshes.push_back(std::move(mesh));
  Instance instance;
  instance.node = "node" + std::to_string(scene.instances.size());
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  instance.toWorld = toWorld;
  scene.instances.push_back(instance);
  return static_cast<std::uint32_t>(scene.instances.size() - 1);
}

// A parallelogram; its front is where edgeU x edgeV points. Two triangles, TEXCOORD_0 along the edges.
inline Mesh quad(glm::vec3 corner, glm::vec3 edgeU, glm::vec3 edgeV, std::uint32_t material = kNone) {
  Mesh mesh;
  mesh.name = "quad";
  mesh.position = {corner, corner + edgeU, corner + edgeU + edgeV, corner + edgeV};
  mesh.uv[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.triangle = {{0, 1, 2}, {0, 2, 3}};
  mesh.material = material;
  return mesh;
}

// The box between two corners; fronts outside, or inside for a room.
inline Mesh box(glm::vec3 low, glm::vec3 high, bool frontsInside, std::uint32_t material = kNone) {
  Mesh mesh;
  mesh.name = "box";
  for (std::uint32_t i = 0; i < 8; ++i) {
    mesh.position.emplace_back(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z);
  }
  const glm::uvec4 faces[6] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const glm::uvec4& f : faces) {
    mesh.triangle.push_back(frontsInside ? glm::uvec3(f.x, f.z, f.y) : glm::uvec3(f.x, f.y, f.z));
    mesh.triangle.push_back(frontsInside ? glm::uvec3(f.x, f.w, f.z) : glm::uvec3(f.x, f.z, f.w));
  }
  mesh.material = material;
  return mesh;
}

// A camera at a point, looking toward another.
inline Camera lookAt(glm::vec3 eye, glm::vec3 target, float yfovRad = 0.9f, glm::vec3 up = {0, 1, 0}) {
  Camera camera;
  camera.name = "camera";
  camera.toWorld = glm::inverse(glm::lookAt(eye, target, up));
  camera.yfovRad = yfovRad;
  return camera;
}

}  // namespace relume::test
