// SPDX-License-Identifier: MIT
// See cpu_backend.h.
#include "runtime/cpu/cpu_backend.h"

#include "runtime/cpu/light_surfels.h"
#include "runtime/cpu/simd.h"
#include "runtime/shared/pack_color.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <utility>

namespace relume::cpu {

CpuBackend::CpuBackend(const Bake& bake, int lumaBands, int chromaBands, Simd simd, ParallelFor parallelFor,
                       bool surfelArrays)
    : CpuBackend(bake, lumaBands, chromaBands, simd, std::move(parallelFor), surfelArrays,
                 leafOrder(bake.hierarchy, bake.surfels.count())) {}

CpuBackend::CpuBackend(const Bake& bake, int lumaBands, int chromaBands, Simd simd, ParallelFor parallelFor,
                       bool surfelArrays, std::vector<std::uint32_t> order)
    : caches_(bake.caches),
      links_(bake.links),
      lumaBands_(lumaBands),
      chromaBands_(chromaBands),
      cachesKernel_(lightCachesKernel(simd)),
      surfelsKernel_(*lightSurfelsKernel(simd)),
      parallelFor_(std::move(parallelFor)),
      bounce_(caches_, bake.surfels, order, bake.links.kind, lumaBands),
      surfels_(bake.surfels, bake.hierarchy, std::move(order), surfelArrays),
      tree_(bake.hierarchy),
      node_(bake.hierarchy.nodeCount(), 0),
      firstMapCache_(bake.caches.firstMapCache()),
      coefficientCount_(bake.caches.count() * CacheLight{lumaBands, chromaBands, {}, false}.stride()),
      coefficients_(coefficientCount_ + 8, 0.0f) {}

void CpuBackend::relight(const LightSetup& setup) {
  using Clock = std::chrono::steady_clock;
  const auto ms = [](Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double, std::milli>(to - from).count();
  };
  const auto start = Clock::now();
  LightSurfelsJob job;
  if (lit_ && setup.bounceScale > 0.0f) bounce_.setLight(surfelsKernel_, cacheLight(), job);
  lightSurfels(surfelsKernel_, surfels_, setup, lit_ ? &bounce_ : nullptr, job, lights_, node_, parallelFor_);
  const auto surfels = Clock::now();
  tree_.pull(surfelsKernel_, node_, parallelFor_);
  const auto pulled = Clock::now();
  const auto color = [this, light = cacheLight()](std::uint32_t begin, std::uint32_t end) {
    bounce_.colorCaches(surfelsKernel_, light, begin, end);
  };
  lightCaches(cachesKernel_, links_, node_, lumaBands_, chromaBands_, coefficients_, parallelFor_, std::cref(color),
              firstMapCache_);
  const auto caches = Clock::now();
  lit_ = true;
  passMs_ = {ms(start, surfels), ms(surfels, pulled), ms(pulled, caches)};
}

void CpuBackend::reset() {
  lit_ = false;
  std::fill(coefficients_.begin(), coefficients_.end(), 0.0f);
}

std::vector<glm::vec3> CpuBackend::nodeRadiosity() const {
  std::vector<glm::vec3> radiosity;
  radiosity.reserve(node_.size());
  for (const std::uint32_t node : node_) radiosity.push_back(unpackColor(node));
  return radiosity;
}

std::vector<PassTime> CpuBackend::passTimes() const {
  return {{"surfels", passMs_[0]}, {"pull", passMs_[1]}, {"caches", passMs_[2]}};
}

std::vector<std::pair<std::string, std::size_t>> CpuBackend::bufferSizes() const {
  const auto bytes = [](const auto& array) { return array.size() * sizeof(array[0]); };
  const CacheGrid& grid = caches_.grid;
  return {{"surfels", surfels_.bytes()},
          {"hierarchy", tree_.bytes()},
          {"radiosity", bytes(node_)},
          {"links", links_.bytes()},
          {"caches", bytes(caches_.normal) + bytes(caches_.positionWorld) + bytes(coefficients_)},
          {"bounce", bounce_.bytes()},
          {"index", bytes(caches_.lightmap.cache) + bytes(grid.cache) + bytes(grid.brick) + bytes(grid.fine) +
                        bytes(grid.depth)}};
}

}  // namespace relume::cpu

namespace relume {

Result<std::unique_ptr<Backend>> makeCpuBackend(const Bake& bake, const BackendRequest& request) {
  const RelightOptions& options = request.options;
  const Simd simd = cpu::chooseSimd(options.simd);
  if (simd == Simd::best)
    return Error{ErrorCode::usage,
                 "this processor or this build lacks the instruction set asked for in RelightOptions::simd"};
  return std::unique_ptr<Backend>(std::make_unique<cpu::CpuBackend>(bake, request.lumaBands, request.chromaBands, simd,
                                                                    options.parallelFor, options.surfelArrays));
}

}  // namespace relume
