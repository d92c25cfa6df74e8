// SPDX-License-Identifier: MIT
// Moving parts before links (PIC Section 6): a cache for which the sphere around a part covers more than 0.02 sr looks
// at its links inside the cone toward that sphere. What a part hides of a link has the part's radiosity in place of the
// sender's: of near parts the share of rays, from the cache to places on the sender, that meet the part; of far ones
// the share of the link's cone that the sphere covers, as far as a view of the part says that it fills it
// (runtime/moving/shape_views.h).
//
// What emits is seen from farther off (lampWeight()): each such lamp has a view and a cone of light of its own.
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
#include "runtime/shared/look_turns.h"
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
  // The links must outlive this. bands: of the caches. lag: RelightOptions::movingLag. memory: keeps all of
  // this.
  OccludeLinks(const Bake& bake, const LinkSet& links, const CacheBands& bands, std::uint32_t lag, Simd simd,
               std::pmr::memory_resource* memory);

  LookTurns& turns() { return turns_; }
  // Find what parts change of the caches [begin, end). node: radiosity (runtime/shared/pack_color.h). Ranges that are
  // apart may be found at the same time.
  void look(const PlacedParts& parts, std::span<const std::uint32_t> node, std::uint32_t begin, std::uint32_t end);
  // What caches gain, as their coefficients, of which node parts hide most, negative where they change nothing, and
  // 1 / its luma when that was found; 0 = the change is not scaled.
  const StoredLight& change() const { return change_; }
  std::span<const std::int32_t> hiddenMost() const { return hiddenMost_; }
  std::span<const float> perLuma() const { return perLuma_; }
  std::size_t bytes() const;

 private:
  struct Near;
  struct Hidden;
  struct Change;
  struct LampChange;
  struct Candidate;
  static constexpr std::int32_t kNoChange = -1, kNotNear = -2;
  void lookAt(const PlacedParts& parts, std::span<const std::uint32_t> node, std::uint32_t cache, Near& near);
  bool findNear(const PlacedParts& parts, std::uint32_t cache, Near& near) const;
  bool findChange(const PlacedParts& parts, std::span<const std::uint32_t> node, const LightCachesJob& job,
                  const Near& near, std::uint32_t cache, Change& change) const;
  float farScale(const Near& near, std::uint32_t cache, float found) const;
  struct Toward;
  void findToward(const LightCachesJob& job, const Near& near, std::uint32_t cache, std::uint32_t begin,
                  std::uint32_t count, Toward& toward) const;
  bool meet(const PlacedParts& parts, const Near& near, const glm::vec3& direction, float& end,
            glm::vec3& radiosity) const;
  Hidden look(const PlacedParts& parts, const Near& near, std::uint32_t cache, const Candidate& candidate) const;

  Caches caches_;  // of the bake, positions and normals alone
  const LinkSet& links_;
  bool irradianceOnMap_;      // links of the map's caches weigh by the cosine at the cache
  LinksTowardKernel toward_;  // null = links know no direction, the senders' spheres are looked at
  SenderPoints points_;
  LookTurns turns_;
  StoredLight change_;
  std::pmr::vector<std::int32_t> hiddenMost_;  // [Size caches, and kLightRowRoom more]
  std::pmr::vector<float> perLuma_;            // of as many
};

}  // namespace relume::cpu
