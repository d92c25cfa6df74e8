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

CpuBackend::CpuBackend(const Bake& bake, const CacheBands& bands, Simd simd, ParallelFor parallelFor, bool surfelArrays,
                       const ImageSizes& images, GridTexture texture, std::pmr::memory_resource* memory)
    : CpuBackend(bake, bands, simd, std::move(parallelFor), surfelArrays, images, std::move(texture), memory,
                 leafOrder(bake.hierarchy, bake.surfels.count(), memory)) {}

CpuBackend::CpuBackend(const Bake& bake, const CacheBands& bands, Simd simd, ParallelFor parallelFor, bool surfelArrays,
                       const ImageSizes& images, GridTexture texture, std::pmr::memory_resource* memory,
                       std::pmr::vector<std::uint32_t> order)
    : caches_(bake.caches),
      links_(bake.links, memory),
      cachesKernel_(lightCachesKernel(simd)),
      surfelsKernel_(*lightSurfelsKernel(simd)),
      parallelFor_(std::move(parallelFor)),
      bounce_(caches_, bake.surfels, order, bake.links.kind, bands.lumaBands, memory),
      driven_(bake.emitters, images, memory),
      surfels_(bake.surfels, bake.hierarchy, bake.emitters, std::move(order), surfelArrays, memory),
      tree_(bake.hierarchy, memory),
      lights_(memory),
      node_(bake.hierarchy.nodeCount(), 0, memory),
      light_(bands, bake.caches.count(), bake.caches.firstMapCache(), memory),
      grid_(std::move(texture), memory) {
  grid_.fill(light(), parallelFor_);
}

void CpuBackend::relight(const LightSetup& setup) {
  using Clock = std::chrono::steady_clock;
  const auto ms = [](Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double, std::milli>(to - from).count();
  };
  const auto start = Clock::now();
  if (!setup.materialEmissions.empty()) {
    // Light of surfels that is handed over has their baked emission already.
    driven_.begin(setup.materialEmissions, parallelFor_);
    surfels_.drive(driven_, setup.surfelEmission.empty() ? setup.emissionScale : glm::vec3(0.0f), parallelFor_);
    driven_.end();
  }
  LightSurfelsJob job;
  if (lit_ && setup.bounceScale > 0.0f) bounce_.setLight(surfelsKernel_, light_, job);
  lightSurfels(surfelsKernel_, surfels_, setup, lit_ ? &bounce_ : nullptr, job, lights_, node_, parallelFor_);
  const auto surfels = Clock::now();
  tree_.pull(surfelsKernel_, node_, parallelFor_);
  const auto pulled = Clock::now();
  const auto color = [this](std::uint32_t begin, std::uint32_t end) {
    bounce_.colorCaches(surfelsKernel_, light_, begin, end);
  };
  lightCaches(cachesKernel_, links_, node_, light_, parallelFor_, std::cref(color));
  const auto caches = Clock::now();
  grid_.fill(light(), parallelFor_);
  lit_ = true;
  passMs_ = {ms(start, surfels), ms(surfels, pulled), ms(pulled, caches), ms(caches, Clock::now())};
}

void CpuBackend::reset() {
  lit_ = false;
  light_.clear();
  grid_.fill(light(), parallelFor_);
}

std::vector<glm::vec3> CpuBackend::nodeRadiosity() const {
  std::vector<glm::vec3> radiosity;
  radiosity.reserve(node_.size());
  for (const std::uint32_t node : node_) radiosity.push_back(unpackColor(node));
  return radiosity;
}

std::vector<PassTime> CpuBackend::passTimes() const {
  std::vector<PassTime> times{{"surfels", passMs_[0]}, {"pull", passMs_[1]}, {"caches", passMs_[2]}};
  if (gridTexture()) times.push_back({"grid texture", passMs_[3]});
  return times;
}

std::vector<std::pair<std::string, std::size_t>> CpuBackend::bufferSizes() const {
  const auto bytes = [](const auto& array) { return array.size() * sizeof(array[0]); };
  const CacheGrid& grid = caches_.grid;
  // Of the bake's own, frames and look-ups read positions of the grid's caches and normals of the others.
  const std::size_t places = sizeof(glm::vec3) * caches_.count();
  std::vector<std::pair<std::string, std::size_t>> sizes{
      {"surfels", surfels_.bytes()},
      {"hierarchy", tree_.bytes()},
      {"emission", driven_.bytes()},
      {"radiosity", bytes(node_)},
      {"links", links_.bytes()},
      {"caches", places + light_.bytes()},
      {"bounce", bounce_.bytes()},
      {"index",
       bytes(caches_.lightmap.cache) + bytes(grid.cache) + bytes(grid.brick) + bytes(grid.fine) + bytes(grid.depth)}};
  if (gridTexture()) sizes.emplace_back("grid texture", grid_.bytes());
  return sizes;
}

}  // namespace relume::cpu

namespace relume {

Result<Owned<Backend>> makeCpuBackend(const Bake& bake, const BackendRequest& request) {
  const RelightOptions& options = request.options;
  const Simd simd = cpu::chooseSimd(options.simd);
  if (simd == Simd::best)
    return Error{ErrorCode::usage,
                 "this processor or this build lacks the instruction set asked for in RelightOptions::simd"};
  return Owned<Backend>(makeOwned<cpu::CpuBackend>(request.memory, bake, request.bands, simd, options.parallelFor,
                                                   options.surfelArrays, request.images, makeGridTexture(bake, request),
                                                   request.memory));
}

}  // namespace relume
