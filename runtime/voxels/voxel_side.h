// SPDX-License-Identifier: MIT
// One side of an occupied voxel in 44 bytes, of which a level has hundreds of thousands. Places of light and their
// normals are as they were found; the rest is rounded to far less than the voxel's sums were: places to 2^-14 voxel,
// normals to 1e-4, albedo to 1e-5. What a side emits is kept beside it (VoxelLayer::emission), as few do.
#pragma once

#include "formats/octahedron.h"

#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace relume {

// A place of the surfaces in a voxel at which direct light is found.
class SideSample {
 public:
  SideSample() = default;
  // place [-32..32, 1/64 voxel from the voxel's middle], normal [127 times the unit one], count [0..4] how many of the
  // side's four places it stands for
  SideSample(const glm::ivec3& place, const glm::ivec3& normal, std::uint32_t count) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<int>(k);
      place_[k] =
          static_cast<std::uint8_t>(static_cast<std::uint32_t>(place[axis] + kFarthest) | (count >> k & 1u) << 7);
      normal_[k] = static_cast<std::int8_t>(normal[axis]);
    }
  }

  glm::ivec3 place() const { return glm::ivec3(place_[0] & 127, place_[1] & 127, place_[2] & 127) - kFarthest; }
  glm::ivec3 normal() const { return {normal_[0], normal_[1], normal_[2]}; }
  std::uint32_t count() const {  // 0 = there is none
    return static_cast<std::uint32_t>(place_[0] >> 7 | place_[1] >> 7 << 1 | place_[2] >> 7 << 2);
  }
  bool operator==(const SideSample&) const = default;

 private:
  static constexpr int kFarthest = 32;
  std::array<std::uint8_t, 3> place_{};  // seven bits, and above them one of the count
  std::array<std::int8_t, 3> normal_{};
};

// Means over the triangles that face the side, by area and by how squarely they do. Where none does, the back of those
// that face the other side.
class VoxelSide {
 public:
  // On the surfaces nearest to four places spread over the voxel; light and shadow vary within it.
  using Samples = std::array<SideSample, 4>;

  VoxelSide() = default;
  // place [-4..4 voxels], normal is unit, albedo [0..1]
  VoxelSide(const glm::vec3& place, const glm::vec3& normal, const glm::vec3& albedo, float area,
            const Samples& samples)
      : samples_(samples), area_(area) {
    const glm::vec2 direction = toOctahedron(normal);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<int>(k);
      place_[k] = static_cast<std::int16_t>(rounded(place[axis] * kPlaceSteps, -32767.0f, 32767.0f));
      albedo_[k] = static_cast<std::uint16_t>(rounded(albedo[axis] * kAlbedoRange, 0.0f, kAlbedoRange));
      if (k < 2)
        normal_[k] = static_cast<std::int16_t>(rounded(direction[axis] * kNormalRange, -kNormalRange, kNormalRange));
    }
  }

  // [voxels] from the voxel's middle, in front of all that faces this side, so that light reaches it. Sums with places
  // in a grid are exact.
  glm::vec3 place() const { return glm::vec3(place_[0], place_[1], place_[2]) / kPlaceSteps; }
  glm::vec3 normal() const { return fromOctahedron(glm::vec2(normal_[0], normal_[1]) / kNormalRange); }  // unit
  glm::vec3 albedo() const { return glm::vec3(albedo_[0], albedo_[1], albedo_[2]) / kAlbedoRange; }
  float area() const { return area_; }  // [m²] of triangles that face it; 0 = their backs alone
  const Samples& samples() const { return samples_; }
  bool operator==(const VoxelSide&) const = default;

 private:
  static constexpr float kPlaceSteps = 8192.0f, kNormalRange = 32767.0f, kAlbedoRange = 65535.0f;
  static float rounded(float v, float low, float high) { return glm::clamp(glm::floor(v + 0.5f), low, high); }

  Samples samples_{};
  std::array<std::int16_t, 3> place_{};
  std::array<std::int16_t, 2> normal_{};
  std::array<std::uint16_t, 3> albedo_{};
  float area_ = 0.0f;
};
static_assert(sizeof(VoxelSide) == 44);

}  // namespace relume
