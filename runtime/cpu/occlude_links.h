// SPDX-License-Identifier: MIT
// Moving parts before links (PIC Section 6): a cache for which the sphere around a part covers more than 0.02 sr looks
// at its links inside the cone toward that sphere. What a part hides of a link has the part's radiosity in place of the
// sender's: of near parts the share of rays, from the cache to places on the sender, that meet the part; of far ones
// the share of the link's cone that the sphere covers, as far as some rays say that the part fills it.
//
// What stands still is before the part where a ray ends at its sender before it gets there: the part is not met, and
// the link stays as it was. Senders are what caches see, so that is what standing geometry hides; no voxels of the
// level are needed, and walls are no thicker than they are.
// Deviation: PIC gives this as future work and names no method.
#pragma once

#include "relume/bake_data.h"
#include "runtime/cpu/light_caches_job.h"
#include "runtime/cpu/links_toward_job.h"
#include "runtime/cpu/placed_parts.h"
#include "runtime/shared/link_set.h"
#include "runtime/shared/sender_points.h"
#include "runtime/shared/stored_light.h"

#include <cstdint>
#include <memory_resource>
#include <span>

namespace relume::cpu {

using LinksTowardKernel = void (*)(const LightCachesJob& job, const LinkCone& cone, std::uint32_t begin,
                                   std::uint32_t count, float* share, std::uint64_t* toward);

class OccludeLinks {
 public:
  // The caches and links must outlive this. memory: keeps all of this.
  OccludeLinks(const Bake& bake, const Caches& caches, const LinkSet& links, Simd simd,
               std::pmr::memory_resource* memory);

  // Light the caches [begin, end), which have just been lit, again where parts are before their links. node: radiosity
  // (runtime/shared/pack_color.h). Others keep their bits.
  void occlude(const PlacedParts& parts, std::span<const std::uint32_t> node, std::uint32_t begin, std::uint32_t end,
               StoredLight& light) const;
  std::size_t bytes() const { return points_.bytes(); }

 private:
  struct Near;
  struct Hidden;
  struct Change;
  struct Candidate;
  bool findNear(const PlacedParts& parts, std::uint32_t cache, Near& near) const;
  bool findChange(const PlacedParts& parts, std::span<const std::uint32_t> node, const LightCachesJob& job,
                  const Near& near, std::uint32_t cache, Change& change) const;
  struct Toward;
  void findToward(const LightCachesJob& job, const Near& near, std::uint32_t cache, std::uint32_t begin,
                  std::uint32_t count, Toward& toward) const;
  Hidden lookAround(const PlacedParts& parts, const Near& near, float& distance) const;
  bool meet(const PlacedParts& parts, const Near& near, const glm::vec3& direction, float& end,
            glm::vec3& radiosity) const;
  Hidden look(const PlacedParts& parts, const Near& near, std::uint32_t cache, const Candidate& candidate) const;

  const Caches& caches_;
  const LinkSet& links_;
  bool irradianceOnMap_;      // links of the map's caches weigh by the cosine at the cache
  LinksTowardKernel toward_;  // null = links know no direction, the senders' spheres are looked at
  SenderPoints points_;
};

}  // namespace relume::cpu
