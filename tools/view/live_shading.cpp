// SPDX-License-Identifier: MIT
// See live_shading.h.
#include "tools/view/live_shading.h"

#include <glm/ext/matrix_transform.hpp>

#include <utility>

namespace relume {

Result<LiveShading> LiveShading::create(const LoadedLevel& level, const LiveLevelOptions& options) {
  auto field = LiveField::create();
  if (!field) return field.error();
  LiveShading shading(level, std::move(*field));
  shading.choose(options);
  return shading;
}

void LiveShading::choose(const LiveLevelOptions& options) {
  options_ = options;
  job_.reset();
  job_ = std::make_unique<LiveJob>(level_->scene, options);
}

LiveScene LiveShading::sceneOf(const ViewState& state, const std::vector<Light>& lights) const {
  LiveScene scene{lights, state.emission, state.sky, state.bounceScale, state.bounces};
  for (std::size_t k = 0; k < nodes_.size() && k < state.objects.size(); ++k) {
    const glm::vec3 moved = state.objects[k].position - state.objects[k].home;
    if (moved == glm::vec3(0.0f)) continue;
    if (scene.toWorld.empty()) {
      for (const Instance& instance : level_->scene.instances) scene.toWorld.push_back(instance.toWorld);
    }
    for (std::uint32_t i = 0; i < nodes_[k].instanceCount; ++i) {
      glm::mat4& toWorld = scene.toWorld[nodes_[k].firstInstance + i];
      toWorld = glm::translate(glm::mat4(1.0f), moved) * toWorld;
    }
  }
  return scene;
}

Status LiveShading::update(const ViewState& state, const std::vector<Light>& lights, bool isSlow) {
  if (!state.relight && last_.number > 0) return done();
  std::optional<Result<LitFrame>> found;
  if (state.liveStep > 0.0) {
    job_->followOnce(sceneOf(state, lights), state.liveStep);
    found.emplace(job_->wait());
  } else {
    constexpr double kPatience = 4.0;  // [s]
    job_->follow(sceneOf(state, lights));
    found = job_->take(isSlow && last_.number == 0 ? kPatience : 0.0);
  }
  if (!found) return done();
  if (!*found) return found->error();
  last_ = std::move(**found);
  const LiveTexels texels = std::exchange(last_.texels, {});
  return field_.upload(texels);
}

}  // namespace relume
