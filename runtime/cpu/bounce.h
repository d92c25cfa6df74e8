// SPDX-License-Identifier: MIT
// What the surfels receive from last frame's caches: irradianceOnLightmap() and irradianceInGrid() for receivers that
// never move, each as its ReceiverKind says. The diffuse lobe of up to four bands needs the first nine coefficients
// only (band 3 of the clamped cosine is zero). With more bands tilted and gridded surfels go through resolve.h.
#pragma once

#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "runtime/cpu/light_surfels_job.h"
#include "runtime/shared/resolve.h"
#include "runtime/shared/stored_light.h"

#include <array>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume::cpu {

class Bounce {
 public:
  // The caches must outlive this. `order`: surfels in the order in which they are lit. memory: keeps all of this.
  Bounce(const PackedCaches& caches, const Surfels& surfels, std::span<const std::uint32_t> order, LinkKind kind,
         int lumaBands, std::pmr::memory_resource* memory);
  Bounce(const Bounce&) = delete;
  Bounce& operator=(const Bounce&) = delete;

  // Evaluate the irradiance of those of the caches [begin, end), which have just been lit, that are the light map's,
  // for their own normals.
  void colorCaches(const LightSurfelsKernel& kernel, const StoredLight& light, std::uint32_t begin, std::uint32_t end);
  // Take over last frame's light, which must stay until the surfels are lit and whose caches are all coloured; sets
  // what `job` needs of it.
  void setLight(const StoredLight& light, LightSurfelsJob& job);
  // e += bounceScale * last frame's irradiance at the surfels of a block.
  void add(const LightSurfelsKernel& kernel, const LightSurfelsJob& job, std::uint32_t block, std::uint32_t count,
           float* e) const;
  std::size_t bytes() const;

 private:
  struct BlockBegin {
    std::uint32_t tilted = 0, gridded = 0, cache = 0;
  };

  void addTilted(const Surfels& surfels, std::uint32_t s, std::uint8_t slot);

  const PackedCaches& caches_;
  bool shaped_, normalsCount_;
  std::pmr::vector<BlockBegin> begin_;  // [Size blocks + 1]
  std::pmr::vector<TiltedSurfel> tilted_;
  std::pmr::vector<GriddedSurfel> gridded_;
  std::pmr::vector<std::uint32_t> griddedCache_;  // appendGridShares()
  // [Size caches of the light map] irradiance for a cache's own normal (runtime/shared/pack_color.h)
  std::pmr::vector<std::uint32_t> cacheColor_;
  CacheLight light_;
};

}  // namespace relume::cpu
