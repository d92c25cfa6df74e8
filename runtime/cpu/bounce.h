// SPDX-License-Identifier: MIT
// What the surfels receive from last frame's caches: irradianceOnLightmap() and irradianceInGrid() for receivers that never
// move. Nearly all surfels lie where the light map's normals are their own; for those only band 1 counts, and a table of it,
// made once a frame, is all they read.
#pragma once

#include "formats/bake.h"
#include "runtime/cpu/resolve.h"
#include "runtime/relighter.h"

#include <glm/vec4.hpp>

#include <vector>

namespace relume::cpu {

class Bounce {
 public:
  // The bake must outlive this.
  Bounce(const Bake& bake, int lumaBands, int chromaBands, const ParallelFor& parallelFor);
  // Take over last frame's light; `light` must stay until the surfels are lit.
  void setLight(const CacheLight& light, const ParallelFor& parallelFor);
  // Irradiance [W/m²] at surfel s.
  glm::vec3 irradiance(std::uint32_t s) const;
  std::size_t bytes() const { return plain_.size() + row_.size() * sizeof(Rows); }

 private:
  // (Y, Co, Cg, 0) of irradiance for a normal along x, y, z; and coefficient 0.
  struct Rows {
    glm::vec4 x, y, z, constant;
  };

  const Bake& bake_;
  bool chromaFollows_;
  std::vector<std::uint8_t> plain_;  // [Size n_S] 1 = four valid texels around it, normals its own
  std::vector<Rows> row_;            // [Size n_C]
  CacheLight light_;
};

}  // namespace relume::cpu
