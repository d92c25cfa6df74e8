// SPDX-License-Identifier: MIT
// See bounce.h.
#include "runtime/cpu/bounce.h"

#include "formats/pack.h"
#include "formats/sh.h"
#include "runtime/cpu/surfel_set.h"
#include "runtime/shared/pack_color.h"
#include "runtime/shared/receivers.h"
#include "runtime/shared/stencil.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relume::cpu {
namespace {

static_assert(kShareShift == kCacheBits && kShareOne == kMaxShare);

// surfaceLobe() by TiltedSurfel::angle.
const float* lobesByAngle() {
  static const std::array<float, 512> kLobes = [] {
    std::array<float, 512> lobes;
    for (std::size_t i = 0; i < 256; ++i) {
      const SurfaceLobe lobe = surfaceLobe(std::cos(std::numbers::pi_v<float> * static_cast<float>(i) / 255.0f));
      lobes[2 * i] = lobe.linear;
      lobes[2 * i + 1] = lobe.clamped;
    }
    return lobes;
  }();
  return kLobes.data();
}

}  // namespace

Bounce::Bounce(const PackedCaches& caches, const Surfels& surfels, std::span<const std::uint32_t> order, LinkKind kind,
               int lumaBands, std::pmr::memory_resource* memory)
    : caches_(caches),
      shaped_(lumaBands <= 4),
      normalsCount_(normalsCount(kind, lumaBands)),
      begin_(memory),
      tilted_(memory),
      gridded_(memory),
      griddedCache_(memory),
      cacheColor_(memory) {
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    if (i % kSurfelBlock == 0)
      begin_.push_back({static_cast<std::uint32_t>(tilted_.size()), static_cast<std::uint32_t>(gridded_.size()),
                        static_cast<std::uint32_t>(griddedCache_.size())});
    const auto slot = static_cast<std::uint8_t>(i % kSurfelBlock);
    switch (receiverKind(caches.map(), surfels, order[i], normalsCount_)) {
      case ReceiverKind::flat:
        break;
      case ReceiverKind::tilted:
        addTilted(surfels, order[i], slot);
        break;
      case ReceiverKind::gridded: {
        const std::uint32_t shares = appendGridShares(caches, surfels, order[i], griddedCache_);
        gridded_.push_back({slot, static_cast<std::uint8_t>(shares)});
        break;
      }
    }
  }
  begin_.push_back({static_cast<std::uint32_t>(tilted_.size()), static_cast<std::uint32_t>(gridded_.size()),
                    static_cast<std::uint32_t>(griddedCache_.size())});
  if (!caches.map().cache.empty()) cacheColor_.resize(caches.count() - caches.firstMapCache());
  tilted_.shrink_to_fit();
  gridded_.shrink_to_fit();
  griddedCache_.shrink_to_fit();
}

void Bounce::addTilted(const Surfels& surfels, std::uint32_t s, std::uint8_t slot) {
  const Stencil stencil = lightmapStencil(caches_.map(), unpackUnorm16x2(surfels.receiver[s]));
  const float cosine = glm::clamp(glm::dot(meanNormal(caches_.map(), stencil), surfels.normal[s]), -1.0f, 1.0f);
  tilted_.push_back(
      {slot, static_cast<std::uint8_t>(std::lrint(std::acos(cosine) * 255.0f / std::numbers::pi_v<float>))});
}

void Bounce::colorCaches(const LightSurfelsKernel& kernel, const StoredLight& light, std::uint32_t begin,
                         std::uint32_t end) {
  begin = std::max(begin, light.firstMapCache());
  if (cacheColor_.empty() || begin >= end) return;
  ColorCachesJob job;
  job.light = light.mapRows();
  job.normal = caches_.map().normal.data();
  job.normalsCount = normalsCount_;
  // 2 pi y_0 times coefficient 0; a cache without a normal has gathered the whole sphere, and gives half of that.
  job.constant[1] = 2.0f * std::numbers::pi_v<float> * 0.282094792f;
  job.constant[0] = light.bands().irradianceOnMap ? job.constant[1] : 0.5f * job.constant[1];
  job.color = cacheColor_.data();
  kernel.colorCaches(job, begin, end);
}

void Bounce::setLight(const StoredLight& light, LightSurfelsJob& job) {
  light_ = cacheLight(light);
  const PackedMap& map = caches_.map();
  job.color = cacheColor_.data();
  job.mapWidth = static_cast<std::int32_t>(map.width);
  job.mapHeight = static_cast<std::int32_t>(map.height);
  job.mapCache = map.cache.narrow();
  job.wideMapCache = map.cache.wide();
  job.wideFirst = static_cast<std::int32_t>(caches_.firstMapCache());
  job.lobe = lobesByAngle();
  job.thirdBand = light.bands().lumaBands > 2;
  job.gridLight = light.gridRows();
  job.mapLight = light.mapRows();
}

void Bounce::add(const LightSurfelsKernel& kernel, const LightSurfelsJob& job, std::uint32_t block, std::uint32_t count,
                 float* e) const {
  const auto put = [e](std::uint8_t slot, const glm::vec3& v) {
    e[slot] = v.r;
    e[kSurfelBlock + slot] = v.g;
    e[2 * kSurfelBlock + slot] = v.b;
  };
  const BlockBegin begin = begin_[block], end = begin_[block + 1];
  const std::uint32_t first = block * kSurfelBlock;
  // Flat for all, then once more for those that are not.
  std::array<float, 3 * kSurfelBlock> before;
  const std::span<const TiltedSurfel> tilted(tilted_.data() + begin.tilted, end.tilted - begin.tilted);
  for (std::size_t i = 0; i < tilted.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) before[c * kSurfelBlock + i] = e[c * kSurfelBlock + tilted[i].slot];
  }
  if (!cacheColor_.empty()) kernel.addFlatBounce(job, first, count, e);
  if (shaped_) {
    kernel.addTiltedBounce(job, first, tilted.data(), static_cast<std::uint32_t>(tilted.size()), before.data(), e);
  } else {
    for (std::size_t i = 0; i < tilted.size(); ++i) {
      const std::uint32_t s = first + tilted[i].slot;
      const glm::vec2 uv = unpackUnorm16x2(job.word[3][s]);
      const glm::vec3 direct(before[i], before[kSurfelBlock + i], before[2 * kSurfelBlock + i]);
      put(tilted[i].slot,
          direct + job.bounceScale * irradianceOnLightmap(caches_, light_, uv, unpackSurfelNormal(job.word[2][s])));
    }
  }
  const std::span<const GriddedSurfel> gridded(gridded_.data() + begin.gridded, end.gridded - begin.gridded);
  if (shaped_) {
    kernel.addGriddedBounce(job, first, gridded.data(), static_cast<std::uint32_t>(gridded.size()),
                            griddedCache_.data() + begin.cache, e);
    return;
  }
  for (const GriddedSurfel& each : gridded) {
    const std::uint32_t s = first + each.slot;
    const glm::vec3 direct(e[each.slot], e[kSurfelBlock + each.slot], e[2 * kSurfelBlock + each.slot]);
    const glm::vec3 n = unpackSurfelNormal(job.word[2][s]);
    put(each.slot, direct + job.bounceScale * irradianceInGrid(caches_, light_, surfelPosition(job, s), n));
  }
}

std::size_t Bounce::bytes() const {
  const auto bytes = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return bytes(begin_) + bytes(tilted_) + bytes(gridded_) + bytes(griddedCache_) + bytes(cacheColor_);
}

}  // namespace relume::cpu
