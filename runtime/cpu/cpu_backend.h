// SPDX-License-Identifier: MIT
// The CPU backend: steps 2 to 4 in order over the bake's own arrays. Step 5 is nothing here, because step 6 reads the
// light map's cache indices itself.
#pragma once

#include "formats/bake.h"
#include "runtime/cpu/bounce.h"
#include "runtime/cpu/light_caches.h"
#include "runtime/cpu/resolve.h"
#include "runtime/relighter.h"

#include <glm/vec4.hpp>

#include <array>
#include <vector>

namespace relume::cpu {

class CpuBackend {
 public:
  // The bake must pass checkBake() and outlive this. No parallelFor = one thread.
  CpuBackend(const Bake& bake, int lumaBands, int chromaBands, LightCachesKernel kernel, ParallelFor parallelFor);

  // One frame. `setup` must pass checkSetup().
  void relight(const LightSetup& setup);
  void reset();

  CacheLight cacheLight() const { return {lumaBands_, chromaBands_, coefficients_, bake_.links.kind == LinkKind::irradiance}; }
  std::span<const glm::vec4> nodes() const { return node_; }  // (Y, Co, Cg, 0) of radiosity [W/m²]
  std::vector<PassTime> passTimes() const;
  std::size_t bounceBytes() const { return bounce_.bytes(); }

 private:
  const Bake& bake_;
  int lumaBands_, chromaBands_;
  LightCachesKernel kernel_;
  ParallelFor parallelFor_;
  Bounce bounce_;
  std::vector<glm::vec4> node_;      // [Size nodes]
  std::vector<float> coefficients_;  // [Size n_C * stride]
  bool lit_ = false;                 // whether coefficients_ hold a frame
  std::array<double, 3> passMs_{};
};

}  // namespace relume::cpu
