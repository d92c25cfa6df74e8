// SPDX-License-Identifier: MIT
// What a bake's hierarchy and links look like: which cluster a surfel belongs to, and which clusters a cache reads
// (PIC Fig. 4). Plain data for overlays.
#pragma once

#include "relume/bake_data.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace relume {

// The node of that level of the hierarchy above each surfel; of a surfel that is a leaf above it, the leaf. [Size n_S]
std::vector<std::uint32_t> clustersAtLevel(const Bake& bake, std::uint32_t level);

// A colour for a cluster, by its number: neighbours' differ.
glm::vec3 clusterColor(std::uint32_t node);

// A link as it can be drawn.
struct DrawnLink {
  std::uint32_t node = 0;
  float transfer = 0.0f;   // f of the link: how much arrives
  bool isSky = false;      // then `centre` is a direction
  glm::vec3 centre{0.0f};  // [m] mean of the cluster's surfels, or of its patches' directions
};

class ClusterLinks {
 public:
  explicit ClusterLinks(const Bake& bake);

  // The cache that a receiver at that point, seen from `eye`, reads most of: the nearest on a surface that faces the
  // eye, or one in the air where that is nearer. Nothing for a bake without caches.
  std::optional<std::uint32_t> cacheAt(const glm::vec3& positionWorld, const glm::vec3& eye) const;
  // [Size: the cache's links]
  std::vector<DrawnLink> linksOf(std::uint32_t cache) const;
  // The node of the cache's links above each surfel, or kNoNode: what it does not read. [Size n_S]
  static constexpr std::uint32_t kNoNode = 0xFFFFFFFFu;
  std::vector<std::uint32_t> clustersOf(std::span<const DrawnLink> links) const;

 private:
  const Bake* bake_;
  std::vector<glm::vec3> centre_;       // of each node [m], or a direction
  std::vector<std::uint32_t> surfels_;  // below each node; 0 = sky
};

}  // namespace relume
