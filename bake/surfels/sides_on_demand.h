// SPDX-License-Identifier: MIT
// Sides of one tile that the map from hits to surfels looks up when a hit asks for them: in a level of many small
// triangles, rays meet few of the sides. What is found is what the whole map would hold.
#pragma once

#include "bake/surfels/sorted_surfels.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/scene.h"

#include <glm/vec3.hpp>

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

namespace relume {

// What both sides of a triangle have in common.
struct TriangleShape {
  std::uint32_t index = kNone;  // scene-wide
  std::uint32_t instance = 0;
  std::array<glm::vec3, 3> corner{};
  glm::vec3 normal{0.0f};  // geometricNormal()

  static TriangleShape of(const Scene& scene, std::uint32_t instance, std::uint32_t triangle);
  // A point of a side of it, as the cost sees it.
  MapPoint pointOn(const Scene& scene, std::uint32_t side, const glm::vec2& barycentric) const;
};

// Thread-safe.
class SidesOnDemand {
 public:
  // The scene must outlive it. isSearched: instances [Size instances] whose sides are looked up here. lookups: about as
  // many are expected; memory is up to 8 bytes each.
  SidesOnDemand(const Scene& scene, const PlaySpace& playSpace, const SortedSurfels& near, const SortedSurfels& far,
                std::vector<bool> isSearched, double lookups);

  bool isSearched(std::uint32_t instance) const { return isSearched_[instance]; }
  // The surfel of a side of such an instance; kNone when none is near.
  std::uint32_t at(std::uint32_t side) const;

 private:
  std::uint32_t search(std::uint32_t side) const;

  const Scene& scene_;
  SortedSurfels near_, far_;
  std::vector<bool> isSearched_;
  std::vector<bool> isSeen_, isFar_;  // [Size sides, 0 or sides]
  // Answers by a hash of their side, the side + 1 above the surfel. One that takes another's place costs a search.
  mutable std::vector<std::atomic<std::uint64_t>> known_;
  int shift_ = 0;
};

// Instances whose sides all have one tile where tiles are `width` [m] wide or wider, and that do not emit.
std::vector<bool> instancesOfOneTile(const Scene& scene, float width);

}  // namespace relume
