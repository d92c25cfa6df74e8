// SPDX-License-Identifier: MIT
// See edit_blend.h.
#include "relume/edit_blend.h"

#include "formats/decimal.h"
#include "formats/limits.h"
#include "formats/memory.h"
#include "runtime/shared/shader_text.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>
#include <utility>

namespace relume {
namespace {

constexpr float kLeastVoxels = 8.0f;  // of a reach
// Share of a bake's light below which live light is too little to tell how much of it is gone: live light errs by that.
constexpr float kLeast = 0.05f;

float smooth(float t) {
  const float within = t > 0.0f ? std::min(t, 1.0f) : 0.0f;  // NaN counts as 0
  return within * within * (3.0f - 2.0f * within);
}

Error editError(std::string message) { return {ErrorCode::usage, "edit blend: " + std::move(message)}; }

bool isLength(float metres) { return metres >= 0.0f && metres <= kMaxLevelCoordinate; }

bool isBox(const EditBounds& box) {
  return isWithin(box.min, kMaxLevelCoordinate) && isWithin(box.max, kMaxLevelCoordinate) && box.min.x <= box.max.x &&
         box.min.y <= box.max.y && box.min.z <= box.max.z;
}

EditBounds joined(const EditBounds& a, const EditBounds& b) {
  return {glm::min(a.min, b.min), glm::max(a.max, b.max), std::max(a.reach, b.reach)};
}

float diagonal(const EditBounds& box) { return glm::distance(box.min, box.max); }

// Join boxes until there are few enough: each further one with that of the first which grows least.
std::vector<EditBounds> fewBoxes(std::span<const EditBounds> all) {
  std::vector<EditBounds> few;
  for (const EditBounds& box : all) {
    if (few.size() < kMaxEditBoxes) {
      few.push_back(box);
      continue;
    }
    const auto growth = [&](const EditBounds& other) { return diagonal(joined(box, other)) - diagonal(other); };
    EditBounds& least = *std::min_element(
        few.begin(), few.end(), [&](const EditBounds& a, const EditBounds& b) { return growth(a) < growth(b); });
    least = joined(least, box);
  }
  return few;
}

}  // namespace

Result<EditBlend> EditBlend::create(std::span<const EditBounds> changed, const EditBlendOptions& options) try {
  const std::array<std::pair<const char*, float>, 3> lengths{
      {{"reach", options.reach}, {"fade", options.fade}, {"voxel", options.voxel}}};
  if (options.voxel == 0.0f) return editError("voxel is 0 m, the edge of a voxel of the live light expected");
  for (const auto& [name, metres] : lengths) {
    if (!isLength(metres)) return editError(std::string(name) + " is " + decimal(metres) + " m, 0..1e8 expected");
  }
  for (std::size_t i = 0; i < changed.size(); ++i) {
    if (!isBox(changed[i]))
      return editError("box " + std::to_string(i) + " is not finite, within 1e8 m and right side out");
    if (!isLength(changed[i].reach))
      return editError("box " + std::to_string(i) + " has reach " + decimal(changed[i].reach) + " m, 0..1e8 expected");
  }
  EditBlend blend;
  blend.voxel_ = options.voxel;
  for (const EditBounds& box : fewBoxes(changed)) {
    const float chosen = std::max(0.5f * kEditReach * diagonal(box), kLeastVoxels * options.voxel);
    const float reach = std::max(options.reach > 0.0f ? options.reach : chosen, box.reach);
    const float fade = std::max(options.fade > 0.0f ? options.fade : reach, 1e-6f);
    blend.boxes_.emplace_back(box.min, reach);
    blend.boxes_.emplace_back(box.max, 1.0f / fade);
  }
  return blend;
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

EditShare EditBlend::share(const glm::vec3& positionWorld) const {
  EditShare share;
  for (std::size_t i = 0; i < boxes_.size(); i += 2) {
    const glm::vec3 low(boxes_[i]), high(boxes_[i + 1]);
    const glm::vec3 off = glm::max(glm::max(low - positionWorld, positionWorld - high), glm::vec3(0.0f));
    const float away = glm::length(off);
    share.change = std::max(share.change, smooth(1.0f - (away - boxes_[i].w) * boxes_[i + 1].w));
    share.contact = std::max(share.contact, smooth(1.5f - 0.5f * away / voxel_));
  }
  return share;
}

std::string EditBlend::glsl() {
  const std::array<std::pair<std::string, std::string>, 2> defines{
      {{"RELUME_EDIT_BOXES", std::to_string(kMaxEditBoxes)}, {"RELUME_EDIT_LEAST", decimalGlsl(kLeast)}}};
  return *expandShader("edit_blend.glsl", defines);
}

glm::vec3 blendEdited(const glm::vec3& baked, const glm::vec3& before, const glm::vec3& after, const EditShare& share) {
  if (!(share.change > 0.0f)) return baked;
  const glm::vec3 least = kLeast * baked;
  const glm::vec3 kept = glm::min((after + least) / glm::max(before + least, glm::vec3(1e-30f)), glm::vec3(1.0f));
  const glm::vec3 changed =
      baked * (1.0f + share.change * (kept - 1.0f)) + share.change * glm::max(after - before, glm::vec3(0.0f));
  return changed * (1.0f - share.contact) + share.contact * after;
}

}  // namespace relume
