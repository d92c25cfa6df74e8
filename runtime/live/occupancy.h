// SPDX-License-Identifier: MIT
// Which cells of a volume hold light (CRC Section 5): those with occupied voxels, or those that the camera sees, and
// their 26 neighbours.
#pragma once

#include "relume/result.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/mat4x3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// What a camera sees, as distances along its viewing axis.
struct DepthView {
  std::span<const float> depth;         // [m] [Size width * height] not above 0 or infinite = nothing is seen
  std::uint32_t width = 0, height = 0;  // [1..16384]
  // The middle of pixel (x, y) is seen at worldFromPixel * (x w, y w, depth, 1), w = depth, or 1 without perspective.
  glm::mat4x3 worldFromPixel{0.0f};
  bool perspective = true;
  std::uint32_t stride = 10;  // [1..1024] pixels between those that are looked at, both ways (CRC Section 5)
};

// usage: a span of another size, a matrix that is not finite, stride out of range, a depth that is NaN.
Status checkDepthView(const DepthView& view);

// 1 for each cell with an occupied voxel. [bits: Size cells]
std::vector<std::uint8_t> occupiedCells(std::span<const std::uint64_t> bits);
// 1 for each cell that holds a place that the camera sees. [view passes checkDepthView()]
std::vector<std::uint8_t> seenCells(const VolumeGrid& grid, const DepthView& view);
// The same with all neighbours of each cell. [Size cells]
std::vector<std::uint8_t> dilate(const VolumeGrid& grid, std::span<const std::uint8_t> cells);

}  // namespace relume
