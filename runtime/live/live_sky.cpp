// SPDX-License-Identifier: MIT
// See live_sky.h.
#include "runtime/live/live_sky.h"

#include "formats/octahedron.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>

namespace relume {

glm::vec3 skyAlong(const LiveSky& sky, const glm::vec3& direction) {
  if (sky.map.empty()) return sky.radiance;
  const glm::vec2 p = (toOctahedron(direction) * 0.5f + 0.5f) * static_cast<float>(sky.side) - 0.5f;
  const auto last = static_cast<int>(sky.side) - 1;
  const glm::vec2 floor = glm::floor(p), f = p - floor;
  const int x0 = std::clamp(static_cast<int>(floor.x), 0, last), x1 = std::min(static_cast<int>(floor.x) + 1, last);
  const int y0 = std::clamp(static_cast<int>(floor.y), 0, last), y1 = std::min(static_cast<int>(floor.y) + 1, last);
  const auto texel = [&](int x, int y) {
    return sky.map[static_cast<std::size_t>(y) * sky.side + static_cast<std::size_t>(x)];
  };
  return glm::mix(glm::mix(texel(x0, y0), texel(x1, y0), f.x), glm::mix(texel(x0, y1), texel(x1, y1), f.x), f.y);
}

}  // namespace relume
