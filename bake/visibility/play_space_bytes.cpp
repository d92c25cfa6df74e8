// SPDX-License-Identifier: MIT
// See play_space_bytes.h.
#include "bake/visibility/play_space_bytes.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kMaxLevels = 30;  // of a tree
constexpr float kMaxArea = 1e30f;       // [m²]

bool isArea(float area) { return area >= 0.0f && area <= kMaxArea; }
bool isAscending(const std::vector<std::uint64_t>& keys) {
  return std::adjacent_find(keys.begin(), keys.end(), std::greater_equal<>()) == keys.end();
}

bool fits(const PlaySpace& space, std::size_t sides) {
  const auto isFlag = [](std::uint8_t flag) { return flag <= 1; };
  const auto isPoint = [](const glm::vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  };
  return space.seenArea.size() == sides && space.visible.size() == sides &&
         (space.farShare.empty() || space.farShare.size() == sides) &&
         (space.partly.empty() || space.partly.size() == sides) &&
         std::all_of(space.seenArea.begin(), space.seenArea.end(), isArea) &&
         std::all_of(space.farShare.begin(), space.farShare.end(), isArea) &&
         std::all_of(space.visible.begin(), space.visible.end(), isFlag) &&
         std::all_of(space.partly.begin(), space.partly.end(), isFlag) &&
         std::all_of(space.receivers.begin(), space.receivers.end(), isPoint) && std::isfinite(space.seenTotal) &&
         std::isfinite(space.total) && isPoint(space.voxelOrigin) && std::isfinite(space.voxelSize) &&
         (space.partly.empty() || space.voxelSize > 0.0f);
}

}  // namespace

void writePlaySpace(const PlaySpace& space, ByteWriter& to) {
  to.array(std::span<const float>(space.seenArea));
  to.array(std::span<const std::uint8_t>(space.visible));
  to.array(std::span<const float>(space.farShare));
  to.value(space.lookedAtMin);
  to.value(space.lookedAtMax);
  to.array(std::span<const glm::vec3>(space.receivers));
  to.value(space.seenTotal);
  to.value(space.total);
  to.value(static_cast<std::uint8_t>(space.scene != nullptr));
  to.array(std::span<const std::uint8_t>(space.partly));
  to.array(space.voxels.keys());
  to.value(space.voxelOrigin);
  to.value(space.voxelSize);
  to.value(static_cast<std::uint64_t>(space.tree.levels().size()));
  for (const VoxelIndex& level : space.tree.levels()) to.array(level.keys());
}

std::optional<PlaySpace> readPlaySpace(ByteReader& from, const Scene& scene) {
  PlaySpace space;
  std::uint8_t ofScene = 0;
  std::uint64_t levels = 0;
  std::vector<std::uint64_t> keys;
  from.array(space.seenArea);
  from.array(space.visible);
  from.array(space.farShare);
  from.value(space.lookedAtMin);
  from.value(space.lookedAtMax);
  from.array(space.receivers);
  from.value(space.seenTotal);
  from.value(space.total);
  from.value(ofScene);
  from.array(space.partly);
  from.array(keys);
  from.value(space.voxelOrigin);
  from.value(space.voxelSize);
  from.value(levels);
  if (from.failed() || levels > kMaxLevels || !isAscending(keys)) return std::nullopt;
  space.voxels = VoxelIndex(std::move(keys));
  std::vector<VoxelIndex> tree;
  for (std::uint64_t i = 0; i < levels; ++i) {
    std::vector<std::uint64_t> level;
    from.array(level);
    if (from.failed() || !isAscending(level)) return std::nullopt;
    tree.emplace_back(std::move(level));
  }
  if (!tree.empty()) space.tree = VoxelTree({space.voxelOrigin, space.voxelSize}, std::move(tree));
  if (ofScene != 0) space.scene = &scene;
  if (!from.isAll() || !fits(space, 2 * std::size_t{scene.triangleCount()})) return std::nullopt;
  return space;
}

}  // namespace relume
