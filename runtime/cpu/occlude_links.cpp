// SPDX-License-Identifier: MIT
// See occlude_links.h; the kernel is links_toward_kernel.h.
#include "runtime/cpu/occlude_links.h"

#include "formats/color.h"
#include "formats/sh.h"
#include "runtime/cpu/read_link.h"
#include "runtime/cpu/simd.h"
#include "runtime/shared/look_turns.h"
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

constexpr float kMinSolidAngle = 0.02f;  // [sr] of the sphere around a part
// What reads the grid so near to a part, in radii of its sphere, is mostly the part itself, which must not stand in its
// own light: parts act fully on caches of the grid from the second distance on, and not at all below the first.
constexpr float kOwnSpace[2] = {1.5f, 3.0f};
// A part alone before a cache that covers less than this is looked at by some rays, and links by how far its sphere
// covers them; else links by rays of their own.
constexpr float kFarSolidAngle = 0.06f;  // [sr]
constexpr std::uint32_t kFarRays = 4;
// On a disc of radius 1, in rings of equal area: direction and distance from its middle
constexpr float kFarDisc[kFarRays][3] = {
    {1.0f, 0.0f, 0.354f}, {-0.737f, 0.675f, 0.612f}, {0.087f, -0.996f, 0.791f}, {0.608f, 0.794f, 0.935f}};
constexpr float kRays = 8.0f;                             // of links' own, spread over the sphere's cone, at least
constexpr std::uint32_t kMostRays = SenderPoints::kMost;  // of a link
constexpr float kMostScale = 2.0f;                        // of a change that was found in other light
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

// Share of a cone about a unit direction that another covers: as the kernel has it.
float coveredShare(const glm::vec3& direction, float cosine, const LinkCone& cone) {
  cosine = std::clamp(cosine, -0.9995f, 0.9995f);
  const float along = direction.x * cone.axis[0] + direction.y * cone.axis[1] + direction.z * cone.axis[2];
  const float c = cone.cosine * cosine, s = cone.sine * std::sqrt(1.0f - cosine * cosine);
  return std::min((along - c + s) / (2.0f * s), 1.0f) * (1.0f - cone.cosine) / (1.0f - c);
}

// Whether the plane of a sender crosses the axis of a cone beyond a distance; of one seen from the side the sender
// itself counts.
bool isBehind(const SenderPoints::Point& sender, const glm::vec3& place, const LinkCone& cone, float distance) {
  if (sender.isSky) return true;
  const glm::vec3 way = sender.place - place, axis(cone.axis[0], cone.axis[1], cone.axis[2]);
  const glm::vec3 normal(sender.normal[0], sender.normal[1], sender.normal[2]);
  const float facing = glm::dot(normal, axis);
  if (facing < -0.1f * 127.0f) return glm::dot(normal, way) < distance * facing;
  return glm::dot(way, way) > distance * distance;
}

float lumaOf(std::uint32_t radiosity) { return rgbToYCoCg(unpackColor(radiosity)).x; }

// f = y_0 * solid angle / pi, y_0 = 1 / sqrt(4 pi)
constexpr float kSolidAngle = std::numbers::pi_v<float> / 0.282094792f;

}  // namespace

// The parts that a cache looks at.
struct OccludeLinks::Near {
  struct Part {
    const PlacedPart* part;
    glm::vec3 offset;  // [m] of the sphere's middle
    float distance2, radius2;
    glm::vec3 placeInGrid;  // of the cache [voxels]
  };
  std::array<Part, kMaxMovingParts> part;
  std::array<LinkCone, kMaxMovingParts> cone;
  std::array<bool, kMaxMovingParts> isAround;  // the cache is within the part's sphere
  std::uint32_t count = 0;
  float rayDensity = 0.0f;  // [1/sr]
  bool onMap = false;       // the cache lies on a surface
  float weight = 1.0f;      // of what is changed
  bool isFar = false;       // of one part, which kFarSolidAngle says is far
};

// What parts hide of a link: its share, the radiosity times share that is there in its place, and the directions times
// share.
struct OccludeLinks::Hidden {
  float share = 0.0f;
  glm::vec3 radiosity{0.0f}, direction{0.0f};
};

