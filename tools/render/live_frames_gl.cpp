// SPDX-License-Identifier: MIT
// See live_frames_gl.h.
#include "tools/gl_scene/egl_context.h"

#include "runtime/live_gl/live_caches_gl.h"
#include "tools/gl_scene/gl_handle.h"
#include "tools/render/live_frames_gl.h"

#include <algorithm>

namespace relume {
namespace {

class LiveFramesGl : public LiveFrames {
 public:
  explicit LiveFramesGl(LiveCachesGl caches) : caches_(std::move(caches)) {}

  Status update(const LiveLevel& level, const LiveScene& scene, double seconds) override {
    LightSetup setup;
    setup.lights = scene.lights;
    if (Status ok = caches_.lightDirectly(level.volumes(), setup); !ok) return ok;
    pace_.begin(false, seconds);
    for (int bounce = 0; bounce < std::max(scene.bounces, 1); ++bounce) {
      if (Status ok = caches_.update(level.volumes(), pace_.frame(scene, bounce)); !ok) return ok;
    }
    pace_.end(scene);
    glFinish();
    return done();
  }
  std::uint32_t activeCells() const override { return caches_.activeCells(); }
  std::vector<PassTime> passTimes() const override { return caches_.passTimes(); }
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const override { return caches_.bufferSizes(); }

 private:
  LiveCachesGl caches_;
  LivePace pace_;
};

}  // namespace

Result<std::unique_ptr<LiveFrames>> liveFramesGl(std::uint32_t rays) {
  auto caches = LiveCachesGl::create({{rays}, EglContext::getProcAddress, "", {}});
  if (!caches) return caches.error();
  return std::unique_ptr<LiveFrames>(std::make_unique<LiveFramesGl>(std::move(*caches)));
}

}  // namespace relume
