// SPDX-License-Identifier: MIT
// See occupancy.h.
#include "runtime/live/occupancy.h"

#include <glm/common.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <string>

namespace relume {
namespace {

constexpr std::uint32_t kMaxWidth = 16384, kMaxStride = 1024;

Error depthViewError(const std::string& what) { return {ErrorCode::usage, "depth view: " + what}; }

}  // namespace

Status checkDepthView(const DepthView& view) {
  if (view.width < 1 || view.height < 1 || view.width > kMaxWidth || view.height > kMaxWidth)
    return depthViewError(std::to_string(view.width) + " x " + std::to_string(view.height) + " pixels, expected 1 to " +
                          std::to_string(kMaxWidth) + " each way");
  if (view.depth.size() != std::size_t{view.width} * view.height)
    return depthViewError(std::to_string(view.depth.size()) + " depths, expected one for each of " +
                          std::to_string(view.width) + " x " + std::to_string(view.height) + " pixels");
  if (view.stride < 1 || view.stride > kMaxStride)
    return depthViewError("a stride of " + std::to_string(view.stride) + " pixels, expected 1 to " +
                          std::to_string(kMaxStride));
  for (int c = 0; c < 4; ++c) {
    for (int r = 0; r < 3; ++r) {
      if (!std::isfinite(view.worldFromPixel[c][r]))
        return depthViewError("worldFromPixel has a number that is not finite");
    }
  }
  for (std::size_t i = 0; i < view.depth.size(); ++i) {
    if (std::isnan(view.depth[i]))
      return depthViewError("the depth of pixel " + std::to_string(i) + " is not a number");
  }
  return done();
}

std::vector<std::uint8_t> occupiedCells(std::span<const std::uint64_t> bits) {
  std::vector<std::uint8_t> cells(bits.size());
  for (std::size_t c = 0; c < bits.size(); ++c) cells[c] = bits[c] != 0 ? 1 : 0;
  return cells;
}

std::vector<std::uint8_t> seenCells(const VolumeGrid& grid, const DepthView& view) {
  std::vector<std::uint8_t> cells(grid.cellCount(), 0);
  for (std::uint32_t y = view.stride / 2; y < view.height; y += view.stride) {
    for (std::uint32_t x = view.stride / 2; x < view.width; x += view.stride) {
      const float depth = view.depth[std::size_t{y} * view.width + x];
      if (!(depth > 0.0f) || !std::isfinite(depth)) continue;
      const float w = view.perspective ? depth : 1.0f;
      const glm::vec4 pixel(static_cast<float>(x) * w, static_cast<float>(y) * w, depth, 1.0f);
      const glm::vec3 at = glm::floor(grid.toGrid(view.worldFromPixel * pixel));
      const glm::vec3 size(grid.voxels());
      bool isInside = true;  // false for NaN
      for (int a = 0; a < 3; ++a) isInside = isInside && at[a] >= 0.0f && at[a] < size[a];
      if (isInside) cells[grid.cellOf(glm::ivec3(at))] = 1;
    }
  }
  return cells;
}

std::vector<std::uint8_t> dilate(const VolumeGrid& grid, std::span<const std::uint8_t> cells) {
  std::vector<std::uint8_t> wide(cells.begin(), cells.end()), before;
  // Along one axis after the other: the neighbours of neighbours are all 26.
  const glm::ivec3 step(1, grid.cells.x, grid.cells.x * grid.cells.y);
  for (int axis = 0; axis < 3; ++axis) {
    before = wide;
    for (std::uint32_t c = 0; c < wide.size(); ++c) {
      if (before[c] == 0) continue;
      const int at = grid.cellAt(c)[axis];
      if (at > 0) wide[c - static_cast<std::uint32_t>(step[axis])] = 1;
      if (at + 1 < grid.cells[axis]) wide[c + static_cast<std::uint32_t>(step[axis])] = 1;
    }
  }
  return wide;
}

}  // namespace relume
