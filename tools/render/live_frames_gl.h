// SPDX-License-Identifier: MIT
// Frames of light without a bake by another backend than LiveLevel's own, which finds the voxels alone then
// (BackendKind::gl): in OpenGL, for who has no window, without shadows, whose maps are a host's.
#pragma once

#include "relume/result.h"
#include "tools/render/live_level.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace relume {

class LiveFrames {
 public:
  virtual ~LiveFrames() = default;

  // A frame of the level's voxels as they are, `seconds` after the one before; waits until it is done. Errors of
  // LiveCachesGl.
  virtual Status update(const LiveLevel& level, const LiveScene& scene, double seconds) = 0;
  virtual std::uint32_t activeCells() const = 0;
  // Of the last frame, by the GPU's own clock: "direct", "bounce", "gather"; "cells" on the CPU.
  virtual std::vector<PassTime> passTimes() const = 0;
  virtual std::vector<std::pair<std::string, std::size_t>> bufferSizes() const = 0;
};

// An OpenGL context of EglContext's is current, and stays so. Errors of LiveCachesGl.
Result<std::unique_ptr<LiveFrames>> liveFramesGl(std::uint32_t rays);

}  // namespace relume
