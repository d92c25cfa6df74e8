// SPDX-License-Identifier: MIT
// See cpu_backend.h.
#include "runtime/cpu/cpu_backend.h"

#include "runtime/cpu/light_surfels.h"
#include "runtime/cpu/pull.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace relume::cpu {

CpuBackend::CpuBackend(const Bake& bake, int lumaBands, int chromaBands, LightCachesKernel kernel, ParallelFor parallelFor)
    : bake_(bake),
      lumaBands_(lumaBands),
      chromaBands_(chromaBands),
      kernel_(kernel),
      parallelFor_(std::move(parallelFor)),
      bounce_(bake, lumaBands, chromaBands, parallelFor_),
      node_(bake.hierarchy.nodeCount(), glm::vec4(0.0f)),
      coefficients_(bake.caches.count() * CacheLight{lumaBands, chromaBands, {}, false}.stride(), 0.0f) {}

void CpuBackend::relight(const LightSetup& setup) {
  using Clock = std::chrono::steady_clock;
  const auto ms = [](Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double, std::milli>(to - from).count();
  };
  const auto start = Clock::now();
  if (lit_ && setup.bounceScale > 0.0f) bounce_.setLight(cacheLight(), parallelFor_);
  lightSurfels(bake_, setup, lit_ ? &bounce_ : nullptr, node_, parallelFor_);
  const auto surfels = Clock::now();
  pull(bake_.hierarchy, node_, parallelFor_);
  const auto pulled = Clock::now();
  lightCaches(kernel_, bake_.links, node_, lumaBands_, chromaBands_, coefficients_, parallelFor_);
  const auto caches = Clock::now();
  lit_ = true;
  passMs_ = {ms(start, surfels), ms(surfels, pulled), ms(pulled, caches)};
}

void CpuBackend::reset() {
  lit_ = false;
  std::fill(coefficients_.begin(), coefficients_.end(), 0.0f);
}

std::vector<PassTime> CpuBackend::passTimes() const {
  return {{"surfels", passMs_[0]}, {"pull", passMs_[1]}, {"caches", passMs_[2]}, {"copy", 0.0}};
}

}  // namespace relume::cpu