OccludeLinks::OccludeLinks(const Bake& bake, const Caches& caches, const LinkSet& links, const CacheBands& bands,
                           std::uint32_t lag, Simd simd, std::pmr::memory_resource* memory)
    : caches_(caches),
      links_(links),
      irradianceOnMap_(bake.links.kind == LinkKind::irradiance),
      toward_(knowDirections(bake.links.kind) ? linksTowardKernel(simd) : nullptr),
      points_(bake.hierarchy, bake.surfels, memory),
      lag_(lag),
      change_(bands, caches.count(), caches.firstMapCache(), memory),
      kept_(caches.count(), Kept{}, memory),
      scale_(caches.count(), 0.0f, memory) {}

// How much of what a cache sees parts near to it cover, as isTurnOf() counts it; 0 = none is near.
float OccludeLinks::coveredBy(const PlacedParts& parts, std::uint32_t cache) const {
  const glm::vec3 place = caches_.positionWorld[cache], normal = caches_.normal[cache];
  const bool onMap = normal != glm::vec3(0.0f);
  float covered = 0.0f;
  for (const PlacedPart& part : parts.parts()) {
    const glm::vec3 offset = part.centre - place;
    const float d2 = glm::dot(offset, offset), r2 = part.radius * part.radius;
    if (!(r2 > kMinShare * d2)) continue;
    if (onMap ? glm::dot(normal, offset) <= -part.radius : d2 <= kOwnSpace[0] * kOwnSpace[0] * r2) continue;
    covered += r2 < d2 ? r2 / d2 : 1.0f;
  }
  return covered;
}

bool OccludeLinks::findNear(const PlacedParts& parts, std::uint32_t cache, Near& near) const {
  const glm::vec3 place = caches_.positionWorld[cache];
  near.count = 0;
  near.weight = 1.0f;
  near.onMap = caches_.normal[cache] != glm::vec3(0.0f);
  float smallest = 1.0f;  // share of the sphere, nearly
  for (std::size_t i = 0; i < parts.parts().size(); ++i) {
    const PlacedPart& part = parts.parts()[i];
    const glm::vec3 offset = part.centre - place;
    const float d2 = glm::dot(offset, offset), r2 = part.radius * part.radius;
    if (!(r2 > kMinShare * d2)) continue;
    if (near.onMap) {
      if (glm::dot(caches_.normal[cache], offset) <= -part.radius) continue;
    } else {
      if (d2 <= kOwnSpace[0] * kOwnSpace[0] * r2) continue;
      const float own = std::sqrt(d2 / r2) - kOwnSpace[0];
      near.weight = std::min(near.weight, own / (kOwnSpace[1] - kOwnSpace[0]));
    }
    const std::uint32_t n = near.count++;
    near.part[n] = {&part, offset, d2, r2, part.pointInGrid(place)};
    smallest = std::min(smallest, r2 / d2);
    near.isAround[n] = !(r2 < d2);
    LinkCone& cone = near.cone[n];
    const float d = std::sqrt(d2);
    for (int k = 0; k < 3; ++k) cone.axis[k] = d > 0.0f ? offset[k] / d : 0.0f;
    cone.sine = std::min(part.radius / d, 1.0f);
    cone.cosine = std::sqrt(std::max(1.0f - r2 / d2, 0.0f));
  }
  near.rayDensity = kRays / (std::numbers::pi_v<float> * smallest);
  near.isFar = near.count == 1 && smallest < kFarSolidAngle / std::numbers::pi_v<float>;
  return near.count > 0;
}

// Links of a row that a part may hide: a bit for each, and of how much of it the sphere around the last part covers.
struct OccludeLinks::Toward {
  std::array<std::uint64_t, kTowardLinks / 64> bits{};
  std::array<float, kTowardLinks> share;
};

