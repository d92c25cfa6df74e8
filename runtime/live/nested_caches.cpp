// SPDX-License-Identifier: MIT
// See nested_caches.h.
#include "runtime/live/nested_caches.h"

#include "formats/limits.h"
#include "formats/sh.h"
#include "runtime/live/open_air.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <new>
#include <numbers>

namespace relume {

CacheSum skySum(const LiveFrame& frame) {
  constexpr std::uint32_t kSkyRays = 256;
  const LiveRays rays = liveRays(kSkyRays, frame);
  CacheSum sum;
  const float weight = 4.0f * std::numbers::pi_v<float> / static_cast<float>(std::max<std::size_t>(rays.sky.size(), 1));
  for (std::size_t i = 0; i < rays.sky.size(); ++i) {
    std::array<float, 9> basis{};
    evaluateSh(3, rays.direction[i], basis);
    for (std::size_t k = 0; k < 9; ++k) {
      for (std::size_t c = 0; c < 3; ++c)
        sum.coefficients[9 * c + k] += weight * basis[k] * rays.sky[i][static_cast<int>(c)];
    }
    sum.brightest = std::max({sum.brightest, rays.sky[i].x, rays.sky[i].y, rays.sky[i].z});
  }
  return sum;
}

Result<NestedCaches> NestedCaches::create(const LiveOptions& options) {
  Result<LiveCaches> first = LiveCaches::create(options);
  if (!first) return first.error();
  return NestedCaches(std::move(*first));
}

Status NestedCaches::update(NestedVolumes& volumes, const LiveFrame& frame) {
  if (Status ok = checkLiveFrame(frame); !ok) return ok;
  CacheSum sky;
  try {
    while (caches_.size() < volumes.size()) caches_.push_back(caches_.front().withoutLight());
    if (volumes.outermost().grid().roams) sky = skySum(frame);
  } catch (const std::bad_alloc&) {
    return noMemoryForLiveLight();
  }
  while (caches_.size() > volumes.size()) caches_.pop_back();
  for (std::size_t level = 0; level < caches_.size(); ++level) {
    if (Status ok = caches_[level].reflect(volumes[level], frame, level > 0 ? &caches_[level - 1] : nullptr); !ok)
      return ok;
  }
  for (std::size_t level = 0; level < caches_.size(); ++level) {
    if (Status ok = caches_[level].gather(volumes[level], frame, volumes.all().first(level)); !ok) return ok;
  }
  for (std::size_t level = 0; level < caches_.size(); ++level) reach_[level] = volumes[level].reach();
  sky_ = sky;
  return done();
}

void NestedCaches::reset() {
  for (LiveCaches& each : caches_) each.reset();
  sky_ = {};
}

NestedStencil nestedStencil(std::span<const VolumeCaches> caches, const glm::vec3& positionWorld,
                            const glm::vec3& normal) {
  NestedStencil found;
  // Of the sky as well, which has no stencil that looks.
  if (!isWithin(positionWorld, kMaxCoordinate) || !(glm::dot(normal, normal) < 4.0f)) return found;
  float rest = 1.0f;
  for (std::size_t level = caches.size(); level-- > 0 && rest > 0.0f;) {
    const VolumeGrid& grid = caches[level].cells->grid;
    // Outside an inner volume those around it are read; the outermost is read wherever a place is.
    const bool isRead = level == 0 || grid.holdsPlace(positionWorld);
    const float share = isRead ? caches[level].reach.share(grid.toGrid(positionWorld), 0.0f) : 0.0f;
    if (level == 0) found.sky = rest * (1.0f - share);
    if (!(share > 0.0f)) continue;
    found.stencil[level] = checkedStencil(*caches[level].cells, positionWorld, normal);
    // Far from surfaces small cells have no caches, and large ones do.
    const auto& weight = found.stencil[level].weight;
    if (std::all_of(weight.begin(), weight.end(), [](float w) { return w == 0.0f; })) continue;
    found.share[level] = rest * share;
    rest -= found.share[level];
  }
  rest -= found.sky;
  if (rest > 0.0f && rest < 1.0f) {
    for (float& share : found.share) share /= 1.0f - rest;
    found.sky /= 1.0f - rest;
  }
  return found;
}

glm::vec3 nestedIrradiance(std::span<const VolumeCaches> caches, const CacheSum& sky, const NestedStencil& stencil,
                           const glm::vec3& normal) {
  CacheSum sum;
  for (std::size_t level = 0; level < caches.size(); ++level) {
    if (stencil.share[level] > 0.0f)
      sum.add(stencil.stencil[level], stencil.share[level], caches[level].coefficients, caches[level].brightest);
  }
  if (stencil.sky > 0.0f) {
    for (std::size_t i = 0; i < sum.coefficients.size(); ++i) sum.coefficients[i] += stencil.sky * sky.coefficients[i];
    sum.brightest = std::max(sum.brightest, sky.brightest);
  }
  return sum.irradiance(normal);
}

std::array<VolumeCaches, kMaxCascades> NestedCaches::all() const {
  std::array<VolumeCaches, kMaxCascades> all;
  for (std::size_t level = 0; level < caches_.size(); ++level)
    all[level] = {&caches_[level].cells(), reach_[level], caches_[level].coefficients(), caches_[level].brightest()};
  return all;
}

NestedStencil NestedCaches::stencil(const glm::vec3& positionWorld, const glm::vec3& normal) const {
  const auto caches = all();
  return nestedStencil(std::span(caches).first(caches_.size()), positionWorld, normal);
}

glm::vec3 NestedCaches::irradianceBy(const NestedStencil& stencil, const glm::vec3& normal) const {
  const auto caches = all();
  return nestedIrradiance(std::span(caches).first(caches_.size()), sky_, stencil, normal);
}

glm::vec3 NestedCaches::irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const {
  const auto caches = all();
  return receivedIrradiance(std::span(caches).first(caches_.size()), sky_, positionWorld, normal);
}

std::uint32_t NestedCaches::activeCells() const {
  std::uint32_t sum = 0;
  for (const LiveCaches& each : caches_) sum += each.activeCells();
  return sum;
}

std::vector<PassTime> NestedCaches::passTimes() const {
  std::vector<PassTime> sum = caches_.front().passTimes();
  for (std::size_t level = 1; level < caches_.size(); ++level) {
    const std::vector<PassTime> inner = caches_[level].passTimes();
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i].ms += inner[i].ms;
  }
  return sum;
}

std::vector<std::pair<std::string, std::size_t>> NestedCaches::bufferSizes() const {
  auto sum = caches_.front().bufferSizes();
  for (std::size_t level = 1; level < caches_.size(); ++level) {
    const auto inner = caches_[level].bufferSizes();
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i].second += inner[i].second;
  }
  return sum;
}

}  // namespace relume
