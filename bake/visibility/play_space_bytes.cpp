// SPDX-License-Identifier: MIT
// See play_space_bytes.h.
#include "bake/visibility/play_space_bytes.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kMostTreeLevels = 30;  // of a tree
constexpr float kMaxArea = 1e30f;            // [m²]

bool isArea(float area) { return area >= 0.0f && area <= kMaxArea; }
bool isAscending(const std::vector<std::uint64_t>& keys) {
  return std::adjacent_find(keys.begin(), keys.end(), std::greater_equal<>()) == keys.end();
}

// One flag of each side, as 0 or 1.
std::vector<std::uint8_t> flagsOf(const PlaySpace& space, std::uint8_t which) {
  std::vector<std::uint8_t> flags = space.flags.toVector();
  for (std::uint8_t& flag : flags) flag = (flag & which) != 0 ? 1 : 0;
  return flags;
}

// What is read by side.
struct Sides {
  std::vector<float> seenArea, farShare;
  std::vector<std::uint8_t> visible, partly;
};

bool fits(const PlaySpace& space, const Sides& read, std::size_t sides) {
  const auto isFlag = [](std::uint8_t flag) { return flag <= 1; };
  const auto isPoint = [](const glm::vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  };
  return read.seenArea.size() == sides && read.visible.size() == sides &&
         (read.farShare.empty() || read.farShare.size() == sides) &&
         (read.partly.empty() || read.partly.size() == sides) &&
         std::all_of(read.seenArea.begin(), read.seenArea.end(), isArea) &&
         std::all_of(read.farShare.begin(), read.farShare.end(), isArea) &&
         std::all_of(read.visible.begin(), read.visible.end(), isFlag) &&
         std::all_of(read.partly.begin(), read.partly.end(), isFlag) &&
         std::all_of(space.receivers.begin(), space.receivers.end(), isPoint) && std::isfinite(space.seenTotal) &&
         std::isfinite(space.total) && isPoint(space.voxelOrigin) && std::isfinite(space.voxelSize) &&
         (read.partly.empty() || space.voxelSize > 0.0f);
}

}  // namespace

void writePlaySpace(const PlaySpace& space, ByteWriter& to) {
  to.array(std::span<const float>(space.seenArea.toVector()));
  to.array(std::span<const std::uint8_t>(flagsOf(space, PlaySpace::kVisible)));
  to.array(std::span<const float>(space.farShare.toVector()));
  to.value(space.lookedAtMin);
  to.value(space.lookedAtMax);
  to.array(std::span<const glm::vec3>(space.receivers));
  to.value(space.seenTotal);
  to.value(space.total);
  to.value(static_cast<std::uint8_t>(space.scene != nullptr));
  to.array(std::span<const std::uint8_t>(space.scene != nullptr ? flagsOf(space, PlaySpace::kPartly)
                                                                : std::vector<std::uint8_t>()));
  to.array(space.voxels.keys());
  to.value(space.voxelOrigin);
  to.value(space.voxelSize);
  to.value(static_cast<std::uint64_t>(space.tree.levels().size()));
  for (const VoxelIndex& level : space.tree.levels()) to.array(level.keys());
}

std::optional<PlaySpace> readPlaySpace(ByteReader& from, const Scene& scene) {
  PlaySpace space;
  Sides sides;
  std::uint8_t ofScene = 0;
  std::uint64_t levels = 0;
  std::vector<std::uint64_t> keys;
  from.array(sides.seenArea);
  from.array(sides.visible);
  from.array(sides.farShare);
  from.value(space.lookedAtMin);
  from.value(space.lookedAtMax);
  from.array(space.receivers);
  from.value(space.seenTotal);
  from.value(space.total);
  from.value(ofScene);
  from.array(sides.partly);
  from.array(keys);
  from.value(space.voxelOrigin);
  from.value(space.voxelSize);
  from.value(levels);
  if (from.failed() || levels > kMostTreeLevels || !isAscending(keys)) return std::nullopt;
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
  if (!from.isAll() || !fits(space, sides, 2 * std::size_t{scene.triangleCount()})) return std::nullopt;
  space.seenArea = sides.seenArea;
  if (!sides.farShare.empty()) space.farShare = sides.farShare;
  for (std::size_t i = 0; i < sides.partly.size(); ++i) {
    if (sides.partly[i] != 0) sides.visible[i] |= PlaySpace::kPartly;
  }
  space.flags = sides.visible;
  return space;
}

}  // namespace relume
