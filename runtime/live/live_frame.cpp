// SPDX-License-Identifier: MIT
// See live_frame.h.
#include "runtime/live/live_frame.h"

#include "formats/limits.h"
#include "runtime/live/live_sky.h"
#include "runtime/live/ray_sets.h"

#include <string>

namespace relume {
namespace {

Error liveError(const std::string& what) { return {ErrorCode::usage, "live light: " + what}; }

}  // namespace

Status checkLiveOptions(const LiveOptions& options) {
  if (options.raysPerCell < 8 || options.raysPerCell > 4096)
    return liveError(std::to_string(options.raysPerCell) + " rays for a cell, expected 8 to 4096");
  return done();
}

Status checkLiveFrame(const LiveFrame& frame) {
  if (!isRadiance(frame.emissionScale)) return liveError("emissionScale has a channel outside of 0 to 1e9");
  if (!(frame.bounceScale >= 0.0f && frame.bounceScale <= 1.0f)) return liveError("bounceScale is outside of 0 to 1");
  if (!(frame.keep >= 0.0f && frame.keep < 1.0f)) return liveError("keep is outside of 0 to 1, 1 not included");
  return checkLiveSky(frame.sky);
}

Status checkLiveSky(const LiveSky& sky) {
  if (!isRadiance(sky.radiance)) return liveError("the sky's radiance has a channel outside of 0 to 1e9");
  if (sky.map.empty()) return done();
  if (sky.map.size() != std::size_t{sky.side} * sky.side)
    return liveError("the sky's map has " + std::to_string(sky.map.size()) +
                     " texels, expected the square of its side, " + std::to_string(sky.side));
  for (std::size_t i = 0; i < sky.map.size(); ++i) {
    if (!isRadiance(sky.map[i]))
      return liveError("texel " + std::to_string(i) + " of the sky's map has a channel outside of 0 to 1e9");
  }
  return done();
}

LiveRays liveRays(std::uint32_t count, const LiveFrame& frame) {
  LiveRays rays{raysOfSet(count, frame.raySet), {}};
  rays.sky.reserve(count);
  for (const glm::vec3& direction : rays.direction) rays.sky.push_back(skyAlong(frame.sky, direction));
  return rays;
}

Error noMemoryForLiveLight() {
  return {ErrorCode::memory, "live light: memory ran out; fewer cells or cascades take less"};
}

}  // namespace relume
