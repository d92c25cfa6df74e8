// SPDX-License-Identifier: MIT
// See edit_shading.h.
#include "tools/view/edit_shading.h"

#include "tools/render/drive_scene.h"
#include "tools/render/scene_bounds.h"

#include <algorithm>

namespace relume {

EditShading::EditShading(const LoadedLevel& level)
    : level_(&level),
      nodes_(movingNodes(level.scene, level.movable())),
      longestSide_(longestSide(livePartOf(level.scene).value_or(boundsOf(level.scene)))),
      driven_(level) {}

bool EditShading::isEdited(const ViewState& state, std::size_t object) const {
  return state.objects[object].position != state.objects[object].home &&
         level_->scene.instances[nodes_[object].firstInstance].baked();
}

std::size_t EditShading::edited(const ViewState& state) const {
  std::size_t count = 0;
  for (std::size_t k = 0; k < std::min(nodes_.size(), state.objects.size()); ++k) count += isEdited(state, k) ? 1 : 0;
  return count;
}

// Where the edits count: about where objects were and where they are.
Status EditShading::place(const ViewState& state) {
  const float levelReach = diagonal(boundsOf(level_->scene));
  std::vector<EditBounds> bounds;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    if (!isEdited(state, k)) continue;
    const glm::vec3 by = state.objects[k].position - state.objects[k].home;
    for (std::uint32_t i = 0; i < nodes_[k].instanceCount; ++i) {
      const Instance& instance = level_->scene.instances[nodes_[k].firstInstance + i];
      const SceneBounds box = boundsOf(level_->scene, instance);
      if (box.empty) continue;
      const float reach = isDrivable(driven_.scene().material(instance)) ? levelReach : 0.0f;
      bounds.push_back({box.min, box.max, reach});
      bounds.push_back({box.min + by, box.max + by, reach});
    }
  }
  EditBlendOptions options;
  options.voxel = voxel_;
  auto blend = EditBlend::create(bounds, options);
  if (!blend) return blend.error();
  fields_->place(std::move(*blend));
  return done();
}

// Both lights anew. What they have found so far is shown until they have found something else.
Status EditShading::begin(const ViewState& state, const LiveLevelOptions& options,
                          const std::optional<glm::vec3>& eyeWorld) {
  before_.reset();
  after_.reset();
  if (!fields_) {
    auto fields = EditFields::create();
    if (!fields) return fields.error();
    fields_.emplace(std::move(*fields));
  }
  driven_.drive(state);
  before_ = std::make_unique<LiveJob>(driven_.scene(), options, eyeWorld);
  after_ = std::make_unique<LiveJob>(driven_.scene(), options, eyeWorld);
  options_ = options;
  for (const int i : {0, 1}) found_[i] = settled_[i] = false;
  return done();
}

Status EditShading::take(Result<LitFrame> found, bool isAfter) {
  found_[isAfter ? 1 : 0] = true;
  if (!found) return found.error();
  settled_[isAfter ? 1 : 0] = found->isSettled;
  bytes_[isAfter ? 1 : 0] = std::move(found->bytes);
  voxel_ = found->texels.volumes.empty() ? 0.0f : found->texels.volumes.front().grid.voxel;
  return isAfter ? fields_->uploadAfter(found->texels) : fields_->uploadBefore(found->texels);
}

Status EditShading::update(const ViewState& state, const std::vector<Light>& lights) {
  if (state.objects.size() != nodes_.size() || edited(state) == 0) {
    before_.reset();
    after_.reset();
    fields_.reset();
    driven_.reset();
    return done();
  }
  if (!state.relight && isLit()) return done();
  LiveLevelOptions options = state.live;
  options.backend = BackendKind::cpu;
  const std::optional<glm::vec3> eyeWorld = steadyEye(options, longestSide_, state.camera.position);
  // While a colour is dragged, each that was begun with is found before the next.
  const bool isFree = state.liveStep > 0.0 || (found_[0] && found_[1]);
  if (!before_ || !(options_ == options) || (isFree && !driven_.isOf(state))) {
    if (Status ok = begin(state, options, eyeWorld); !ok) return ok;
  }
  if (driven_.isOf(state)) emission_ = DrivenScene::factorOf(state);
  LiveScene scene{lights, emission_, state.sky, state.bounceScale, state.bounces};
  scene.eyeWorld = eyeWorld;
  scene.toWorld = placedInstances(level_->scene, nodes_, movesOf(state));
  for (const bool isAfter : {false, true}) {
    LiveJob& job = isAfter ? *after_ : *before_;
    scene.editsCastShadowsAlone = !isAfter;
    std::optional<Result<LitFrame>> found;
    if (state.liveStep > 0.0) {
      job.followOnce(scene, state.liveStep, false);
      found.emplace(job.wait());
    } else {
      job.follow(scene, false);
      found = job.take();
    }
    if (!found) continue;
    if (Status ok = take(std::move(*found), isAfter); !ok) return ok;
  }
  return voxel_ > 0.0f ? place(state) : done();
}

std::vector<std::pair<std::string, std::size_t>> EditShading::bufferSizes() const {
  std::vector<std::pair<std::string, std::size_t>> sizes;
  for (const int i : {0, 1}) {
    for (const auto& [name, bytes] : bytes_[i])
      sizes.emplace_back((i == 0 ? "before the edit: " : "edited: ") + name, bytes);
  }
  return sizes;
}

}  // namespace relume
