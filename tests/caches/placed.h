// SPDX-License-Identifier: MIT
// A scene and all that cache placement needs and makes of it.
#pragma once

#include "bake/caches/caches.h"
#include "relume/bake/context.h"

#include <gtest/gtest.h>
#include <glm/ext/matrix_transform.hpp>

#include <limits>
#include <optional>
#include <string_view>

namespace relume::test {

struct Placed {
  Scene scene;
  std::optional<RayTracer> tracer;
  PlaySpace playSpace;
  Caches caches;
  PlacedCaches packed{};  // the same
};

inline void place(Placed& p, const CacheOptions& options, const PlaySpaceOptions& space, Context& context) {
  auto tracer = RayTracer::create(p.scene, "avx2", context);
  ASSERT_TRUE(tracer) << tracer.error().message;
  p.tracer.emplace(std::move(*tracer));
  auto playSpace = findPlaySpace(*p.tracer, space, 1, context);
  ASSERT_TRUE(playSpace) << playSpace.error().message;
  p.playSpace = std::move(*playSpace);
  auto caches = placeCaches(*p.tracer, p.playSpace, options, 1, context);
  ASSERT_TRUE(caches) << caches.error().message;
  p.caches = unpack(*caches);
  p.packed = std::move(*caches);
}

// What a stage told; NaN where none told this.
inline double figureOf(const Context& context, std::string_view name) {
  for (const StageReport& stage : context.report()) {
    for (const auto& [figure, value] : stage.figures) {
      if (figure == name) return value;
    }
  }
  return std::numeric_limits<double>::quiet_NaN();
}

inline PlaySpaceOptions walks(std::uint32_t count) {
  PlaySpaceOptions space;
  space.walks = count;
  return space;
}

inline Camera cameraAt(const glm::vec3& p) {
  Camera camera;
  camera.toWorld = glm::translate(glm::mat4(1.0f), p);
  return camera;
}

}  // namespace relume::test