// Of the links begin .. begin + count - 1. [count <= kTowardLinks]
void OccludeLinks::findToward(const LightCachesJob& job, const Near& near, std::uint32_t cache, std::uint32_t begin,
                              std::uint32_t count, Toward& toward) const {
  const glm::vec3 place = caches_.positionWorld[cache], normal = caches_.normal[cache];
  for (std::uint32_t i = 0; i < near.count; ++i) {
    if (near.isAround[i]) {
      for (std::uint32_t k = 0; k < count; ++k) toward.bits[k / 64] |= std::uint64_t{1} << (k % 64);
      continue;
    }
    if (toward_ != nullptr) {
      toward_(job, near.cone[i], begin, count, toward.share.data(), toward.bits.data());
      continue;
    }
    // Links that know no direction: the middle of their senders, and a cone by what they transfer.
    RowReader row(job, cache);
    for (std::uint32_t k = 0; k < count; ++k) {
      const SenderPoints::Point& middle = points_.point(row.node(begin + k), 0, 1);
      const glm::vec3 direction = middle.isSky ? middle.place : glm::normalize(middle.place - place);
      float solidAngle = kSolidAngle * row.transfer(begin + k);
      // f = 2 y_0 * share of the irradiance: the cosine is in it
      if (near.onMap && irradianceOnMap_) solidAngle *= 0.5f / std::max(glm::dot(normal, direction), 0.1f);
      toward.share[k] = coveredShare(direction, 1.0f - solidAngle / (2.0f * std::numbers::pi_v<float>), near.cone[i]);
      if (toward.share[k] > -1.0f) toward.bits[k / 64] |= std::uint64_t{1} << (k % 64);
    }
  }
}

// A sender that parts may hide.
struct OccludeLinks::Candidate {
  std::uint32_t node, rays;
  float transfer, share;
};

// Whether a ray meets a part before `end`, which becomes the distance of the first, and the radiosity there. direction:
// unit.
bool OccludeLinks::meet(const PlacedParts& parts, const Near& near, const glm::vec3& direction, float& end,
                        glm::vec3& radiosity) const {
  bool isMet = false;
  for (std::uint32_t k = 0; k < near.count; ++k) {
    const Near::Part& each = near.part[k];
    const float along = glm::dot(each.offset, direction);
    const float inside2 = each.radius2 - each.distance2 + along * along;  // half the chord, squared
    if (!(inside2 > 0.0f)) continue;
    const float half = std::sqrt(inside2);
    if (along + half <= 0.0f || along - half >= end) continue;
    const MovingShape& shape = *each.part->shape;
    const glm::vec3 inGrid = each.part->toGrid * direction;
    const MarchHit hit =
        VoxelMarch(shape.grid, shape.bits.data(), each.placeInGrid, inGrid).first(std::min(end, along + 1.1f * half));
    if (!hit.found) continue;
    end = hit.t;
    radiosity = parts.lightAt(*each.part, hit.voxel, inGrid).seenFrom(hit.t, each.part->radius);
    isMet = true;
  }
  return isMet;
}

// Rays to places on a node; those that the cache or the sender turns its back on do not count.
OccludeLinks::Hidden OccludeLinks::look(const PlacedParts& parts, const Near& near, std::uint32_t cache,
                                        const Candidate& candidate) const {
  const glm::vec3 place = caches_.positionWorld[cache], normal = caches_.normal[cache];
  Hidden hidden;
  float all = 0.0f;
  for (std::uint32_t i = 0; i < candidate.rays; ++i) {
    const SenderPoints::Point& point = points_.point(candidate.node, i, candidate.rays);
    glm::vec3 direction = point.place;
    float length = std::numeric_limits<float>::infinity(), weight = 1.0f;
    if (!point.isSky) {
      const glm::vec3 way = point.place - place;
      const float d2 = glm::dot(way, way);
      length = std::sqrt(d2);
      direction = way / length;
      if (candidate.rays > 1)
        weight = -glm::dot(glm::vec3(point.normal[0], point.normal[1], point.normal[2]), direction) / d2;
    }
    if (near.onMap && candidate.rays > 1) {
      const float cosine = glm::dot(normal, direction);
      if (!(cosine > 0.0f)) continue;
      if (irradianceOnMap_) weight *= cosine;
    }
    if (!(weight > 0.0f)) continue;
    all += weight;
    float end = kSenderEnd * length;
    glm::vec3 radiosity;
    if (!meet(parts, near, direction, end, radiosity)) continue;
    hidden.share += weight;
    hidden.radiosity += weight * radiosity;
    hidden.direction += weight * direction;
  }
  if (hidden.share > 0.0f) {
    hidden.share /= all;
    hidden.radiosity /= all;
    hidden.direction /= all;
  }
  return hidden;
}

