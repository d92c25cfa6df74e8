// SPDX-License-Identifier: MIT
// The CPU backend: steps 2 to 4 in order. Step 5 is nothing here, because step 6 reads the light map's cache indices
// itself. Surfels, hierarchy and links are kept packed; caches stay the bake's own arrays.
#pragma once

#include "formats/bake_data.h"
#include "runtime/cpu/bounce.h"
#include "runtime/cpu/light_caches.h"
#include "runtime/cpu/pull.h"
#include "runtime/cpu/resolve.h"
#include "runtime/cpu/surfel_set.h"
#include "runtime/relighter.h"

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace relume::cpu {

class CpuBackend {
 public:
  // The bake must pass checkBake(). Its caches must outlive this; the rest is read here only. `simd` must be
  // one that this processor has. No parallelFor = one thread. surfelArrays: see RelightOptions.
  CpuBackend(const Bake& bake, int lumaBands, int chromaBands, Simd simd, ParallelFor parallelFor,
             bool surfelArrays = true);

  // One frame. `setup` must pass checkSetup().
  void relight(const LightSetup& setup);
  void reset();

  CacheLight cacheLight() const {
    return {lumaBands_, chromaBands_, {coefficients_.data(), coefficientCount_}, links_.kind() == LinkKind::irradiance};
  }
  std::span<const std::uint32_t> nodes() const { return node_; }  // radiosity [W/m²] (runtime/shared/pack_color.h)
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  CpuBackend(const Bake& bake, int lumaBands, int chromaBands, Simd simd, ParallelFor parallelFor, bool surfelArrays,
             std::vector<std::uint32_t> order);

  const Caches& caches_;
  LinkSet links_;
  int lumaBands_, chromaBands_;
  LightCachesKernel cachesKernel_;
  const LightSurfelsKernel& surfelsKernel_;
  ParallelFor parallelFor_;
  Bounce bounce_;
  SurfelSet surfels_;
  PullTree tree_;
  std::vector<std::uint32_t> node_;  // [Size nodes]
  std::uint32_t firstMapCache_;
  std::size_t coefficientCount_;     // n_C * stride
  std::vector<float> coefficients_;  // [Size coefficientCount_ and 8 more, which kernels may read]
  bool lit_ = false;                 // whether coefficients_ hold a frame
  std::array<double, 3> passMs_{};
};

}  // namespace relume::cpu
