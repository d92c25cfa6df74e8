// SPDX-License-Identifier: MIT
// A cancel is heard wherever a bake is. What is measured is the processor's time that goes by after it, which other
// programs on the machine do not add to.
#include "bake/bake.h"
#include "tests/caches/big_level.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <ctime>
#include <string>
#include <thread>

namespace relume {
namespace {

double processorSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Scene level() {
  Scene scene = test::bigLevel(200, 12);
  Camera camera;
  camera.toWorld = glm::translate(glm::mat4(1.0f), {3.0f, 16.0f, 3.0f});
  scene.cameras.push_back(camera);
  return scene;
}

// Bake until the processor has worked for so long, then cancel. Returns what it worked on, or -1: it had finished.
double cancelAfter(const Scene& scene, const BakeOptions& options, double seconds, bool& finished) {
  Context context;
  context.threads = 2;
  std::atomic<bool> over{false};
  std::atomic<double> asked{0.0};
  const double begin = processorSeconds();
  std::thread clock([&] {
    while (!over && processorSeconds() - begin < seconds) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    asked = processorSeconds();
    context.cancel();
  });
  const Result<Bake> baked = bake(scene, options, context);
  const double end = processorSeconds();
  over = true;
  clock.join();
  finished = static_cast<bool>(baked);
  if (!finished) {
    EXPECT_EQ(baked.error().message, "cancelled");
  }
  return end - asked;
}

TEST(Cancel, isHeardSoonAtAnyMomentOfABake) {
  if (!std::string(RELUME_SANITIZE).empty()) GTEST_SKIP() << "a dozen bakes take too long with sanitizers";
  const Scene scene = level();
  BakeOptions options = presetOptions(Preset::draft);
  options.surfels.count = 32768;
  bool finished = false;
  const double begin = processorSeconds();
  cancelAfter(scene, options, 1e9, finished);
  const double whole = processorSeconds() - begin;
  ASSERT_TRUE(finished);
  int heard = 0;
  constexpr int kMoments = 12;
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
