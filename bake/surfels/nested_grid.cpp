// SPDX-License-Identifier: MIT
// See nested_grid.h.
#include "bake/surfels/nested_grid.h"

#include "bake/visibility/surface_parts.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

constexpr double kMaxRootTiles = 64.0;  // along an edge
constexpr int kMaxDepth = 12;           // 4^12 x 64 tiles along an edge: metres on the scale of an orbit
// A needle is as narrow as one tile of its grid is in one direction, so every tile along its long edge would be
// divided. Its tiles stay coarser.
constexpr std::size_t kMaxNeedleTiles = 1u << 18;

}  // namespace

NestedGrid::NestedGrid(const PlaySpace& playSpace, std::uint32_t side, const std::array<glm::vec3, 3>& corner,
                       float width, float margin)
    : playSpace_(playSpace),
      side_(side),
      corner_(corner),
      margin_(margin),
      isNeedle_(isNeedle(corner, 0.5f * glm::length(crossOf(corner)))) {
  double longest = 0.0;
  for (std::size_t k = 0; k < 3; ++k)
    longest = std::max(longest, glm::length(glm::dvec3(corner[(k + 1) % 3]) - glm::dvec3(corner[k])));
  double along = std::max(1.0, longest / static_cast<double>(width));
  int depth = 0;
  for (; along > kMaxRootTiles && depth < kMaxDepth; ++depth) along /= SurfelMap::kInnerAlong;
  root_ = static_cast<std::uint32_t>(std::ceil(std::min(along, kMaxRootTiles)));
  tile_.assign(std::size_t{root_} * root_, kNone);
  for (std::uint32_t i = 0; i < root_ * root_; ++i)
    divide(i, glm::dvec2(i % root_, i / root_) / static_cast<double>(root_), 1.0 / root_, depth);
}

// Whether a square of the barycentric plane is seen at some point, or is near one that is.
bool NestedGrid::wanted(const glm::dvec2& at, double width) const {
  if (at.x + at.y > 1.0) return false;
  glm::vec3 low(INFINITY), high(-INFINITY);
  for (int k = 0; k < 4; ++k) {
    const glm::dvec2 b = at + width * glm::dvec2(k & 1, k >> 1);
    const glm::vec3 p(glm::dvec3(corner_[0]) + b.x * glm::dvec3(corner_[1] - corner_[0]) +
                      b.y * glm::dvec3(corner_[2] - corner_[0]));
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return playSpace_.mayBeSeenIn(side_, low - margin_, high + margin_);
}

void NestedGrid::divide(std::uint32_t tile, const glm::dvec2& at, double width, int depth) {
  if (!wanted(at, width)) return;
  if (depth == 0 || (isNeedle_ && tile_.size() > kMaxNeedleTiles)) {
    glm::dvec2 middle = at + 0.5 * width;
    if (middle.x + middle.y > 1.0) middle /= middle.x + middle.y;
    leaf_.push_back({tile, glm::vec2(middle)});
    return;
  }
  constexpr std::uint32_t kAlong = SurfelMap::kInnerAlong;
  const auto first = static_cast<std::uint32_t>(tile_.size());
  tile_[tile] = first;
  inner_.push_back(tile);
  tile_.resize(tile_.size() + kAlong * kAlong, kNone);
  const double inner = width / kAlong;
  for (std::uint32_t k = 0; k < kAlong * kAlong; ++k)
    divide(first + k, at + inner * glm::dvec2(k % kAlong, k / kAlong), inner, depth - 1);
}

void NestedGrid::append(SurfelMap& map, SurfelMap::Side& side) const {
  const auto base = static_cast<std::uint32_t>(map.tile.size());
  map.tile.insert(map.tile.end(), tile_.begin(), tile_.end());
  for (const std::uint32_t tile : inner_) map.tile[base + tile] = SurfelMap::innerFrom(base + tile_[tile]);
  side = {};
  side.firstTile = base;
  side.columns = root_ & 0x7Fu;
  side.rows = root_ & 0x7Fu;
  side.nested = 1;
}

}  // namespace relume
