// SPDX-License-Identifier: MIT
// What a backend of light without a bake does: on the CPU (live_caches.h) and in OpenGL (runtime/live_gl). LiveLight
// owns the volumes and one of them.
#pragma once

#include "relume/live_light.h"
#include "relume/result.h"
#include "runtime/live/live_frame.h"
#include "runtime/voxels/nested_volumes.h"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace relume {

class LiveBackend {
 public:
  LiveBackend() = default;
  LiveBackend(const LiveBackend&) = delete;
  LiveBackend& operator=(const LiveBackend&) = delete;
  virtual ~LiveBackend() = default;

  // As LiveLight's functions of these names.
  virtual Status update(NestedVolumes& volumes, const LightSetup& setup, const LiveFrame& frame) = 0;
  virtual void reset() = 0;
  virtual glm::vec3 irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const = 0;
  virtual const LiveGlResolve* gl() const = 0;
  virtual std::uint32_t caches() const = 0;
  // "cells", "direct", "bounce", "gather".
  virtual std::vector<PassTime> passTimes(const NestedVolumes& volumes) const = 0;
  // Beside the volumes' own.
  virtual std::vector<std::pair<std::string, std::size_t>> bufferSizes() const = 0;
};

// unsupported: a build without OpenGL; errors of LiveCachesGl::create().
Result<std::unique_ptr<LiveBackend>> makeLiveGlBackend(const LiveLightOptions& options);

}  // namespace relume
