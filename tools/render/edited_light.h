// SPDX-License-Identifier: MIT
// A picture of a baked level that has been edited since: the bake's light, and near what has changed live light of the
// level before and after (relume/edit_blend.h).
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/edit_blend.h"
#include "relume/result.h"
#include "tools/render/live_view.h"
#include "tools/render/render_frame.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// What was edited. tools/compare/find_edits.h finds it.
struct EditedLevel {
  Scene before;                         // what stood when the level was baked; what moves, as it is now
  std::vector<std::uint8_t> isChanged;  // [Size instances of the level as it is] whether the bake has other ones there
  std::vector<EditBounds> bounds;       // of all that changed, where it was and where it is
  EditBlendOptions blend;               // but for the voxel
  LiveRequest live;                     // its cells and rays
};

// Light before and after the edit, of voxels in one grid.
struct EditedLight {
  EditBlend blend;
  LiveView before, after;
  const EditedLevel* level = nullptr;

  // At a receiver of an instance of the level as it is, whose bake has `baked` there. normal is unit.
  LiveIrradiance at(const LiveIrradiance& baked, std::uint32_t instance, const glm::vec3& positionWorld,
                    const glm::vec3& normal) const;
  std::vector<PassTime> passTimes() const;  // of both levels together
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;
};

// Errors of EditBlend and lightLive(). `tracer` is of the level as it is and casts the shadows of the punctual lights
// on both. [request.edited holds]
Result<EditedLight> lightEdited(const RayTracer& tracer, const RenderRequest& request, Context& context);

}  // namespace relume
