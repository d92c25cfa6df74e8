// SPDX-License-Identifier: MIT
// Which of the caches near moving parts are looked at in a frame (RelightOptions::movingLag). The less of a cache's
// view parts cover the more seldom it is, so that what a part's step changes and is not yet seen is alike for all; and
// so seldom that a frame looks at no more caches than its budget. shaders/occlude_links.comp has the same.
#pragma once

#include "relume/caches.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <numbers>
#include <span>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kMaxMovingLag = 64;  // frames

inline constexpr float kMinSolidAngle = 0.02f;  // [sr] of the sphere around a part that is near
// (radius / distance)² of a sphere that covers kMinSolidAngle: 1 - cos² of the half opening angle.
inline constexpr float kMinCovered = [] {
  const float cosine = 1.0f - kMinSolidAngle / (2.0f * std::numbers::pi_v<float>);
  return 1.0f - cosine * cosine;
}();
// Parts that emit act from farther off, at most down to kMinCovered over this (LookTurns::leastOfLamps()).
inline constexpr float kLampReach = 64.0f;
// What reads the grid so near to a part, in radii of its sphere, is mostly the part itself, which must not stand in its
// own light: parts act fully on caches of the grid from the second distance on, and not at all below the first.
inline constexpr float kOwnSpace[2] = {1.5f, 3.0f};
// Of a part alone before a cache that covers less than this a view says what it hides (runtime/moving/shape_views.h),
// of links by how far its sphere covers them; else links are looked at by rays of their own. The second is for parts
// that fill their sphere, as balls do.
inline constexpr float kFarSolidAngle[2] = {0.06f, 2.0f};  // [sr]

// The sphere around a part.
struct PartSphere {
  glm::vec3 centre{0.0f};  // [m]
  float radius = 0.0f;     // [m]
  float ball = 0.0f;       // [m] radius of a ball of the part's outline, where it fills the sphere; 0 = it does not
  bool emits = false;
};

// (radius / distance)² of a part that is near, at most 1: π times that is its solid angle, nearly. 0 = it is not near.
// normal: of a cache on the light map; zero in the grid
inline float coveredBy(const PartSphere& part, const glm::vec3& place, const glm::vec3& normal) {
  const glm::vec3 offset = part.centre - place;
  const float d2 = glm::dot(offset, offset), r2 = part.radius * part.radius;
  if (!(r2 > kMinCovered * d2)) return 0.0f;
  const bool onMap = normal != glm::vec3(0.0f);
  if (onMap ? glm::dot(normal, offset) <= -part.radius : d2 <= kOwnSpace[0] * kOwnSpace[0] * r2) return 0.0f;
  return r2 < d2 ? r2 / d2 : 1.0f;
}

// What is left of the light of a part that emits and is not near, from 1 to 0 where it covers `least`. 0 = it is near,
// or out of reach, or a cache of the light map does not face it, or it does not emit.
inline float lampWeight(const PartSphere& part, float least, const glm::vec3& place, const glm::vec3& normal) {
  if (!part.emits) return 0.0f;
  const glm::vec3 offset = part.centre - place;
  const float d2 = glm::dot(offset, offset), r2 = part.radius * part.radius;
  if (r2 > kMinCovered * d2 || !(r2 > least * d2)) return 0.0f;
  if (normal != glm::vec3(0.0f) && glm::dot(normal, offset) <= 0.0f) return 0.0f;
  const float weight = r2 / (least * d2) - 1.0f;
  return weight < 1.0f ? weight : 1.0f;
}

class LookTurns {
 public:
  static constexpr std::uint32_t kBlock = 64;  // consecutive caches

  // lag: a power of two [1..kMaxMovingLag]. memory: keeps all of this.
  LookTurns(const Caches& caches, std::uint32_t lag, std::pmr::memory_resource* memory);
  LookTurns(const LookTurns&) = delete;
  LookTurns& operator=(const LookTurns&) = delete;

  // A frame begins in which these parts move.
  void begin(std::span<const PartSphere> parts);
  // All near caches are looked at in the next.
  void forget() { frame_ = kForget; }

  // Frames since one in which all were looked at.
  std::uint32_t frame() const { return frame_; }
  std::uint32_t lag() const { return lag_; }
  // Of each kBlock caches the least period of turns, in frames; 0 = no part is near.
  std::span<const std::uint32_t> leastPeriods() const { return leastPeriod_; }
  // What parts that emit cover where their light ends: as little as kLampReach allows while each cache is in reach of
  // two in the mean, and the more the more of them there are.
  float leastOfLamps() const { return leastOfLamps_; }
  // Half of what parts cover of caches that have their turn in every frame.
  float eachFrame() const { return eachFrame_; }
  // Whether a cache may have its turn, and whether it does that parts cover so much of, summed. Periods are powers of
  // two: what becomes nearer or farther between two turns misses none.
  bool mayHaveTurn(std::uint32_t cache) const { return frame_ == 0 || isTurn(cache, leastPeriod_[cache / kBlock]); }
  bool hasTurn(std::uint32_t cache, float covered) const { return frame_ == 0 || isTurn(cache, periodOf(covered)); }
  std::size_t bytes() const { return leastPeriod_.size() * (sizeof(Bounds) + sizeof(std::uint32_t)); }

 private:
  static constexpr std::uint32_t kForget = ~0u;
  // Of a block.
  struct Bounds {
    glm::vec3 centre{0.0f};  // [m]
    float radius = 0.0f;
    glm::vec3 place{0.0f}, normal{0.0f};  // of one of its caches
  };
  std::uint32_t periodOf(float covered) const {
    std::uint32_t period = 1;
    while (period < lag_ && 2.0f * static_cast<float>(period) * covered <= eachFrame_) period *= 2;
    return period;
  }
  bool isTurn(std::uint32_t cache, std::uint32_t period) const {
    // Neighbours have their turns apart: the top 6 bits of a golden-ratio sequence.
    return ((((cache * 0x9E3779B9u) >> 26) + frame_) & (period - 1)) == 0;
  }
  void chooseEachFrame(std::span<const PartSphere> parts);
  void chooseReach(std::span<const PartSphere> parts);

  std::uint32_t lag_, frame_ = kForget;
  float eachFrame_ = 0.0f, leastOfLamps_ = kMinCovered;
  std::pmr::vector<Bounds> bounds_;
  std::pmr::vector<std::uint32_t> leastPeriod_;
};

}  // namespace relume
