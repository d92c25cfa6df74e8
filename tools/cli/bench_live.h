// SPDX-License-Identifier: MIT
// `relume bench --live`: what light without a bake costs on a level: until it is there, in a frame, and after an edit.
#pragma once

#include "tools/cli/bench_measure.h"
#include "tools/render/live_frames_gl.h"
#include "tools/render/live_level.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace relume {

struct LiveFigures {
  LiveLevelOptions options;
  std::uint32_t voxels = 0, caches = 0;  // that are occupied; of active cells
  std::string edited{};                  // the node that is moved; empty: there is none
  std::uint32_t editedTriangles = 0;
  std::vector<RelightTimes> times{};  // for each number of threads, then in OpenGL
};

// Of each number of threads: `makes` levels made; `frames` frames, whose lights change so that direct light is found
// anew; as many edits of the part with the median number of triangles as levels, to and fro by a tenth of the level's
// height. Lights are the level's own, or a directional one. onGl: the same by those, without shadows, on voxels that
// the last number of threads finds; null = not in OpenGL. Errors of LiveLevel and LiveFrames; failed: cancelled.
Result<LiveFigures> measureLive(const Scene& scene, const LiveLevelOptions& options, const std::vector<int>& threads,
                                LiveFrames* onGl, int makes, int frames, Context& context);

std::string toMarkdown(const LiveFigures& figures);
nlohmann::json toJson(const LiveFigures& figures);

}  // namespace relume
