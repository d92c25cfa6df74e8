// SPDX-License-Identifier: MIT
// The directions in which a cache looks: one jittered ray per stratum of the hemisphere (surface caches) or of the
// sphere (grid caches), in blocks of 4 x 4 neighbouring strata, so that a packet of 16 rays stays together.
//
// In: a cache's normal and its random stream. Out: directions, and weights w = 1 / (pi p K), with which
// sum over rays of w y_i(omega) V(omega) estimates c_i = 1/pi Int y_i V (PIC App. A).
#pragma once

#include "bake/base/random.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace relume {

// The share of a surface cache's rays that is spread evenly over the solid angle; the rest follows the cosine. Even
// rays estimate the coefficients of radiance better, cosine rays irradiance: docs/notes/cuts.md has the noise of both.
inline constexpr float kEvenShare = 0.5f;

class DirectionStrata {
 public:
  static constexpr std::size_t kBlock = 16;  // rays

  // rays [>= 16]: how many are wanted, rounded down to whole blocks. evenShare [0..1].
  explicit DirectionStrata(std::uint32_t rays, float evenShare = kEvenShare);

  std::uint32_t count() const { return columns_ * rows_; }
  std::uint32_t columns() const { return columns_; }
  std::uint32_t rows() const { return rows_; }
  // Weight of a ray whose direction has this cosine with the normal; of any ray of a cache without a normal.
  float weight(float cosine, bool hemisphere) const {
    return (hemisphere ? 2.0f / (evenShare_ + (2.0f - 2.0f * evenShare_) * cosine) : 4.0f) /
           static_cast<float>(count());
  }

  struct Sample {
    glm::vec3 direction;  // unit
    float weight;         // w = 1 / (pi p K)
    float cosine;         // of the direction with the normal; 1 for a zero normal
  };

  // The rays of one cache, block by block. A zero normal asks for the sphere.
  class Sequence {
   public:
    Sequence(const DirectionStrata& strata, const glm::vec3& normal, RandomStream random);
    // The next block of 4 x 4 strata, row by row. There are count() / kBlock blocks.
    void next(std::span<Sample, kBlock> block);
    // Unit, and at right angles to the normal: where x and y of hemisphereDirection() lie.
    const glm::vec3& tangent() const { return tangent_; }
    const glm::vec3& bitangent() const { return bitangent_; }

   private:
    const DirectionStrata& strata_;
    RandomStream random_;
    glm::vec3 tangent_, bitangent_, axis_;
    bool hemisphere_;
    std::uint32_t block_ = 0;
  };

 private:
  std::uint32_t columns_, rows_;  // multiples of 4
  float evenShare_;
};

// The map from the unit square to the hemisphere about +Z whose equal cells are the strata. [unit]
glm::vec3 hemisphereDirection(float u, float v, float evenShare);

}  // namespace relume
