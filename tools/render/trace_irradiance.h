// SPDX-License-Identifier: MIT
// What a camera's surfaces receive, path traced: the truth that a relit view is held against.
#pragma once

#include "bake/scene/sky.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/result.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

struct TraceOptions {
  std::uint32_t width = 192, height = 108;  // [1..16384]
  std::uint32_t samplesPerPixel = 64;       // [1..1e6]
  std::uint32_t maxBounces = 12;            // [0..1024]
  Sky sky;
};

// Irradiance / pi [W/m²/sr] of all light, 0 where nothing is hit, row 0 on top. Materials that emit are on. What is
// dynamic receives light and casts the punctual lights' shadows, and that is all (`relume reference --dynamic
// receivers`). [Size width * height] Errors of RayTracer; failed: cancelled.
Result<std::vector<glm::vec3>> traceIrradiance(const Scene& scene, const Camera& camera,
                                               std::span<const SceneLight> lights, const TraceOptions& options,
                                               Context& context);

}  // namespace relume
