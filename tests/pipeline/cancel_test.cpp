// SPDX-License-Identifier: MIT
// A cancel is heard wherever a bake is.
#include "relume/bake/bake.h"
#include "tests/caches/big_level.h"
#include "tests/cancel_after.h"

#include <gtest/gtest.h>

#include <string>

namespace relume {
namespace {

Scene level() {
  Scene scene = test::bigLevel(200, 12);
  Camera camera;
  camera.toWorld = glm::translate(glm::mat4(1.0f), {3.0f, 16.0f, 3.0f});
  scene.cameras.push_back(camera);
  return scene;
}

TEST(Cancel, isHeardSoonAtAnyMomentOfABake) {
  if (!std::string(RELUME_SANITIZE).empty()) GTEST_SKIP() << "many bakes take too long with sanitizers";
  const Scene scene = level();
  BakeOptions options = presetOptions(Preset::draft);
  options.surfels.count = 32768;
  const test::CancelledWork work([&](Context& context) {
    const Result<Bake> baked = bake(scene, options, context);
    if (!baked) {
      EXPECT_EQ(baked.error().message, "cancelled");
    }
    return static_cast<bool>(baked);
  });
  constexpr int kMoments = 8;
  for (int i = 0; i < kMoments; ++i) {
    const double moment = 0.85 * (i + 0.5) / kMoments;
    EXPECT_LT(work.shareAfterCancel(moment), 0.5) << "of the rest, cancelled at " << moment << " of the bake";
  }
}

}  // namespace
}  // namespace relume
