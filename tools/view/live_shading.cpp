// SPDX-License-Identifier: MIT
// See live_shading.h.
#include "tools/view/live_shading.h"

#include "tools/base/clock.h"
#include "tools/render/scene_bounds.h"

#include <algorithm>
#include <utility>

namespace relume {

Result<LiveShading> LiveShading::create(const LoadedLevel& level, const LiveLevelOptions& options,
                                        const GetProcAddress& getProcAddress, const glm::vec3& eyeWorld) {
  auto field = LiveField::create();
  if (!field) return field.error();
  LiveShading shading(level, std::move(*field), getProcAddress, eyeWorld);
  if (Status ok = shading.choose(options); !ok) return ok.error();
  return shading;
}

LiveShading::LiveShading(const LoadedLevel& level, LiveField field, GetProcAddress getProcAddress,
                         const glm::vec3& eyeWorld)
    : level_(&level),
      nodes_(movingNodes(level.scene, Movable::all)),
      getProcAddress_(std::move(getProcAddress)),
      field_(std::move(field)),
      eyeWorld_(eyeWorld) {
  longestSide_ = longestSide(livePartOf(level.scene).value_or(boundsOf(level.scene)));
}

Status LiveShading::choose(const LiveLevelOptions& options) {
  std::optional<LiveOnGpu> onGpu;
  if (options.backend == BackendKind::gl) {
    auto made = LiveOnGpu::create(options, getProcAddress_);
    if (!made) return made.error();
    onGpu.emplace(std::move(*made));
  }
  options_ = options;
  isRefused_ = false;
  next_.reset();
  if (onGpu) next_.emplace(std::move(*onGpu));
  job_.reset();
  job_ = std::make_unique<LiveJob>(level_->scene, options, eyeWorld_);
  return done();
}

LiveScene LiveShading::sceneOf(const ViewState& state, const std::vector<Light>& lights) const {
  LiveScene scene{lights, state.emission, state.sky, state.bounceScale, state.bounces};
  const auto isMoved = [](const ViewedObject& object) { return object.position != object.home; };
  if (std::ranges::any_of(state.objects, isMoved))
    scene.toWorld = placedInstances(level_->scene, nodes_, movesOf(state));
  scene.eyeWorld = steadyEye(options_, longestSide_, eyeWorld_);
  return scene;
}

// Voxels that the CPU lights, as they are now. The threads of the job go on with its own.
void LiveShading::takeVoxels(LitFrame& found) {
  takeCopies(found, volumes_, {});
  const std::vector<FoundVolume> light = std::exchange(found.volumes, {});
  if (light.empty() || light.size() != volumes_.size()) return;
  for (std::size_t l = 0; l < light.size(); ++l) {
    const std::vector<VoxelRadiance>& radiance = light[l].radiance;
    if (radiance.size() != volumes_[l].radiance().size()) return;
    for (std::uint32_t v = 0; v < radiance.size(); ++v) {
      volumes_[l].setRadiance(2 * v, radiance[v].front());
      volumes_[l].setRadiance(2 * v + 1, radiance[v].back());
    }
  }
  ++lit_;
}

// What the thread has found: light for the field's textures and for cones, or voxels alone.
Status LiveShading::show(LitFrame found) {
  const LiveTexels texels = std::exchange(found.texels, {});
  if (options_.backend == BackendKind::gl) {
    if (!found.hasCopies()) return done();
    volumes_.clear();
    if (next_) {
      shown_.reset();
      shown_.emplace(std::move(*next_));
      next_.reset();
    }
    shown_->take(found);
    found.number = last_.number;
    last_ = std::move(found);
    return done();
  }
  takeVoxels(found);
  last_ = std::move(found);
  shown_.reset();
  return field_.upload(texels);
}

// A frame of the voxels that are there; step: [s] after the one before, 0 = as the clock says.
Status LiveShading::lightOnGpu(const LiveScene& scene, double step, const ShadowMaps& shadows) {
  if (!shown_) return done();
  const double now = clockSeconds(), seconds = step > 0.0 ? step : clock_ > 0.0 ? now - clock_ : 1.0 / 60.0;
  clock_ = now;
  shown_->follow(eyeWorld_);
  const Result<bool> lit = shown_->update(scene, seconds, shadows);
  if (!lit) return lit.error();
  if (*lit) {
    ++last_.number;
    ++lit_;
  }
  last_.isSettled = shown_->isSettled();
  last_.caches = shown_->caches().activeCells();
  return done();
}

Status LiveShading::update(const ViewState& state, const std::vector<Light>& lights, const ShadowMaps& shadows,
                           bool isSlow, bool hasCones) {
  eyeWorld_ = state.camera.position;
  if (!volumes_.empty()) setReach(volumes_, eyeWorld_, false);
  // Light that is frozen is found once more where cones want voxels of it.
  const bool isFrozen = !state.relight && last_.number > 0;
  if (isFrozen && !(hasCones && awaitsVoxels())) return done();
  const bool wantsVoxels = hasCones || options_.backend == BackendKind::gl;
  if (!wantsVoxels) volumes_.clear();
  std::optional<Result<LitFrame>> found;
  const LiveScene scene = isFrozen && followed_ ? *followed_ : sceneOf(state, lights);
  followed_ = scene;
  if (state.liveStep > 0.0) {
    job_->followOnce(scene, state.liveStep, wantsVoxels);
    found.emplace(job_->wait());
  } else {
    constexpr double kPatience = 4.0;  // [s]
    job_->follow(scene, wantsVoxels);
    found = job_->take(isSlow && last_.number == 0 ? kPatience : 0.0);
  }
  if (found) isRefused_ = !*found;
  if (found && !*found) return found->error();
  if (found) {
    if (Status ok = show(std::move(**found)); !ok) return ok;
  }
  return lightOnGpu(scene, state.liveStep, shadows);
}

std::span<const VoxelVolume> LiveShading::volumes() const { return shown_ ? shown_->volumes() : volumes_; }

std::vector<const gl::LitSides*> LiveShading::sides() const {
  std::vector<const gl::LitSides*> all;
  for (std::size_t l = 0; shown_ && l < shown_->volumes().size(); ++l) all.push_back(&shown_->caches().sides(l));
  return all;
}

void LiveShading::bind(GLuint program) const {
  if (shown_) {
    shown_->caches().setUniforms(program);
    shown_->caches().bind();
  } else {
    field_.setUniforms(program);
    field_.bind();
  }
}

std::vector<PassTime> LiveShading::passTimes() const {
  std::vector<PassTime> times;
  for (const PassTime& each : last_.times) {
    if (!shown_ || each.ms > 0.0) times.push_back(each);
  }
  if (shown_) {
    for (const PassTime& each : shown_->passTimes()) times.push_back(each);
  }
  return times;
}

std::vector<std::pair<std::string, std::size_t>> LiveShading::bufferSizes() const {
  auto sizes = last_.bytes;
  if (shown_) {
    for (auto& [name, bytes] : shown_->caches().bufferSizes()) sizes.emplace_back("OpenGL: " + name, bytes);
  }
  for (std::size_t l = 0; l < volumes_.size(); ++l) {
    for (auto& [name, bytes] : volumes_[l].bufferSizes()) {
      if (name == "voxel geometry") continue;  // which copies share
      const auto same = std::ranges::find(sizes, "for cones: " + name, [](const auto& each) { return each.first; });
      if (same != sizes.end()) {
        same->second += bytes;
      } else {
        sizes.emplace_back("for cones: " + name, bytes);
      }
    }
  }
  return sizes;
}

}  // namespace relume
