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

// Bake until the processor has worked for so long, then cancel. Returns what it worked on.
double cancelAfter(const Scene& scene, const BakeOptions& options, double seconds, bool& finished) {
  return test::processorSecondsAfterCancel(seconds, [&](Context& context) {
    const Result<Bake> baked = bake(scene, options, context);
    finished = static_cast<bool>(baked);
    if (!finished) {
      EXPECT_EQ(baked.error().message, "cancelled");
    }
  });
}

TEST(Cancel, isHeardSoonAtAnyMomentOfABake) {
  if (!std::string(RELUME_SANITIZE).empty()) GTEST_SKIP() << "many bakes take too long with sanitizers";
  const Scene scene = level();
  BakeOptions options = presetOptions(Preset::draft);
  options.surfels.count = 32768;
  bool finished = false;
  const double begin = test::processorSeconds();
  cancelAfter(scene, options, 1e9, finished);
  const double whole = test::processorSeconds() - begin;
  ASSERT_TRUE(finished);
  int heard = 0;
  constexpr int kMoments = 8;
  for (int i = 0; i < kMoments; ++i) {
    const double after = cancelAfter(scene, options, whole * (i + 0.5) / kMoments, finished);
    if (finished) continue;
    ++heard;
    EXPECT_LT(after, 5.0) << "cancelled at " << whole * (i + 0.5) / kMoments << " s of " << whole;
  }
  EXPECT_GT(heard, kMoments / 2);
}

}  // namespace
}  // namespace relume
