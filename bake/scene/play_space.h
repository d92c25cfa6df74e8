// SPDX-License-Identifier: MIT
// Which surfaces matter: random walks start where receivers can be (cameras, play volumes, free space without either)
// and note the sides of the triangles that light could come from. What no walk reaches gets no surfels and no caches.
#pragma once

#include "bake/context.h"
#include "bake/options.h"
#include "bake/scene/ray_tracer.h"
#include "formats/result.h"

#include <cstdint>
#include <vector>

namespace relume {

// A side of a scene-wide triangle: 2 * triangle + (back ? 1 : 0).
struct PlaySpace {
  std::vector<float> seenArea;       // [m²] [Size 2 * triangles] how much of the side's area can send light to receivers;
                                     // between 0 and the triangle's area (big triangles may be seen in part)
  std::vector<std::uint8_t> visible; // [Size 2 * triangles] 1 where the first bounce of a walk landed: seen by receivers
  std::vector<glm::vec3> receivers;  // [m] points in free space the walks started from: where receivers can be
  // Where a big triangle is seen in part: cells of its barycentric square. See seenAt().
  std::vector<std::uint32_t> cellBegin;  // [Size 2 * triangles + 1]
  std::vector<std::uint8_t> cellSeen;    // 1 = reached by a walk (dilated by one cell)
  std::vector<std::uint8_t> cellSide;    // [Size 2 * triangles] cells along an edge of that side's uv grid; 0 = unseen
  double seenTotal = 0.0, total = 0.0;   // [m²] both sides counted

  // Whether light from this point's side can matter.
  bool seenAt(std::uint32_t side, const glm::vec2& barycentric) const;
};

// failed: no surface can be seen at all, or cancelled.
Result<PlaySpace> findPlaySpace(const RayTracer& tracer, const PlaySpaceOptions& options, std::uint64_t seed,
                                Context& context);

}  // namespace relume
