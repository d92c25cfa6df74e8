// SPDX-License-Identifier: MIT
// One side of an occupied voxel, and the places at which its direct light is found; packed_sides.h has how they are
// kept. What a side emits is kept beside it (VoxelLayer::emission), as few do.
#pragma once

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace relume {

// Means over the triangles that face the side, by area and by how squarely they do. Where none does, the back of those
// that face the other side.
struct VoxelSide {
  // [voxels] from the voxel's middle, in front of all that faces this side, so that light reaches it. Sums with places
  // in a grid are exact.
  glm::vec3 place{0.0f};
  glm::vec3 normal{0.0f};  // unit
  glm::vec3 albedo{0.0f};
  bool isFaced = false;  // by any triangle
  bool operator==(const VoxelSide&) const = default;
};

// A place of the surfaces in a voxel at which direct light is found.
class SideSample {
 public:
  SideSample() = default;
  // place [-32..32, 1/64 voxel from the voxel's middle], normal [127 times the unit one], count [0..4] how many of the
  // side's four places it stands for
  SideSample(const glm::ivec3& place, const glm::ivec3& normal, std::uint32_t count)
      : place_(place), normal_(normal), count_(count) {}

  const glm::ivec3& place() const { return place_; }
  const glm::ivec3& normal() const { return normal_; }
  std::uint32_t count() const { return count_; }  // 0 = there is none
  bool operator==(const SideSample&) const = default;

 private:
  glm::ivec3 place_{0}, normal_{0};
  std::uint32_t count_ = 0;
};

// On the surfaces nearest to four places spread over the voxel, each once, with counts that sum to four; light and
// shadow vary within it. Those that are there come first.
using SideSamples = std::array<SideSample, 4>;

// What direct light, and flux, are found by.
struct SideSurface {
  SideSamples samples{};
  float area = 0.0f;  // [m²] of triangles that face it; 0 = their backs alone
  bool operator==(const SideSurface&) const = default;
};

// The four places, on any plane across a voxel one in each quarter. [1/64 voxel from its middle]
inline constexpr std::array<std::array<int, 3>, 4> kSubCentres{
    {{16, 16, 16}, {16, -16, -16}, {-16, 16, -16}, {-16, -16, 16}}};

// The place of one of them on the nearest triangle.
struct SubPlace {
  glm::ivec3 place{0}, normal{0};  // as SideSample's
  std::int64_t plane = 0;          // of the triangle: place times normal for places on it
};

// kSubCentres' `i` moved onto a plane, within the voxel.
inline glm::ivec3 subPlaceOn(std::size_t i, const glm::ivec3& normal, int plane) {
  const std::array<int, 3>& wanted = kSubCentres[i];
  const int distance = normal.x * wanted[0] + normal.y * wanted[1] + normal.z * wanted[2] - plane;
  glm::ivec3 place;
  for (int k = 0; k < 3; ++k) {
    const int on = wanted[static_cast<std::size_t>(k)] - normal[k] * distance / (127 * 127);
    place[k] = on < -32 ? -32 : on > 32 ? 32 : on;
  }
  return place;
}

}  // namespace relume
