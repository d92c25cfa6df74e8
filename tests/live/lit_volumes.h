// SPDX-License-Identifier: MIT
// Volumes of boxes, and light in them, for tests.
#pragma once

#include "runtime/live/live_caches.h"
#include "tests/voxels/boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace relume::test {

inline VoxelVolume volumeOf(VoxelLevel& level, VoxelOptions options = {}) {
  auto volume = VoxelVolume::create(level.geometry(), options);
  EXPECT_TRUE(volume) << volume.error().message;
  return std::move(*volume);
}

inline LiveCaches light(std::uint32_t rays = 64) {
  auto made = LiveCaches::create({rays});
  EXPECT_TRUE(made);
  return std::move(*made);
}

inline void run(LiveCaches& live, VoxelVolume& volume, LiveFrame frame, int frames) {
  for (int f = 0; f < frames; ++f) {
    frame.raySet = static_cast<std::uint32_t>(f);
    const Status ok = live.update(volume, frame);
    ASSERT_TRUE(ok) << ok.error().message;
  }
}

inline VoxelOptions coarse(std::uint32_t cells) {
  VoxelOptions options;
  options.cells = cells;
  return options;
}

// Of all coefficients, which must be numbers.
inline float largest(const LiveCaches& live) {
  float most = 0.0f;
  for (const float c : live.coefficients()) {
    EXPECT_TRUE(std::isfinite(c));
    most = std::max(most, std::abs(c));
  }
  return most;
}

}  // namespace relume::test
