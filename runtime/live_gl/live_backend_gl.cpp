// SPDX-License-Identifier: MIT
// The OpenGL backend of light without a bake, as LiveLight has it.
#include "runtime/live/live_backend.h"
#include "runtime/live_gl/live_caches_gl.h"

#include <algorithm>
#include <vector>

namespace relume {
namespace {

class GlLiveBackend final : public LiveBackend, public LiveGlResolve {
 public:
  explicit GlLiveBackend(LiveCachesGl caches) : caches_(std::move(caches)) {}

  Status update(NestedVolumes& volumes, const LightSetup& setup, const LiveFrame& frame) override {
    if (Status ok = checkLiveFrame(frame); !ok) return ok;
    if (Status ok = caches_.lightDirectly(volumes, setup); !ok) return ok;
    return caches_.update(volumes, frame);
  }
  void reset() override { caches_.reset(); }
  glm::vec3 irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const override {
    return caches_.irradiance(positionWorld, normal);
  }
  const LiveGlResolve* gl() const override { return this; }
  std::uint32_t caches() const override { return caches_.activeCells(); }
  std::vector<PassTime> passTimes(const NestedVolumes&) const override { return caches_.passTimes(); }
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const override { return caches_.bufferSizes(); }

  const std::string& glsl() const override { return caches_.glsl(); }
  Status setUniforms(std::uint32_t program) const override {
    const bool isKnown = std::find(checked_.begin(), checked_.end(), program) != checked_.end();
    // A program that has the name of one before it has none of its uniforms.
    if (!isKnown || !caches_.hasUniforms(program)) {
      if (Status ok = caches_.checkTextureUnits(program); !ok) return ok;
      if (checked_.size() == kCheckedPrograms) checked_.clear();
      if (!isKnown) checked_.push_back(program);
    }
    caches_.setUniforms(program);
    return done();
  }
  void bind() const override { caches_.bind(); }
  std::uint32_t directProgram() const override { return caches_.directProgram(); }

 private:
  static constexpr std::size_t kCheckedPrograms = 64;

  LiveCachesGl caches_;
  mutable std::vector<std::uint32_t> checked_;  // programs whose texture units are known to be apart
};

}  // namespace

Result<std::unique_ptr<LiveBackend>> makeLiveGlBackend(const LiveLightOptions& options) {
  Result<LiveCachesGl> caches = LiveCachesGl::create(
      {{options.raysPerCell}, options.getProcAddress, options.visibilityGlsl, {}, options.glNames});
  if (!caches) return caches.error();
  return std::unique_ptr<LiveBackend>(std::make_unique<GlLiveBackend>(std::move(*caches)));
}

}  // namespace relume
