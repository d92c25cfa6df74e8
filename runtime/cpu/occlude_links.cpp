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

constexpr float kRays = 8.0f;                             // of links' own, spread over the sphere's cone, at least
constexpr std::uint32_t kMostRays = SenderPoints::kMost;  // of a link
constexpr float kSenderEnd = 0.999f;  // of the way to a sender: the part behind it, or on it, hides nothing

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

// f = y_0 * solid angle / pi, y_0 = 1 / sqrt(4 pi)
constexpr float kSolidAngle = std::numbers::pi_v<float> / 0.282094792f;

}  // namespace

// The parts that a cache looks at.
struct OccludeLinks::Near {
  struct Part {
    const PlacedPart* part;
    glm::vec3 offset;  // [m] of the sphere's middle
    float distance2, radius2;
    float ball2;            // of a ball that is met in place of the part's voxels; 0 = none
    glm::vec3 placeInGrid;  // of the cache [voxels]
  };
  std::array<Part, kMaxMovingParts> part;
  std::array<LinkCone, kMaxMovingParts> cone;
  std::array<bool, kMaxMovingParts> isAround;  // the cache is within the part's sphere
  std::uint32_t count = 0;
  float rayDensity = 0.0f;                  // [1/sr]
  bool onMap = false;                       // the cache lies on a surface
  float weight = 1.0f;                      // of what is changed
  const PlacedParts::View* view = nullptr;  // of one part, which kFarSolidAngle says is far

  void clear(bool isOnMap) {
    count = 0;
    weight = 1.0f;
    onMap = isOnMap;
    view = nullptr;
  }
  void add(const PlacedPart& each, const glm::vec3& place) {
    const PartSphere& sphere = each.sphere;
    const glm::vec3 offset = sphere.centre - place;
    const float d2 = glm::dot(offset, offset), d = std::sqrt(d2), r2 = sphere.radius * sphere.radius,
                ball2 = sphere.ball * sphere.ball;
    part[count] = {&each, offset, d2, r2, d2 > ball2 ? ball2 : 0.0f, each.pointInGrid(place)};
    isAround[count] = !(r2 < d2);
    LinkCone& toward = cone[count];
    for (int k = 0; k < 3; ++k) toward.axis[k] = d > 0.0f ? offset[k] / d : 0.0f;
    toward.isExact = false;
    // Of lamps that are not near a wider one: links leave gaps between their cones.
    const float covered = std::clamp(r2 / d2, kMinCovered, 1.0f);
    toward.sine = std::sqrt(covered);
    toward.cosine = std::sqrt(1.0f - covered);
    ++count;
  }
  // The one part is far.
  void viewPart(const PlacedParts& parts, const glm::vec3& place) {
    view = &parts.viewFrom(*part[0].part, place);
    cone[0].isExact = true;
  }
};

// What parts hide of a link: its share, the radiosity times share that is there in its place, and the directions times
// share.
struct OccludeLinks::Hidden {
  float share = 0.0f;
  glm::vec3 radiosity{0.0f}, direction{0.0f};
};

OccludeLinks::OccludeLinks(const Bake& bake, const LinkSet& links, const CacheBands& bands, std::uint32_t lag,
                           Simd simd, std::pmr::memory_resource* memory)
    : caches_{bake.caches.positionWorld, bake.caches.normal, {}, {}},
      links_(links),
      irradianceOnMap_(bake.links.kind == LinkKind::irradiance),
      toward_(knowDirections(bake.links.kind) ? linksTowardKernel(simd) : nullptr),
      points_(bake.hierarchy, bake.surfels, memory),
      turns_(caches_, lag, memory),
      change_(bands, bake.caches.count(), bake.caches.firstMapCache(), memory),
      hiddenMost_(bake.caches.count() + kLightRowRoom, kNotNear, memory),
      perLuma_(hiddenMost_.size(), 0.0f, memory) {}

std::size_t OccludeLinks::bytes() const {
  return caches_.count() * 2 * sizeof(glm::vec3) + points_.bytes() + turns_.bytes() + change_.bytes() +
         hiddenMost_.size() * 2 * sizeof(float);
}

