// SPDX-License-Identifier: MIT
// See relume/live_light.h.
#include "relume/live_light.h"

#include "runtime/live/live_backend.h"
#include "runtime/live/nested_caches.h"

#include <new>

namespace relume {
namespace {

class CpuLiveBackend final : public LiveBackend {
 public:
  explicit CpuLiveBackend(NestedCaches caches) : caches_(std::move(caches)) {}
  Status update(NestedVolumes& volumes, const LightSetup& setup, const LiveFrame& frame) override {
    // Before direct light takes the place of last frame's.
    if (Status ok = checkLiveFrame(frame); !ok) return ok;
    if (Status ok = volumes.lightDirectly(setup); !ok) return ok;
    return caches_.update(volumes, frame);
  }
  void reset() override { caches_.reset(); }
  glm::vec3 irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const override {
    return caches_.irradiance(positionWorld, normal);
  }
  const LiveGlResolve* gl() const override { return nullptr; }
  std::uint32_t caches() const override { return caches_.activeCells(); }
  std::vector<PassTime> passTimes(const NestedVolumes& volumes) const override {
    const std::vector<PassTime> voxels = volumes.passTimes(), found = caches_.passTimes();
    return {found[0], voxels[2], found[1], found[2]};
  }
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const override { return caches_.bufferSizes(); }

 private:
  NestedCaches caches_;
};

}  // namespace

struct LiveLight::State {
  NestedVolumes volumes;
  std::unique_ptr<LiveBackend> backend;
};

void LiveLight::Destroy::operator()(State* state) const noexcept { delete state; }
LiveLight::LiveLight(std::unique_ptr<State, Destroy> state) : state_(std::move(state)) {}
LiveLight::LiveLight(LiveLight&&) noexcept = default;
LiveLight& LiveLight::operator=(LiveLight&&) noexcept = default;
LiveLight::~LiveLight() = default;

Result<LiveLight> LiveLight::create(const VoxelGeometry& geometry, const LiveLightOptions& options) {
  try {
    // What is cheap to refuse first.
    std::unique_ptr<LiveBackend> backend;
    if (options.backend == BackendKind::gl) {
      Result<std::unique_ptr<LiveBackend>> made = makeLiveGlBackend(options);
      if (!made) return made.error();
      backend = std::move(*made);
    } else {
      Result<NestedCaches> made = NestedCaches::create({options.raysPerCell});
      if (!made) return made.error();
      backend = std::make_unique<CpuLiveBackend>(std::move(*made));
    }
    NestedOptions nested;
    nested.outermost.margin = kLitMargin;
    nested.outermost.boxMin = options.boxMin;
    nested.outermost.boxMax = options.boxMax;
    nested.outermost.cells = options.cells;
    nested.outermost.surfaceBudget = options.surfaceBudget;
    nested.outermost.parallelFor = options.parallelFor;
    nested.cascades = options.cascades;
    nested.boxFollowsEye = options.boxFollowsEye;
    nested.eyeWorld = options.eyeWorld;
    Result<NestedVolumes> volumes = NestedVolumes::create(geometry, nested);
    if (!volumes) return volumes.error();
    return LiveLight(std::unique_ptr<State, Destroy>(new State{std::move(*volumes), std::move(backend)}));
  } catch (const std::bad_alloc&) {
    return noMemoryForLiveLight();
  }
}

Status LiveLight::move(std::span<const glm::mat4x3> toWorld) { return state_->volumes.move(toWorld); }
Status LiveLight::edit(std::span<const PartEdit> edits) { return state_->volumes.edit(edits); }

Result<bool> LiveLight::centre(const glm::vec3& eyeWorld) { return state_->volumes.centre(eyeWorld); }

Status LiveLight::update(const LightSetup& setup, const LiveFrame& frame) {
  return state_->backend->update(state_->volumes, setup, frame);
}

void LiveLight::reset() { state_->backend->reset(); }

glm::vec3 LiveLight::irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const {
  return state_->backend->irradiance(positionWorld, normal);
}

const LiveGlResolve* LiveLight::gl() const { return state_->backend->gl(); }
VoxelStats LiveLight::voxels() const { return state_->volumes.stats(); }
std::uint32_t LiveLight::caches() const { return state_->backend->caches(); }

std::vector<PassTime> LiveLight::passTimes() const {
  const std::vector<PassTime> voxels = state_->volumes.passTimes();
  std::vector<PassTime> times{voxels[0], voxels[1]};
  for (const PassTime& time : state_->backend->passTimes(state_->volumes)) times.push_back(time);
  return times;
}

std::vector<std::pair<std::string, std::size_t>> LiveLight::bufferSizes() const {
  auto sizes = state_->volumes.bufferSizes();
  for (auto& each : state_->backend->bufferSizes()) sizes.push_back(std::move(each));
  return sizes;
}

}  // namespace relume