// What a part far off hides of its sphere, by rays spread over the cone toward it: the distance of what they meet as
// well.
OccludeLinks::Hidden OccludeLinks::lookAround(const PlacedParts& parts, const Near& near, float& distance) const {
  const LinkCone& cone = near.cone[0];
  const glm::vec3 axis(cone.axis[0], cone.axis[1], cone.axis[2]);
  const glm::vec3 side =
      glm::normalize(std::abs(axis.x) < 0.7f ? glm::vec3(0.0f, axis.z, -axis.y) : glm::vec3(-axis.z, 0.0f, axis.x));
  const glm::vec3 up = glm::cross(axis, side);
  Hidden hidden;
  distance = 0.0f;
  for (const auto& at : kFarDisc) {
    // Where a lattice of equal areas has its points, on the disc that the sphere is from here
    const float radius = cone.sine * at[2];
    const glm::vec3 direction = glm::normalize(axis + radius * (at[0] * side + at[1] * up));
    float t = std::numeric_limits<float>::infinity();
    glm::vec3 radiosity;
    if (!meet(parts, near, direction, t, radiosity)) continue;
    hidden.share += 1.0f;
    hidden.radiosity += radiosity;
    hidden.direction += direction;
    distance += t;
  }
  if (hidden.share == 0.0f) return hidden;
  distance /= hidden.share;
  hidden.radiosity /= hidden.share;
  hidden.direction /= hidden.share;
  hidden.share /= static_cast<float>(kFarRays);
  return hidden;
}

// What a cache loses and gains, as one cone of light.
struct OccludeLinks::Change {
  glm::vec3 color{0.0f};      // Y, Co, Cg: transfer times radiosity
  glm::vec3 direction{0.0f};  // times transfer
  float transfer = 0.0f;
  std::uint32_t sender = 0;  // of which most is hidden
  float hidden = 0.0f;       // of it: luma

  // Add it to a cache's coefficients. [Size c = bands.stride()]
  void addTo(const CacheBands& bands, int luma, int chroma, bool isIrradiance, float* c) const {
    std::array<float, kMaxCoefficients> basis;
    basis[0] = 1.0f;
    const float length = glm::length(direction);
    if (!isIrradiance && luma > 1 && length > 0.0f) {
      // A cone of the same first band: its mean direction is as long as that of the rays.
      std::array<float, kMaxBands> ratio;
      coneBandRatios(luma, std::clamp(2.0f * length / transfer - 1.0f, -1.0f, 1.0f), ratio);
      evaluateSh(luma, direction / length, basis);
      const float scale = 1.0f / basis[0];
      for (int l = 0; l < luma; ++l) {
        for (int i = l * l; i < (l + 1) * (l + 1); ++i)
          basis[static_cast<std::size_t>(i)] *= scale * ratio[static_cast<std::size_t>(l)];
      }
    } else {
      luma = chroma = 1;
    }
    const auto lumaCount = static_cast<std::size_t>(luma * luma),
               chromaCount = static_cast<std::size_t>(chroma * chroma);
    float *co = c + bands.lumaCount(), *cg = co + bands.chromaCount();
    for (std::size_t i = 0; i < lumaCount; ++i) c[i] += color.x * basis[i];
    for (std::size_t i = 0; i < chromaCount; ++i) {
      co[i] += color.y * basis[i];
      cg[i] += color.z * basis[i];
    }
  }
};

