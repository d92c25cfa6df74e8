// SPDX-License-Identifier: MIT
// The light of a view by voxels in OpenGL, as live_view.h has it on the CPU: without a bake caches that gather from
// them (runtime/live_gl/live_caches_gl.h), shadowed by maps; with one voxels that the CPU lights by it. Cones through
// both (runtime/live_gl/cones_gl.h).
#pragma once

#include "relume/bake/context.h"
#include "relume/result.h"
#include "runtime/live_gl/cones_gl.h"
#include "runtime/live_gl/live_caches_gl.h"
#include "tools/gl_scene/shadow_maps.h"
#include "tools/render/live_view.h"
#include "tools/render/render_frame.h"

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

struct LiveGl {
  VoxelView voxels;                               // as the light that was found has left them
  std::optional<LiveCachesGl> all{}, straight{};  // as LiveView's; neither with a bake, or where no light is wanted
  std::optional<ConesGl> cones{};                 // where the request draws them
  int frames = 0;

  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;
};

// An OpenGL context is current, and stays so. shadows: of these lights. [request.live holds, without reflective shadow
// maps]
Result<LiveGl> lightLiveGl(const Scene& scene, const RenderRequest& request, const ShadowMaps& shadows,
                           std::span<const Light> lights, Context& context);

}  // namespace relume
