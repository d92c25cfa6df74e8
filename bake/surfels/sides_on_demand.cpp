// SPDX-License-Identifier: MIT
// See sides_on_demand.h.
#include "bake/surfels/sides_on_demand.h"

#include "bake/surfels/surfel_map.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace relume {
namespace {

constexpr double kMinKnown = 1024.0, kMaxKnown = 0x1p26;
constexpr std::uint64_t kHash = 0x9E3779B97F4A7C15ull;

struct MeshSize {
  double longestEdge = 0.0, farthest = 0.0;  // [m] before the instance's transform; farthest from the origin
};

MeshSize sizeOf(const Mesh& mesh) {
  double edge = 0.0, farthest = 0.0;  // squared
  for (const glm::uvec3& v : mesh.triangle) {
    const glm::dvec3 a = mesh.position[v.x], b = mesh.position[v.y], c = mesh.position[v.z];
    for (const glm::dvec3& e : {b - a, c - b, a - c}) edge = std::max(edge, glm::dot(e, e));
    for (const glm::dvec3& p : {a, b, c}) farthest = std::max(farthest, glm::dot(p, p));
  }
  return {std::sqrt(edge), std::sqrt(farthest)};
}

// A bound on how much a transform lengthens a vector, which rotations with scales along the axes meet: the root of a
// bound on the eigenvalues of its square (Gershgorin).
double stretchOf(const glm::mat4& toWorld) {
  const glm::dmat3 m{glm::mat3(toWorld)};
  const glm::dmat3 square = glm::transpose(m) * m;
  double max = 0.0;
  for (int i = 0; i < 3; ++i)
    max = std::max(max, std::abs(square[i][0]) + std::abs(square[i][1]) + std::abs(square[i][2]));
  return std::sqrt(max);
}

bool mayEmit(const Material& material) {
  const glm::vec3& e = material.emission;
  return e.x > 0.0f || e.y > 0.0f || e.z > 0.0f || material.drivable;
}

}  // namespace

TriangleShape TriangleShape::of(const Scene& scene, std::uint32_t instance, std::uint32_t triangle) {
  const Instance& owner = scene.instances[instance];
  const std::uint32_t t = triangle - owner.firstTriangle;
  return {triangle, instance, scene.corners(owner, t), geometricNormal(scene, {instance, t, {}})};
}

MapPoint TriangleShape::pointOn(const Scene& scene, std::uint32_t side, const glm::vec2& barycentric) const {
  return {corner[0] + barycentric.x * (corner[1] - corner[0]) + barycentric.y * (corner[2] - corner[0]),
          side % 2 == 0 ? normal : -normal, instance, emitterOf(scene, instance, side) != kReflector ? 1u : 0u};
}

SidesOnDemand::SidesOnDemand(const Scene& scene, const PlaySpace& playSpace, const SortedSurfels& near,
                             const SortedSurfels& far, std::vector<bool> isSearched, double lookups)
    : scene_(scene),
      near_(near),
      far_(far),
      isSearched_(std::move(isSearched)),
      known_(std::bit_floor(static_cast<std::size_t>(std::clamp(lookups, kMinKnown, kMaxKnown)))),
      shift_(64 - std::countr_zero(known_.size())) {
  const std::size_t sides = playSpace.seenArea.size();
  isSeen_.resize(sides);
  for (std::size_t s = 0; s < sides; ++s) isSeen_[s] = playSpace.seenArea[s] > 0.0f;
  if (playSpace.farShare.empty()) return;
  isFar_.resize(sides);
  for (std::size_t s = 0; s < sides; ++s) isFar_[s] = playSpace.isFar(static_cast<std::uint32_t>(s));
}

std::uint32_t SidesOnDemand::at(std::uint32_t side) const {
  std::atomic<std::uint64_t>& known = known_[(side * kHash) >> shift_];
  const std::uint64_t before = known.load(std::memory_order_relaxed);
  if (before >> 32 == side + std::uint64_t{1}) return static_cast<std::uint32_t>(before);
  const std::uint32_t found = search(side);
  known.store((side + std::uint64_t{1}) << 32 | found, std::memory_order_relaxed);
  return found;
}

std::uint32_t SidesOnDemand::search(std::uint32_t side) const {
  const TriangleShape triangle = TriangleShape::of(scene_, scene_.instanceOf(side / 2), side / 2);
  if (triangle.normal == glm::vec3(0.0f)) return kNone;
  const SortedSurfels& surfels = !isFar_.empty() && isFar_[side] ? far_ : near_;
  const auto reach = static_cast<float>(isSeen_[side] ? kSeenReach : kUnseenReach) * surfels.spacing;
  return surfels.best(triangle.pointOn(scene_, side, glm::vec2(1.0f / 3.0f)), reach);
}

std::vector<bool> instancesOfOneTile(const Scene& scene, float width) {
  constexpr double kRoundings = 32.0 * std::numeric_limits<float>::epsilon();  // of a corner in the world
  std::vector<MeshSize> size;
  size.reserve(scene.meshes.size());
  for (const Mesh& mesh : scene.meshes) size.push_back(sizeOf(mesh));
  std::vector<bool> isOf(scene.instances.size());
  for (std::size_t i = 0; i < isOf.size(); ++i) {
    const Instance& instance = scene.instances[i];
    const MeshSize& mesh = size[instance.mesh];
    const double stretch = stretchOf(instance.toWorld);
    const double rounding =
        kRoundings * (stretch * mesh.farthest + glm::length(glm::dvec3(glm::vec3(instance.toWorld[3]))));
    isOf[i] = instance.baked() && !mayEmit(scene.material(instance)) &&
              stretch * mesh.longestEdge * (1.0 + kRoundings) + rounding <= static_cast<double>(width);
  }
  return isOf;
}

}  // namespace relume