bool OccludeLinks::findNear(const PlacedParts& parts, std::uint32_t cache, Near& near) const {
  const glm::vec3 place = caches_.positionWorld[cache];
  near.clear(caches_.normal[cache] != glm::vec3(0.0f));
  float smallest = 1.0f;  // share of the sphere, nearly
  for (const PlacedPart& part : parts.parts()) {
    if (coveredBy(part.sphere, place, caches_.normal[cache]) == 0.0f) continue;
    near.add(part, place);
    const float r2 = near.part[near.count - 1].radius2, d2 = near.part[near.count - 1].distance2;
    smallest = std::min(smallest, r2 / d2);
    if (!near.onMap)
      near.weight = std::min(near.weight, (std::sqrt(d2 / r2) - kOwnSpace[0]) / (kOwnSpace[1] - kOwnSpace[0]));
  }
  near.rayDensity = kRays / (std::numbers::pi_v<float> * smallest);
  if (near.count == 1) {
    const bool isBall = near.part[0].part->sphere.ball > 0.0f;
    if (std::numbers::pi_v<float> * smallest < kFarSolidAngle[isBall]) near.viewPart(parts, place);
  }
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
    const bool isBall = each.ball2 > 0.0f;
    // Half the chord, squared, by the way to the ray: by the distance it would be less exact.
    const glm::vec3 toRay = each.offset - along * direction;
    const float inside2 = (isBall ? each.ball2 : each.radius2) - glm::dot(toRay, toRay);
    if (!(inside2 > 0.0f)) continue;
    const float half = std::sqrt(inside2);
    if (along + half <= 0.0f || along - half >= end) continue;
    const MovingShape& shape = *each.part->shape;
    const glm::vec3 inGrid = each.part->toGrid * direction;
    glm::ivec3 voxel;
    if (isBall) {
      end = along - half;
      voxel = glm::clamp(glm::ivec3(each.placeInGrid + end * inGrid), glm::ivec3(0), shape.grid.voxels() - 1);
    } else {
      const MarchHit hit =
          VoxelMarch(shape.grid, shape.bits.data(), each.placeInGrid, inGrid).first(std::min(end, along + 1.1f * half));
      if (!hit.found) continue;
      end = hit.t;
      voxel = hit.voxel;
    }
    radiosity = parts.lightAt(*each.part, voxel, inGrid).seenFrom(end, each.part->sphere.radius);
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

// What a cache loses and gains, as one cone of light.
struct OccludeLinks::Change {
  glm::vec3 color{0.0f};      // Y, Co, Cg: transfer times radiosity
  glm::vec3 direction{0.0f};  // times transfer
  float transfer = 0.0f;
  std::uint32_t sender = 0x7FFFFFFFu;  // of which most is hidden; of those alike the first
  float hidden = 0.0f;                 // of it: luma

  void scale(float by) {
    color *= by;
    direction *= by;
    transfer *= by;
  }
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

// What lamps that are not near give a cache, as one cone of light: their directions by how much each changes.
struct OccludeLinks::LampChange {
  Change sum;

  bool any() const { return sum.transfer > 0.0f; }
  void add(const Change& each) {
    const float weight = std::abs(each.color.x);
    sum.color += each.color;
    sum.direction += weight / each.transfer * each.direction;
    sum.transfer += weight;
  }
};

// By what the links toward a far part, which leave gaps and overlap, take too little or too much: found of the transfer
// that it covers.
float OccludeLinks::farScale(const Near& near, std::uint32_t cache, float found) const {
  constexpr float kMostScale = 4.0f;
  const Near::Part& part = near.part[0];
  const float cosine = std::sqrt(1.0f - part.radius2 / part.distance2);
  float wanted = near.view->share * 2.0f * std::numbers::pi_v<float> * (1.0f - cosine) / kSolidAngle;
  if (near.onMap) {
    const float height = glm::dot(caches_.normal[cache], part.offset);
    if (height < part.part->sphere.radius) return 1.0f;  // not all of it is above the horizon
    if (irradianceOnMap_) wanted *= 2.0f * height / std::sqrt(part.distance2);
  }
  return std::min(wanted / found, kMostScale);
}

// What parts change of the light of a cache; false where they change nothing.
bool OccludeLinks::findChange(const PlacedParts& parts, std::span<const std::uint32_t> node, const LightCachesJob& job,
                              const Near& near, std::uint32_t cache, Change& change) const {
  float inFront = 0.0f;  // transfer that the sphere covers, of senders before a far part
  // Of a far part: what the sphere's directions have of it.
  Hidden far;
  float distance = 0.0f;
  if (near.view != nullptr) {
    if (near.view->share == 0.0f) return false;
    distance = std::max(std::sqrt(near.part[0].distance2) - near.view->depth, 0.0f);
    far.share = near.view->share;
    far.radiosity = near.view->light.seenFrom(distance, near.part[0].part->sphere.radius);
    far.direction = {near.cone[0].axis[0], near.cone[0].axis[1], near.cone[0].axis[2]};
  }
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
  const std::uint32_t rowEnd = rowBegin(job, cache + 1);
  for (std::uint32_t at = rowBegin(job, cache); at < rowEnd; at += kTowardLinks) {
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
        if (!(each.transfer > 0.0f) || (near.view != nullptr && !(each.share > 0.0f))) continue;
        points_.prefetch(each.node);
        __builtin_prefetch(&node[each.node]);
        ++candidates;
      }
    }
    for (std::uint32_t i = 0; i < candidates; ++i) {
      Candidate& each = candidate[i];
      each.rays = 1;
      if (near.view == nullptr) {
        const float wanted = std::min(kSolidAngle * each.transfer * near.rayDensity, 1.0f * kMostRays);
        each.rays = std::clamp(static_cast<std::uint32_t>(wanted), 1u, std::min(points_.count(each.node), kMostRays));
      }
      points_.prefetch(each.node, each.rays);
    }
    for (std::uint32_t i = 0; i < candidates; ++i) {
      const Candidate& each = candidate[i];
      const Hidden hidden = near.view != nullptr ? behind(each) : look(parts, near, cache, each);
      if (hidden.share == 0.0f) continue;
      const glm::vec3 taken = each.transfer * hidden.share * unpackColor(node[each.node]);
      change.color += each.transfer * hidden.radiosity - taken;
      const float luma = rgbToYCoCg(taken).x;
      if (luma > change.hidden || (luma == change.hidden && each.node < change.sender)) {
        change.hidden = luma;
        change.sender = each.node;
      }
      change.direction += each.transfer * hidden.direction;
      change.transfer += each.transfer * hidden.share;
    }
  }
  change.color = near.weight * rgbToYCoCg(change.color);
  // Cones are wider than their senders: a far part most of which is hidden is left out.
  inFront *= far.share;
  if (!(change.transfer > inFront)) return false;
  if (near.view != nullptr) change.scale(farScale(near, cache, change.transfer + inFront));
  return true;
}

