// SPDX-License-Identifier: MIT
// The ways in which a point of a lattice may keep the light around it, for comparisons at equal bytes: what it keeps of
// rays all around, and what a receiver reads of it. All keep numbers that filter linearly.
#pragma once

#include "formats/irradiance_vector.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <span>

namespace relume::test {

// Light around a point by rays, as Y, Co and Cg.
struct SphereLight {
  static constexpr int kBands = 5;
  std::array<std::array<float, kBands * kBands>, 3> sh{};  // [W/m²/sr] coefficients of radiance
  std::array<SixVectors, 3> vectors{};                     // [W/m²]

  // Adds radiance [W/m²/sr] as R, G, B of a solid angle [sr] about a unit direction.
  void add(const glm::vec3& direction, const glm::vec3& rgb, float solidAngle);
};

struct PointBasis {
  const char* name;
  std::size_t bytes;    // of a point in halves of 16 bits; those of spherical harmonics fill texels of four
  std::size_t numbers;  // that are kept
  bool halves;  // six equal groups, one for each half of the sphere: a receiver reads those that its normal is in
  void (*keep)(const SphereLight& light, std::span<float> numbers);  // [Size numbers]
  // Irradiance as R, G, B [W/m²] for a unit normal, not clamped. [Size numbers, or half as many of the axes x, y, z]
  glm::vec3 (*read)(std::span<const float> numbers, const glm::vec3& normal);

  std::size_t readNumbers() const { return halves ? numbers / 2 : numbers; }
};
std::span<const PointBasis> pointBases();
// Where some of them stand there.
inline constexpr std::size_t kTwoBands = 1, kThreeBands = 3, kEighteenNumbers = 7, kSixSlabs = 9;

}  // namespace relume::test
