// SPDX-License-Identifier: MIT
// See triangle_runs.h.
#include "runtime/voxels/triangle_runs.h"

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// Snapping rounds to a step, and its factors to 30 bits; this is more than both.
constexpr double kMargin = kVoxelSteps;
// Beyond it snapping holds places back, and a sum of them may come out anywhere. [steps]
constexpr double kFarRun = 0x1p+28;

}  // namespace

RunsOutside::RunsOutside(const VolumeGrid& grid, const SnapBox& box, const glm::mat4x3& toWorld) {
  const double scale = kVoxelSteps / double{grid.voxel};
  for (int k = 0; k < 3; ++k) {
    for (int c = 0; c < 3; ++c) factor_[k][c] = scale * double{toWorld[c][k]};
    offset_[k] =
        scale * (double{toWorld[3][k]} - double{grid.anchor()[k]}) - double{kBrickSide * kVoxelSteps} * grid.shift[k];
    low_[k] = box.low[k] - kMargin;
    high_[k] = box.high[k] + kMargin;
  }
}

bool RunsOutside::operator()(const TriangleRun& run) const {
  bool isOutside = false;
  for (int k = 0; k < 3; ++k) {
    double middle = offset_[k], reach = 0.0, far = std::abs(offset_[k]);
    for (int c = 0; c < 3; ++c) {
      const double lowest = run.min[c], highest = run.max[c];
      middle += factor_[k][c] * 0.5 * (lowest + highest);
      reach += std::abs(factor_[k][c]) * 0.5 * (highest - lowest);
      far += std::abs(factor_[k][c]) * std::max(std::abs(lowest), std::abs(highest));
    }
    if (!(far < kFarRun)) return false;
    if (middle + reach < low_[k] || middle - reach > high_[k]) isOutside = true;
  }
  return isOutside;
}

}  // namespace relume
