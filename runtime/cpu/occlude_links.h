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
//
// What parts change of a cache is kept, and found anew when it is the cache's turn (runtime/shared/look_turns.h); until
// then it is scaled as the radiosity of the sender that they hide most of changes.
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
#include <vector>

namespace relume::cpu {

using LinksTowardKernel = void (*)(const LightCachesJob& job, const LinkCone& cone, std::uint32_t begin,
                                   std::uint32_t count, float* share, std::uint64_t* toward);

class OccludeLinks {
 public:
  // The caches and links must outlive this. bands: of the caches. lag: RelightOptions::movingLag. memory: keeps all of
  // this.
  OccludeLinks(const Bake& bake, const Caches& caches, const LinkSet& links, const CacheBands& bands, std::uint32_t lag,
               Simd simd, std::pmr::memory_resource* memory);

  // A frame begins. hasParts: without, what is kept is of no use any more.
  void begin(bool hasParts) { frame_ = hasParts ? frame_ + 1 : kForget; }
  void forget() { frame_ = kForget; }
  // Find what parts change of the caches [begin, end). node: radiosity (runtime/shared/pack_color.h). Ranges that are
  // apart may be found at the same time.
  void look(const PlacedParts& parts, std::span<const std::uint32_t> node, std::uint32_t begin, std::uint32_t end);
  // What caches gain, as their coefficients, times scales of which 0 = nothing. [Size scale = caches]
  const StoredLight& change() const { return change_; }
  std::span<const float> scale() const { return scale_; }
  std::size_t bytes() const {
    return points_.bytes() + change_.bytes() + kept_.size() * (sizeof(Kept) + sizeof(float));
  }

 private:
  struct Near;
  struct Hidden;
  struct Change;
  struct Candidate;
  // Of a cache: the sender that parts hide most of, and its luma when that was found; 0 = the change is not scaled.
  struct Kept {
    std::uint32_t sender = kNotNear;
    float luma = 0.0f;
  };
  static constexpr std::uint32_t kForget = ~0u, kNotNear = ~0u, kNoChange = ~1u;
  float coveredBy(const PlacedParts& parts, std::uint32_t cache) const;
  void lookAt(const PlacedParts& parts, std::span<const std::uint32_t> node, std::uint32_t cache);
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
  std::uint32_t lag_, frame_ = kForget;  // frame_: counted from one in which all near caches were looked at
  StoredLight change_;
  std::pmr::vector<Kept> kept_;    // [Size caches]
  std::pmr::vector<float> scale_;  // [Size caches]
};

}  // namespace relume::cpu
