// SPDX-License-Identifier: MIT
// See edited_light.h.
#include "tools/render/edited_light.h"

#include "tools/render/scene_bounds.h"

#include <glm/common.hpp>

#include <algorithm>

namespace relume {

Result<EditedLight> lightEdited(const RayTracer& tracer, const RenderRequest& request, Context& context) {
  const EditedLevel& level = *request.edited;
  // One grid for both, so that they err alike
  RenderRequest live = request;
  live.live = level.live;
  const SceneBounds before = boundsOf(level.before), after = boundsOf(tracer.scene());
  live.live->box = before.empty ? after : before;
  if (!before.empty && !after.empty)
    live.live->box = SceneBounds{glm::min(before.min, after.min), glm::max(before.max, after.max), false};
  live.voxels = false;

  auto litBefore = lightLive(tracer, live, context, &level.before);
  if (!litBefore) return litBefore.error();
  auto litAfter = lightLive(tracer, live, context);
  if (!litAfter) return litAfter.error();
  EditBlendOptions options = level.blend;
  options.voxel = litAfter->voxels.volume().grid().voxel;
  auto blend = EditBlend::create(level.bounds, options);
  if (!blend) return blend.error();
  return EditedLight{std::move(*blend), std::move(*litBefore), std::move(*litAfter), &level};
}

LiveIrradiance EditedLight::at(const LiveIrradiance& baked, std::uint32_t instance, const glm::vec3& positionWorld,
                               const glm::vec3& normal) const {
  const EditShare share = level->isChanged[instance] != 0 ? kEditedPart : blend.share(positionWorld);
  if (!(share.change > 0.0f)) return baked;
  const LiveIrradiance a = before.irradiance(positionWorld, normal), b = after.irradiance(positionWorld, normal);
  return {blendEdited(baked.all, a.all, b.all, share), blendEdited(baked.straight, a.straight, b.straight, share)};
}

std::vector<PassTime> EditedLight::passTimes() const {
  std::vector<PassTime> times = after.passTimes(), others = before.passTimes();
  for (std::size_t i = 0; i < std::min(times.size(), others.size()); ++i) times[i].ms += others[i].ms;
  return times;
}

std::vector<std::pair<std::string, std::size_t>> EditedLight::bufferSizes() const {
  std::vector<std::pair<std::string, std::size_t>> sizes;
  for (const LiveView* each : {&before, &after}) {
    for (const auto& [name, bytes] : each->bufferSizes())
      sizes.emplace_back((each == &before ? "before the edit: " : "live: ") + name, bytes);
  }
  return sizes;
}

}  // namespace relume
