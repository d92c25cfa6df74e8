// SPDX-License-Identifier: MIT
// See occlude_links.h; the kernel is links_toward_kernel.h.
#include "runtime/cpu/occlude_links.h"

#include "formats/color.h"
#include "runtime/cpu/read_link.h"
#include "runtime/cpu/simd.h"
#include "runtime/shared/pack_color.h"
#include "runtime/voxels/march.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

namespace relume::cpu {
namespace {

constexpr std::uint32_t kMaxParts = 256;  // RelightOptions::movingParts
constexpr float kMinSolidAngle = 0.02f;   // [sr] of the sphere around a part
// A receiver in the grid that close to a part's middle is the part itself, which must not be in its own shadow.
constexpr float kOwnSpace = 1.05f;    // of the sphere's radius
constexpr float kSenderEnd = 0.999f;  // of the way to a sender: the part behind it, or on it, hides nothing

// (radius / distance)² of a sphere that covers kMinSolidAngle: 1 - cos² of the half opening angle.
constexpr float kMinShare = [] {
  const float cosine = 1.0f - kMinSolidAngle / (2.0f * std::numbers::pi_v<float>);
  return 1.0f - cosine * cosine;
}();

LinksTowardKernel linksTowardKernel(Simd simd) {
  switch (chooseSimd(simd)) {
#if defined(RELUME_X86_KERNELS)
    case Simd::avx512:
      return linksTowardAvx512;
    case Simd::avx2:
      return linksTowardAvx2;
#endif
    default:
      return linksTowardBaseline;
  }
}

bool knowDirections(LinkKind kind) { return kind == LinkKind::cone || kind == LinkKind::oct6; }

// Whether the cone of half opening angle asin(radius / distance) about an offset meets another.
bool meets(const glm::vec3& offset, float radius, const LinkCone& cone) {
  const float d2 = glm::dot(offset, offset), r2 = radius * radius;
  if (!(r2 < d2)) return true;  // infinite as well
  const float d = std::sqrt(d2), sine = radius / d, cosine = std::sqrt(1.0f - r2 / d2);
  const float along = offset.x * cone.axis[0] + offset.y * cone.axis[1] + offset.z * cone.axis[2];
  return along >= d * (cone.cosine * cosine - cone.sine * sine);
}

}  // namespace

// The parts that a cache looks at.
struct OccludeLinks::Near {
  std::array<std::uint16_t, kMaxParts> part;
  std::array<LinkCone, kMaxParts> cone;
  std::array<bool, kMaxParts> isAround;  // the cache is within the part's sphere
  std::uint32_t count = 0;
};

// What parts hide of a link, of 1, and the radiosity times share that is there in its place.
struct OccludeLinks::Hidden {
  float share = 0.0f;
  glm::vec3 radiosity{0.0f};
};

OccludeLinks::OccludeLinks(const Bake& bake, const Caches& caches, const LinkSet& links, Simd simd,
                           std::pmr::memory_resource* memory)
    : caches_(caches),
      links_(links),
      irradianceOnMap_(bake.links.kind == LinkKind::irradiance),
      toward_(knowDirections(bake.links.kind) ? linksTowardKernel(simd) : nullptr),
      points_(bake.hierarchy, bake.surfels, toward_ == nullptr, memory) {}

bool OccludeLinks::findNear(const PlacedParts& parts, std::uint32_t cache, bool onMap, Near& near) const {
  const glm::vec3 place = caches_.positionWorld[cache];
  near.count = 0;
  for (std::size_t i = 0; i < parts.parts().size(); ++i) {
    const PlacedPart& part = parts.parts()[i];
    const glm::vec3 offset = part.centre - place;
    const float d2 = glm::dot(offset, offset), r2 = part.radius * part.radius;
    if (!(r2 > kMinShare * d2)) continue;
    if (onMap ? glm::dot(caches_.normal[cache], offset) <= -part.radius : d2 < kOwnSpace * kOwnSpace * r2) continue;
    const std::uint32_t n = near.count++;
    near.part[n] = static_cast<std::uint16_t>(i);
    near.isAround[n] = !(r2 < d2);
    LinkCone& cone = near.cone[n];
    const float d = std::sqrt(d2);
    for (int k = 0; k < 3; ++k) cone.axis[k] = d > 0.0f ? offset[k] / d : 0.0f;
    cone.sine = std::min(part.radius / d, 1.0f);
    cone.cosine = std::sqrt(std::max(1.0f - r2 / d2, 0.0f));
  }
  return near.count > 0;
}

// Bits of the links begin .. begin + count - 1 whose senders a part may hide. [count <= kTowardLinks]
void OccludeLinks::findToward(const LightCachesJob& job, const Near& near, std::uint32_t cache, std::uint32_t begin,
                              std::uint32_t count, std::uint64_t* toward) const {
  const glm::vec3 place = caches_.positionWorld[cache];
  for (std::uint32_t i = 0; i < near.count; ++i) {
    if (near.isAround[i]) {
      for (std::uint32_t k = 0; k < count; ++k) toward[k / 64] |= std::uint64_t{1} << (k % 64);
    } else if (toward_ != nullptr) {
      toward_(job, near.cone[i], begin, count, toward);
    } else {
      RowReader row(job, cache);
      for (std::uint32_t k = 0; k < count; ++k) {
        const SenderPoints::Sphere& sphere = points_.sphere(row.node(begin + k));
        if (meets(sphere.centre - place, sphere.radius, near.cone[i])) toward[k / 64] |= std::uint64_t{1} << (k % 64);
      }
    }
  }
}

// Rays to places on a node; those that the cache or the sender turns its back on do not count.
OccludeLinks::Hidden OccludeLinks::look(const PlacedParts& parts, const Near& near, std::uint32_t cache, bool onMap,
                                        std::uint32_t node) const {
  const glm::vec3 place = caches_.positionWorld[cache], normal = caches_.normal[cache];
  Hidden hidden;
  float all = 0.0f;
  for (std::uint32_t i = 0; i < points_.count(node); ++i) {
    const SenderPoints::Point& point = points_.point(node, i);
    glm::vec3 direction = point.place;
    float length = std::numeric_limits<float>::infinity(), weight = 1.0f;
    if (point.normal != SenderPoints::kSkyPoint) {
      const glm::vec3 way = point.place - place;
      const float d2 = glm::dot(way, way);
      length = std::sqrt(d2);
      direction = way / length;
      weight = -glm::dot(unpackOctahedral(point.normal), direction) / d2;
    }
    if (onMap) {
      const float cosine = glm::dot(normal, direction);
      if (!(cosine > 0.0f)) continue;
      if (irradianceOnMap_) weight *= cosine;
    }
    if (!(weight > 0.0f)) continue;
    all += weight;
    // The first part on the way
    float end = kSenderEnd * length;
    const glm::vec3* met = nullptr;
    for (std::uint32_t k = 0; k < near.count; ++k) {
      const PlacedPart& part = parts.parts()[near.part[k]];
      const glm::vec3 offset = part.centre - place;
      const float along = glm::dot(offset, direction), r2 = part.radius * part.radius;
      if (glm::dot(offset, offset) - along * along > r2 || along < -part.radius || along - part.radius > end) continue;
      const VolumeGrid& grid = part.shape->grid;
      const glm::vec3 inShape = part.toShape * direction;
      VoxelMarch march(grid, part.shape->bits.data(), grid.toGrid(part.pointInShape(place)), inShape / grid.voxel);
      const MarchHit hit = march.first(std::min(end, along + 2.0f * part.radius));
      if (!hit.found) continue;
      end = hit.t;
      met = &parts.radiosityAt(part, hit.voxel, inShape);
    }
    if (met == nullptr) continue;
    hidden.share += weight;
    hidden.radiosity += weight * *met;
  }
  if (all > 0.0f) {
    hidden.share /= all;
    hidden.radiosity /= all;
  }
  return hidden;
}

void OccludeLinks::occlude(const PlacedParts& parts, std::span<const std::uint32_t> node, std::uint32_t begin,
                           std::uint32_t end, StoredLight& light) const {
  LightCachesJob job{links_.rows()};
  const CacheBands& bands = light.bands();
  Near near;
  CacheLight::Row changed, of;
  for (std::uint32_t cache = begin; cache < end; ++cache) {
    const bool onMap = caches_.normal[cache] != glm::vec3(0.0f);
    if (!findNear(parts, cache, onMap, near)) continue;
    // The map's links of a channel have as many bands as its caches.
    const bool isStoredAsMap = cache >= light.firstMapCache();
    const int luma = isStoredAsMap ? bands.onMap(bands.lumaBands) : bands.lumaBands,
              chroma = isStoredAsMap ? bands.onMap(bands.chromaBands) : bands.chromaBands;
    const auto lumaCount = static_cast<std::size_t>(luma * luma),
               chromaCount = static_cast<std::size_t>(chroma * chroma);
    RowReader row(job, cache);
    bool isRead = false;
    const std::uint32_t rowEnd = job.rowBegin[cache + 1];
    for (std::uint32_t at = job.rowBegin[cache]; at < rowEnd; at += kTowardLinks) {
      const std::uint32_t count = std::min(kTowardLinks, rowEnd - at);
      std::array<std::uint64_t, kTowardLinks / 64> toward{};
      findToward(job, near, cache, at, count, toward.data());
      for (std::uint32_t word = 0; word < toward.size(); ++word) {
        for (std::uint64_t bits = toward[word]; bits != 0; bits &= bits - 1) {
          const std::uint32_t link = at + 64 * word + static_cast<std::uint32_t>(std::countr_zero(bits)),
                              sender = row.node(link);
          const Hidden hidden = look(parts, near, cache, onMap, sender);
          if (hidden.share == 0.0f) continue;
          if (!isRead) light.read(cache, changed.c);
          isRead = true;
          row.coefficients(link, luma, of.c);
          const glm::vec3 color = rgbToYCoCg(hidden.radiosity - hidden.share * unpackColor(node[sender]));
          float* const channel = changed.c;
          for (std::size_t i = 0; i < lumaCount; ++i) channel[i] += color.x * of.c[i];
          for (std::size_t i = 0; i < chromaCount; ++i) {
            channel[bands.lumaCount() + i] += color.y * of.c[i];
            channel[bands.lumaCount() + bands.chromaCount() + i] += color.z * of.c[i];
          }
        }
      }
    }
    if (isRead) light.write(cache, changed.c);
  }
}

}  // namespace relume::cpu
