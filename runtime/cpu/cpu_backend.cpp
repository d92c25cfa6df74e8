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

CpuBackend::CpuBackend(const Bake& bake, const BackendRequest& request, Simd simd, GridTexture texture)
    : CpuBackend(bake, request, simd, std::move(texture),
                 leafOrder(bake.hierarchy, bake.surfels.count(), request.memory)) {}

CpuBackend::CpuBackend(const Bake& bake, const BackendRequest& request, Simd simd, GridTexture texture,
                       std::pmr::vector<std::uint32_t> order)
    : caches_(request.caches),
      links_(bake.links, request.memory),
      cachesKernel_(lightCachesKernel(simd)),
      surfelsKernel_(*lightSurfelsKernel(simd)),
      parallelFor_(request.options.parallelFor),
      bounce_(caches_, bake.surfels, order, bake.links.kind, request.bands.lumaBands, request.memory),
      driven_(bake.emitters, request.images, request.memory),
      surfels_(bake.surfels, bake.hierarchy, bake.emitters, std::move(order), request.options.surfelArrays,
               request.memory),
      tree_(bake.hierarchy, request.memory),
      lights_(request.memory),
      node_(bake.hierarchy.nodeCount(), 0, request.memory),
      light_(request.bands, bake.caches.count(), bake.caches.firstMapCache(), request.memory),
      grid_(std::move(texture), request.memory) {
  if (kHasMovingParts && request.options.movingParts > 0)
    moving_ = makeOwned<Moving>(request.memory, bake, links_, request, simd);
  grid_.fill(light(), parallelFor_);
}

void CpuBackend::relight(const LightSetup& setup) {
  using Clock = std::chrono::steady_clock;
  const auto ms = [](Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double, std::milli>(to - from).count();
  };
  const auto placing = Clock::now();
  // What the parts reflect of last frame's light, before that is gone.
  const bool hasParts = kHasMovingParts && !setup.movingParts.empty();
  if (hasParts) {
    const CacheLight last = light();
    moving_->parts.place(setup, caches_, lit_ ? &last : nullptr, parallelFor_);
    moving_->occluders.turns().begin(moving_->parts.spheres());
  } else if (kHasMovingParts && moving_) {
    moving_->occluders.turns().forget();
  }
  const auto start = Clock::now();
  if (!setup.materialEmissions.empty()) {
    // Light of surfels that is handed over has their baked emission already.
    driven_.begin(setup.materialEmissions, parallelFor_);
    surfels_.drive(driven_, setup.surfelEmission.empty() ? setup.emissionScale : glm::vec3(0.0f), parallelFor_);
    driven_.end();
  }
  LightSurfelsJob job;
  if (lit_ && setup.bounceScale > 0.0f) bounce_.setLight(light_, job);
  lightSurfels(surfelsKernel_, surfels_, setup, lit_ ? &bounce_ : nullptr, job, lights_, node_, parallelFor_);
  const auto surfels = Clock::now();
  tree_.pull(surfelsKernel_, node_, parallelFor_);
  const auto pulled = Clock::now();
  const auto look = [&](std::uint32_t begin, std::uint32_t end) {
    moving_->occluders.look(moving_->parts, node_, begin, end);
  };
  const auto finish = [&](std::uint32_t begin, std::uint32_t end) {
    bounce_.colorCaches(surfelsKernel_, light_, begin, end);
  };
  CacheSteps steps;
  steps.afterwards = std::cref(finish);
  if (hasParts) {
    steps.before = std::cref(look);
    steps.change = &moving_->occluders.change();
    steps.changeNode = moving_->occluders.hiddenMost().data();
    steps.changePerLuma = moving_->occluders.perLuma().data();
  }
  lightCaches(cachesKernel_, links_, node_, light_, parallelFor_, steps);
  const auto caches = Clock::now();
  grid_.fill(light(), parallelFor_);
  lit_ = true;
  passMs_ = {ms(start, surfels), ms(surfels, pulled), ms(pulled, caches), ms(caches, Clock::now()), ms(placing, start)};
}

void CpuBackend::reset() {
  lit_ = false;
  if (kHasMovingParts && moving_) moving_->occluders.turns().forget();
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
  if (kHasMovingParts && moving_) times.push_back({"moving parts", passMs_[4]});
  return times;
}

std::vector<std::pair<std::string, std::size_t>> CpuBackend::bufferSizes() const {
  const auto bytes = [](const auto& array) { return array.size() * sizeof(array[0]); };
  std::vector<std::pair<std::string, std::size_t>> sizes{
      {"surfels", surfels_.bytes()}, {"hierarchy", tree_.bytes()},   {"emission", driven_.bytes()},
      {"radiosity", bytes(node_)},   {"links", links_.bytes()},      {"caches", caches_.placeBytes() + light_.bytes()},
      {"bounce", bounce_.bytes()},   {"index", caches_.indexBytes()}};
  if (gridTexture()) sizes.emplace_back("grid texture", grid_.bytes());
  if (kHasMovingParts && moving_)
    sizes.emplace_back("moving parts", moving_->occluders.bytes() + moving_->parts.bytes());
  return sizes;
}

}  // namespace relume::cpu

namespace relume {

Result<Owned<Backend>> makeCpuBackend(const Bake& bake, const BackendRequest& request) {
  const Simd simd = cpu::chooseSimd(request.options.simd);
  if (simd == Simd::best)
    return Error{ErrorCode::usage,
                 "this processor or this build lacks the instruction set asked for in RelightOptions::simd"};
  return Owned<Backend>(makeOwned<cpu::CpuBackend>(request.memory, bake, request, simd, makeGridTexture(request)));
}

}  // namespace relume
