// SPDX-License-Identifier: MIT
// See live_on_gpu.h.
#include "tools/view/live_on_gpu.h"

#include <algorithm>
#include <functional>
#include <span>
#include <thread>

namespace relume {

Result<LiveOnGpu> LiveOnGpu::create(const LiveLevelOptions& options, const GetProcAddress& getProcAddress) {
  auto caches = LiveCachesGl::create({{options.rays}, getProcAddress, ShadowMaps::glsl(), {}});
  if (!caches) return caches.error();
  const unsigned threads = options.threads > 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  return LiveOnGpu(std::move(*caches), threads);
}

void LiveOnGpu::take(LitFrame& found) {
  // The threads of the job that has found them go on with the next.
  if (takeCopies(found, volumes_, threads_->parallelFor())) isNew_ = true;
}

void LiveOnGpu::follow(const glm::vec3& eyeWorld) {
  if (volumes_.empty()) return;
  setReach(volumes_, eyeWorld, false);
  caches_.takeReach(std::span<const VoxelVolume>(volumes_));
}

Result<bool> LiveOnGpu::update(const LiveScene& scene, double seconds, const ShadowMaps& shadows) {
  const bool isStill = !isNew_ && last_ && isSame(*last_, scene);
  if (isStill && isSettled()) return false;
  if (!isStill) {
    shadows.setUniforms(caches_.directProgram());
    shadows.bind();
    LightSetup setup;
    setup.lights = scene.lights;
    if (Status ok = caches_.lightDirectly(std::span<const VoxelVolume>(volumes_), setup); !ok) return ok.error();
  }
  isNew_ = false;
  last_ = scene;
  pace_.begin(isStill, seconds);
  for (int bounce = 0; bounce < std::max(scene.bounces, 1); ++bounce) {
    if (Status ok = caches_.update(std::span<const VoxelVolume>(volumes_), pace_.frame(scene, bounce)); !ok)
      return ok.error();
  }
  pace_.end(scene);
  return true;
}

}  // namespace relume
