// SPDX-License-Identifier: MIT
// Answers questions about the scene's geometry: numbers of triangles, world corners, normals.
#include "relume/bake/scene.h"

#include "bake/scene/surface_normals.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// det(M) M^-T, which transforms normals, even when M flattens an axis and has no inverse.
glm::dmat3 cofactors(const glm::dmat3& m) {
  return {glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])};
}

glm::vec3 unitOrZero(const glm::dvec3& v) {
  const double length = glm::length(v);
  return length > 0.0 && std::isfinite(length) ? glm::vec3(v / length) : glm::vec3(0.0f);
}

// Vertices of a triangle in the order of Scene::corners().
glm::uvec3 cornerVertices(const Mesh& mesh, const Instance& instance, std::uint32_t t) {
  const glm::uvec3 v = mesh.triangle[t];
  return instance.flipped ? glm::uvec3(v.x, v.z, v.y) : v;
}

}  // namespace

std::uint32_t Scene::triangleCount() const {
  if (instances.empty()) return 0;
  const Instance& last = instances.back();
  return last.firstTriangle + static_cast<std::uint32_t>(meshes[last.mesh].triangle.size());
}

std::array<glm::vec3, 3> Scene::corners(const Instance& instance, std::uint32_t t) const {
  const Mesh& mesh = meshes[instance.mesh];
  const glm::uvec3 v = cornerVertices(mesh, instance, t);
  const auto toWorld = [&](std::uint32_t vertex) {
    return glm::vec3(instance.toWorld * glm::vec4(mesh.position[vertex], 1.0f));
  };
  return {toWorld(v.x), toWorld(v.y), toWorld(v.z)};
}

const Material& Scene::material(const Instance& instance) const {
  static const Material kDefault;
  const std::uint32_t index = meshes[instance.mesh].material;
  return index == kNone ? kDefault : materials[index];
}

bool Scene::bothSides(const Instance& instance, std::uint32_t t) const {
  return material(instance).doubleSided && (solid.empty() || solid[instance.firstTriangle + t] == 0);
}

std::uint32_t Scene::instanceOf(std::uint32_t triangle) const {
  const auto after = std::upper_bound(instances.begin(), instances.end(), triangle,
                                      [](std::uint32_t t, const Instance& i) { return t < i.firstTriangle; });
  return static_cast<std::uint32_t>(after - instances.begin()) - 1;
}

std::vector<std::uint32_t> Scene::playSpaceCameras() const {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i < cameras.size() && volumes.empty(); ++i) {
    if (cameras[i].playSpace) indices.push_back(i);
  }
  return indices;
}

// Transform the cross product of object-space edges by the cofactors. That is exact far from the origin, where world
// corners have lost digits.
glm::vec3 geometricNormal(const Scene& scene, const SurfacePoint& p) {
  const Instance& instance = scene.instances[p.instance];
  const Mesh& mesh = scene.meshes[instance.mesh];
  const glm::uvec3 v = mesh.triangle[p.triangle];
  const glm::dvec3 a = mesh.position[v.x];
  const glm::dvec3 normal = glm::cross(glm::dvec3(mesh.position[v.y]) - a, glm::dvec3(mesh.position[v.z]) - a);
  const glm::dvec3 world = cofactors(glm::dmat3(glm::mat3(instance.toWorld))) * normal;
  return unitOrZero(instance.flipped ? -world : world);
}

namespace {

// The shading normal where the geometric one is known.
glm::vec3 shadingNormal(const Scene& scene, const SurfacePoint& p, const glm::vec3& geometric) {
  const Instance& instance = scene.instances[p.instance];
  const Mesh& mesh = scene.meshes[instance.mesh];
  if (mesh.normal.empty() || geometric == glm::vec3(0.0f)) return geometric;

  const glm::uvec3 v = cornerVertices(mesh, instance, p.triangle);
  const float a = 1.0f - p.barycentric.x - p.barycentric.y;
  const glm::vec3 normal =
      a * mesh.normal[v.x] + p.barycentric.x * mesh.normal[v.y] + p.barycentric.y * mesh.normal[v.z];
  const glm::vec3 world =
      unitOrZero(cofactors(glm::dmat3(glm::mat3(instance.toWorld))) * glm::dvec3(instance.flipped ? -normal : normal));
  if (world == glm::vec3(0.0f)) return geometric;
  return glm::dot(world, geometric) < 0.0f ? -world : world;
}

}  // namespace

glm::vec3 shadingNormal(const Scene& scene, const SurfacePoint& p) {
  return shadingNormal(scene, p, geometricNormal(scene, p));
}

SurfaceNormals normalsAt(const Scene& scene, const SurfacePoint& p) {
  const glm::vec3 geometric = geometricNormal(scene, p);
  return {geometric, shadingNormal(scene, p, geometric)};
}

}  // namespace relume
