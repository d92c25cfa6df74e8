// SPDX-License-Identifier: MIT
// Where a part's vertices lie in a grid, in integers alone: OpenGL leaves open how a shader rounds floating-point sums,
// and voxels are to be the same bits on every driver. Twin: shaders/lib/live_place.glsl, which a test compares.
//
// A vertex is what its floats are, 24 bits times a power of two; a part's transform is made factors of 30 bits and a
// power of two of its own, once, here. Their products of 54 bits are cut at 2^-16 of a step, and summed.
#pragma once

#include "runtime/voxels/voxel_grid.h"

#include <glm/mat3x3.hpp>
#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace relume {

inline constexpr int kPlaceShift = 16;  // bits of a place below a step
// Far outside of any grid, where a triangle's shape no longer matters; differences of two such places fit 32 bits.
inline constexpr std::int32_t kFarthestSteps = 1 << 29;  // [1/64 voxel]

struct StepPlace {
  std::array<std::array<std::int32_t, 3>, 3> factor{};  // [axis][coordinate] within 2^30, times 2^exponent
  std::array<std::int64_t, 3> offset{};                 // [2^-16 of 1/64 voxel] of the part's origin, within 2^48
  int exponent = 0;
  bool mirrored = false;

  // toWorld: checkTransform()
  static StepPlace of(const VolumeGrid& grid, const glm::mat4x3& toWorld) {
    StepPlace place;
    const double scale = kVoxelSteps / double{grid.voxel};
    double most = 0.0;
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < 3; ++k) most = std::max(most, scale * std::abs(double{toWorld[c][k]}));
    }
    std::frexp(most, &place.exponent);  // most < 2^exponent
    place.exponent -= 30;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<int>(k);
      for (std::size_t c = 0; c < 3; ++c)
        place.factor[k][c] = static_cast<std::int32_t>(
            std::floor(std::ldexp(scale * double{toWorld[static_cast<int>(c)][axis]}, -place.exponent) + 0.5));
      const double steps = scale * (double{toWorld[3][axis]} - double{grid.anchor()[axis]});
      place.offset[k] =
          static_cast<std::int64_t>(std::floor(std::clamp(std::ldexp(steps, kPlaceShift), -0x1p+48, 0x1p+48) + 0.5));
      // Whole steps, so that places in a grid that is moved are those from before it.
      place.offset[k] -= (std::int64_t{kBrickSide * kVoxelSteps} << kPlaceShift) * grid.shift[axis];
    }
    place.mirrored = glm::determinant(glm::dmat3(glm::mat3(toWorld[0], toWorld[1], toWorld[2]))) < 0.0;
    return place;
  }

  // [1/64 voxel] from the grid's corner, within kFarthestSteps. position: finite.
  glm::ivec3 stepsOf(const glm::vec3& position) const {
    glm::ivec3 steps;
    for (std::size_t k = 0; k < 3; ++k) {
      std::int64_t sum = offset[k] + (std::int64_t{1} << (kPlaceShift - 1));
      for (std::size_t c = 0; c < 3; ++c) sum += product(factor[k][c], position[static_cast<int>(c)]);
      steps[static_cast<int>(k)] = static_cast<std::int32_t>(
          std::clamp<std::int64_t>(sum >> kPlaceShift, -std::int64_t{kFarthestSteps}, std::int64_t{kFarthestSteps}));
    }
    return steps;
  }

 private:
  // v 2^shift, cut, at most 2^48.
  static std::uint64_t scaled(std::uint64_t v, int shift) {
    if (v == 0) return 0;
    if (static_cast<int>(std::bit_width(v)) + shift > 48) return std::uint64_t{1} << 48;
    if (shift >= 0) return v << shift;
    return shift > -64 ? v >> -shift : 0;
  }

  // A factor times a coordinate. [2^-16 of a step]
  std::int64_t product(std::int32_t by, float coordinate) const {
    const auto bits = std::bit_cast<std::uint32_t>(coordinate);
    const std::uint32_t power = bits >> 23 & 255u, mantissa = (bits & 0x7FFFFFu) | (power > 0 ? 0x800000u : 0u);
    const std::uint64_t size = std::uint64_t{static_cast<std::uint32_t>(std::abs(by))} * mantissa;
    const auto cut =
        static_cast<std::int64_t>(scaled(size, exponent + static_cast<int>(std::max(power, 1u)) - 150 + kPlaceShift));
    return (by < 0) != (bits >> 31 != 0) ? -cut : cut;
  }
};

}  // namespace relume