// Find what parts change of a cache that is near some, or in reach of lamps.
void OccludeLinks::lookAt(const PlacedParts& parts, std::span<const std::uint32_t> node, std::uint32_t cache,
                          Near& near) {
  const LightCachesJob job{links_.rows()};
  const glm::vec3 place = caches_.positionWorld[cache], normal = caches_.normal[cache];
  Change change;
  const bool changes = findNear(parts, cache, near) && findChange(parts, node, job, near, cache, change);
  LampChange lamps;
  for (const PlacedPart& part : parts.parts()) {
    const float weight = lampWeight(part.sphere, turns_.leastOfLamps(), place, normal);
    if (weight == 0.0f) continue;
    near.clear(normal != glm::vec3(0.0f));
    near.add(part, place);
    near.viewPart(parts, place);
    near.weight = weight;
    Change each;
    if (findChange(parts, node, job, near, cache, each)) lamps.add(each);
  }
  hiddenMost_[cache] = kNoChange;
  if (!changes && !lamps.any()) return;
  hiddenMost_[cache] = changes ? static_cast<std::int32_t>(change.sender) : 0;
  perLuma_[cache] = 0.0f;
  // What lamps give does not go with the light that is hidden.
  if (changes && std::abs(change.color.x) >= std::abs(lamps.sum.color.x)) {
    const float luma = rgbToYCoCg(unpackColor(node[change.sender])).x;
    perLuma_[cache] = luma > 0.0f ? 1.0f / luma : 0.0f;
  }
  // The map's caches may have fewer bands.
  const CacheBands& bands = change_.bands();
  const bool isOfMap = cache >= change_.firstMapCache();
  const CacheBands held = isOfMap ? bands.ofMap() : bands;
  std::array<float, 3 * kMaxCoefficients> c;
  std::fill_n(c.begin(), bands.stride(), 0.0f);
  const auto add = [&](const Change& each) {
    each.addTo(bands, held.lumaBands, held.chromaBands, isOfMap && irradianceOnMap_, c.data());
  };
  if (changes) add(change);
  if (lamps.any()) add(lamps.sum);
  change_.write(cache, c.data());
}

void OccludeLinks::look(const PlacedParts& parts, std::span<const std::uint32_t> node, std::uint32_t begin,
                        std::uint32_t end) {
  Near near;
  for (std::uint32_t cache = begin; cache < end; ++cache) {
    const std::uint32_t block = cache / LookTurns::kBlock;
    if (turns_.leastPeriods()[block] == 0) {
      const std::uint32_t blockEnd = std::min(end, (block + 1) * LookTurns::kBlock);
      std::fill_n(hiddenMost_.data() + cache, blockEnd - cache, kNotNear);
      cache = blockEnd - 1;
      continue;
    }
    if (!turns_.mayHaveTurn(cache)) continue;
    const glm::vec3 place = caches_.positionWorld[cache], normal = caches_.normal[cache];
    float covered = 0.0f;
    bool isReached = false;
    for (const PartSphere& part : parts.spheres()) {
      covered += coveredBy(part, place, normal);
      isReached = isReached || lampWeight(part, turns_.leastOfLamps(), place, normal) > 0.0f;
    }
    if (covered == 0.0f && !isReached) {
      hiddenMost_[cache] = kNotNear;
    } else if (hiddenMost_[cache] == kNotNear || turns_.hasTurn(cache, covered)) {
      lookAt(parts, node, cache, near);
    }
  }
}

}  // namespace relume::cpu
