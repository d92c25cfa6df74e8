// SPDX-License-Identifier: MIT
// What the surfels receive from last frame's caches: irradianceOnLightmap() and irradianceInGrid() for receivers that never
// move. How a surfel's normal stands to the light map's is known once and for all, and the diffuse lobe of up to four
// bands needs the first nine coefficients only (band 3 of the clamped cosine is zero; where the normals agree it is band 1
// alone): a table of those, a cache line or two a cache, is made once a frame.
#pragma once

#include "formats/bake.h"
#include "formats/sh.h"
#include "runtime/cpu/resolve.h"
#include "runtime/relighter.h"

#include <vector>

namespace relume::cpu {

struct Stencil;

class Bounce {
 public:
  // The bake must outlive this.
  Bounce(const Bake& bake, int lumaBands, int chromaBands, const ParallelFor& parallelFor);
  // Take over last frame's light; `light` must stay until the surfels are lit.
  void setLight(const CacheLight& light, const ParallelFor& parallelFor);
  // Irradiance [W/m²] at surfel s.
  glm::vec3 irradiance(std::uint32_t s) const;
  std::size_t bytes() const { return (cosine_.size() + table_.size()) * sizeof(float); }

 private:
  glm::vec3 gatherLinear(std::uint32_t point, const glm::vec3& normal, float linear) const;
  glm::vec3 gather(const Stencil& stencil, const glm::vec3& normal, const SurfaceLobe& share) const;

  const Bake& bake_;
  bool inTable_;               // whether the table holds all that a lobe needs
  bool chromaFollows_;
  std::vector<float> cosine_;  // [Size n_S] between the surfel's and the map's normal, 2 where it reads the grid
  std::vector<float> table_;   // [Size n_C * 36] (Y, Co, Cg, 0) of coefficients 0 to 8
  CacheLight light_;
};

}  // namespace relume::cpu
