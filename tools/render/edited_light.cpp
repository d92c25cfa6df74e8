// SPDX-License-Identifier: MIT
// See edited_light.h.
#include "tools/render/edited_light.h"

#include "tools/render/scene_bounds.h"

#include <algorithm>
#include <optional>
#include <vector>

namespace relume {
namespace {

// One box for both levels, so that they err alike: the parts of them that are played in, or all of both.
void chooseBox(const Scene& before, const Scene& now, LiveRequest& live) {
  const std::optional<SceneBounds> partBefore = livePartOf(before), partNow = livePartOf(now);
  live.box = joined(partBefore ? *partBefore : boundsOf(before), partNow ? *partNow : boundsOf(now));
  live.roams = partBefore || partNow;
}

// What a reach that is asked for, or a picture without their light, leaves of parts that emit.
std::vector<EditBounds> boundsFor(const EditedLevel& level, bool drawsEmission) {
  std::vector<EditBounds> bounds = level.bounds;
  if (drawsEmission && level.blend.reach == 0.0f) return bounds;
  for (EditBounds& box : bounds) box.reach = 0.0f;
  return bounds;
}

}  // namespace

Result<EditedLight> lightEdited(const RayTracer& tracer, const RenderRequest& request, Context& context) {
  const EditedLevel& level = *request.edited;
  RenderRequest live = request;
  live.live = level.live;
  chooseBox(level.before, tracer.scene(), *live.live);
  live.voxels = false;

  auto litBefore = lightLive(tracer, live, context, &level.before);
  if (!litBefore) return litBefore.error();
  auto litAfter = lightLive(tracer, live, context);
  if (!litAfter) return litAfter.error();
  EditBlendOptions options = level.blend;
  options.voxel = litAfter->voxels.volume().grid().voxel;
  auto blend = EditBlend::create(boundsFor(level, request.drawsEmission()), options);
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