// What parts change of the light of a cache; false where they change nothing.
bool OccludeLinks::findChange(const PlacedParts& parts, std::span<const std::uint32_t> node, const LightCachesJob& job,
                              const Near& near, std::uint32_t cache, Change& change) const {
  float distance = 0.0f, inFront = 0.0f;  // inFront: transfer that the sphere covers, of senders before a far part
  const Hidden far = near.isFar ? lookAround(parts, near, distance) : Hidden{};
  if (near.isFar && far.share == 0.0f) return false;
  // A sender behind the part, which hides the share of it that the sphere does, as far as the part fills that.
  const auto behind = [&](const Candidate& each) {
    if (!isBehind(points_.point(each.node, 0, 1), caches_.positionWorld[cache], near.cone[0], distance)) {
      inFront += each.transfer * each.share;
      return Hidden{};
    }
    const float share = each.share * far.share;
    return Hidden{share, share * far.radiosity, share * far.direction};
  };
  RowReader row(job, cache);
  const std::uint32_t rowEnd = job.rowBegin[cache + 1];
  for (std::uint32_t at = job.rowBegin[cache]; at < rowEnd; at += kTowardLinks) {
    const std::uint32_t count = std::min(kTowardLinks, rowEnd - at);
    Toward toward;
    findToward(job, near, cache, at, count, toward);
    // List the senders first, so that what is read of them is on its way.
    std::array<Candidate, kTowardLinks> candidate;
    std::uint32_t candidates = 0;
    for (std::uint32_t word = 0; 64 * word < count; ++word) {
      for (std::uint64_t bits = toward.bits[word]; bits != 0; bits &= bits - 1) {
        const std::uint32_t index = 64 * word + static_cast<std::uint32_t>(std::countr_zero(bits));
        Candidate& each = candidate[candidates];
        each.node = row.node(at + index);
        each.transfer = row.transfer(at + index);
        each.share = toward.share[index];
        if (!(each.transfer > 0.0f) || (near.isFar && !(each.share > 0.0f))) continue;
        points_.prefetch(each.node);
        ++candidates;
      }
    }
    for (std::uint32_t i = 0; i < candidates; ++i) {
      Candidate& each = candidate[i];
      const float wanted =
          near.isFar ? 1.0f : std::min(kSolidAngle * each.transfer * near.rayDensity, 1.0f * kMostRays);
      each.rays = std::clamp(static_cast<std::uint32_t>(wanted), 1u, std::min(points_.count(each.node), kMostRays));
      points_.prefetch(each.node, each.rays);
    }
    for (std::uint32_t i = 0; i < candidates; ++i) {
      const Candidate& each = candidate[i];
      const Hidden hidden = near.isFar ? behind(each) : look(parts, near, cache, each);
      if (hidden.share == 0.0f) continue;
      const glm::vec3 taken = each.transfer * hidden.share * unpackColor(node[each.node]);
      change.color += each.transfer * hidden.radiosity - taken;
      const float luma = rgbToYCoCg(taken).x;
      if (luma >= change.hidden) {
        change.hidden = luma;
        change.sender = each.node;
      }
      change.direction += each.transfer * hidden.direction;
      change.transfer += each.transfer * hidden.share;
    }
  }
  change.color = near.weight * rgbToYCoCg(change.color);
  // Cones are wider than their senders: a far part most of which is hidden is left out.
  return change.transfer > inFront * far.share;
}

// Find what parts change of a cache that is near.
void OccludeLinks::lookAt(const PlacedParts& parts, std::span<const std::uint32_t> node, std::uint32_t cache) {
  Near near;
  Change change;
  Kept& kept = kept_[cache];
  kept.sender = kNoChange;
  if (!findNear(parts, cache, near) || !findChange(parts, node, {links_.rows()}, near, cache, change)) return;
  kept.sender = change.sender;
  kept.luma = lumaOf(node[change.sender]);
  // The map's caches may have fewer bands.
  const CacheBands& bands = change_.bands();
  const bool isOfMap = cache >= change_.firstMapCache();
  const CacheBands held = isOfMap ? bands.ofMap() : bands;
  std::array<float, 3 * kMaxCoefficients> c{};
  change.addTo(bands, held.lumaBands, held.chromaBands, isOfMap && irradianceOnMap_, c.data());
  change_.write(cache, c.data());
}

void OccludeLinks::look(const PlacedParts& parts, std::span<const std::uint32_t> node, std::uint32_t begin,
                        std::uint32_t end) {
  for (std::uint32_t cache = begin; cache < end; ++cache) {
    Kept& kept = kept_[cache];
    const float covered = coveredBy(parts, cache);
    if (covered == 0.0f) {
      kept.sender = kNotNear;
    } else if (frame_ == 0 || kept.sender == kNotNear || isTurnOf(cache, frame_, covered, lag_)) {
      lookAt(parts, node, cache);
    }
    float& scale = scale_[cache];
    if (kept.sender >= kNoChange) {
      scale = 0.0f;
    } else {
      scale = kept.luma > 0.0f ? std::min(lumaOf(node[kept.sender]) / kept.luma, kMostScale) : 1.0f;
    }
  }
}

}  // namespace relume::cpu
