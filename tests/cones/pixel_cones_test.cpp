// SPDX-License-Identifier: MIT
// One cone a pixel: the pattern, what pixels share, and what frames keep.
#include "runtime/cones/pixel_cones.h"
#include "tests/cones/room_pictures.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <vector>

namespace relume {
namespace {

using namespace test;

TEST(PixelCones, eachWindowOfThePatternHasEachConeOnce) {
  for (std::uint32_t y0 = 0; y0 < 7; ++y0) {
    for (std::uint32_t x0 = 0; x0 < 7; ++x0) {
      std::set<std::uint32_t> cones;
      for (std::uint32_t i = 0; i < 25; ++i) cones.insert(coneOfPixel(x0 + i % 5, y0 + i / 5));
      EXPECT_EQ(cones.size(), 25u);
      EXPECT_LT(*cones.rbegin(), kHemisphereCones);
    }
  }
}

TEST(PixelCones, oneConeAPixelComesNearAllOfThem) {
  const Room room(false);
  const ConeTracer tracer(room.volume, room.mips, {});
  const Picture picture(96, 64, {-3, -1, 3.2f}, {1, -2, 0});
  PixelCones all = conesOf({.interleaved = false, .gather = false, .blur = false, .keep = false});
  ASSERT_TRUE(all.update(tracer, picture.receivers(), {}));
  PixelCones bare = conesOf({.gather = false, .blur = false, .keep = false});
  ASSERT_TRUE(bare.update(tracer, picture.receivers(), {}));
  PixelCones one = conesOf({});
  ASSERT_TRUE(one.update(tracer, picture.receivers(), {}));
  double mean = 0.0;
  for (const glm::vec4& l : all.light()) mean += static_cast<double>(l.x) / static_cast<double>(all.light().size());
  EXPECT_LT(meanDifference(one.light(), all.light()), 0.08 * mean);
  EXPECT_GT(meanDifference(bare.light(), all.light()), 0.3 * mean);
}

TEST(PixelCones, lightThatIsEvenStaysAsItIs) {
  const Room room(true);
  const ConeTracer tracer(room.volume, room.mips, {});
  const Picture picture(41, 27, {-3, -1, 3.2f}, {1, -2, 0});
  PixelCones cones = conesOf({});
  for (int f = 0; f < 4; ++f) ASSERT_TRUE(cones.update(tracer, picture.receivers(), {}));
  for (const glm::vec4& l : cones.light()) {
    EXPECT_NEAR(l.x, 1.0f, 0.03f);
    EXPECT_LE(l.w, 1.0f + 1e-5f);
  }
}

// What is shared does not cross an edge: a box that is dark beside a floor that is bright.
TEST(PixelCones, shareNothingAcrossEdges) {
  const Picture picture(60, 40, {-3, -1, 3.2f}, {1, -2, 0});
  // With one side's pixels nowhere the other's must come out the same.
  const Room room(false);
  const ConeTracer tracer(room.volume, room.mips, {});
  PixelCones whole = conesOf({.keep = false});
  ASSERT_TRUE(whole.update(tracer, picture.receivers(), {}));
  Picture floor = picture;
  for (std::size_t i = 0; i < floor.depth.size(); ++i) {
    if (floor.normal[i].y < 0.5f || floor.position[i].y > -3.5f) floor.depth[i] = 0.0f;
  }
  PixelCones alone = conesOf({.keep = false});
  ASSERT_TRUE(alone.update(tracer, floor.receivers(), {}));
  int compared = 0, edges = 0;
  for (std::size_t i = 0; i < floor.depth.size(); ++i) {
    edges += whole.edges()[i];
    if (floor.depth[i] == 0.0f) {
      EXPECT_EQ(alone.light()[i], glm::vec4(0.0f));
      continue;
    }
    EXPECT_NEAR(glm::length(alone.light()[i] - whole.light()[i]), 0.0f, 1e-5f) << i;
    ++compared;
  }
  EXPECT_GT(compared, 300);
  EXPECT_GT(edges, 50);
  EXPECT_LT(edges, 60 * 40 / 3);
}

TEST(PixelCones, aStillViewIsTheMeanOfItsFrames) {
  const Room room(false);
  const ConeTracer tracer(room.volume, room.mips, {});
  const Picture picture(48, 32, {-3, -1, 3.2f}, {1, -2, 0});
  PixelCones each = conesOf({.keep = false}), kept = conesOf({});
  std::vector<glm::vec4> mean(48 * 32, glm::vec4(0.0f));
  for (int f = 0; f < 8; ++f) {
    ASSERT_TRUE(each.update(tracer, picture.receivers(), {}));
    ASSERT_TRUE(kept.update(tracer, picture.receivers(), {}));
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += each.light()[i] / 8.0f;
  }
  EXPECT_LT(meanDifference(kept.light(), mean), 0.02);
  for (const float frames : kept.frames()) EXPECT_NEAR(frames, 8.0f, 1e-3f);
}

TEST(PixelCones, aCameraThatTurnsKeepsWhatItSawAndStartsAnewElsewhere) {
  const Room room(false);
  const ConeTracer tracer(room.volume, room.mips, {});
  PixelCones kept = conesOf({});
  double least = 1e9, most = 0.0;
  for (int f = 0; f < 10; ++f) {
    const Picture picture(64, 48, {-3, -1, 3.2f}, {1.0f + 0.2f * static_cast<float>(f), -2, 0});
    ASSERT_TRUE(kept.update(tracer, picture.receivers(), {}));
  }
  for (const float frames : kept.frames()) {
    least = std::min(least, static_cast<double>(frames));
    most = std::max(most, static_cast<double>(frames));
  }
  EXPECT_EQ(least, 1.0) << "what comes into view";
  EXPECT_NEAR(most, 10.0, 0.01) << "what stays in view";
  // Cut to elsewhere.
  const Picture elsewhere(64, 48, {3, 3, -3}, {0, 3, -4});
  ASSERT_TRUE(kept.update(tracer, elsewhere.receivers(), {}));
  float sum = 0.0f;
  for (const float frames : kept.frames()) sum += frames;
  EXPECT_LT(sum / static_cast<float>(kept.frames().size()), 5.0f);
}

TEST(PixelCones, aLightThatGoesOutDoesSoWithinFourFrames) {
  const Room bright(false);
  Room dark(true);
  dark.volume.reflect([](const SideAt&) { return glm::vec3(0.1f); }, glm::vec3(0.0f));
  ASSERT_TRUE(dark.mips.update(dark.volume));
  const Picture picture(48, 32, {-3, -1, 3.2f}, {1, -2, 0});
  PixelCones kept = conesOf({}), now = conesOf({.keep = false});
  const ConeTracer lit(bright.volume, bright.mips, {}), unlit(dark.volume, dark.mips, {});
  for (int f = 0; f < 16; ++f) ASSERT_TRUE(kept.update(lit, picture.receivers(), {}));
  for (int f = 0; f < 4; ++f) ASSERT_TRUE(kept.update(unlit, picture.receivers(), {}));
  ASSERT_TRUE(now.update(unlit, picture.receivers(), {}));
  EXPECT_LT(meanDifference(kept.light(), now.light()), 0.02);
}

TEST(PixelCones, doNotDependOnThreadsAndRefuseWhatIsNoPicture) {
  const Room room(false);
  const ConeTracer tracer(room.volume, room.mips, {});
  const Picture picture(37, 29, {-3, -1, 3.2f}, {1, -2, 0});
  std::vector<std::vector<glm::vec4>> found;
  for (const std::uint32_t threads : {1u, 2u, 7u}) {
    PixelCones cones = conesOf({});
    const ParallelFor parallelFor = [threads](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
      onThreads(threads, tasks, body);
    };
    for (int f = 0; f < 3; ++f) ASSERT_TRUE(cones.update(tracer, picture.receivers(), parallelFor));
    found.emplace_back(cones.light().begin(), cones.light().end());
  }
  for (const auto& f : found) EXPECT_EQ(std::memcmp(f.data(), found[0].data(), f.size() * sizeof(glm::vec4)), 0);

  PixelCones cones = conesOf({});
  ASSERT_TRUE(cones.update(tracer, picture.receivers(), {}));
  const glm::vec4 before = cones.light()[100];
  PixelReceivers wrong = picture.receivers();
  wrong.height = 28;
  EXPECT_FALSE(cones.update(tracer, wrong, {}));
  Picture nan = picture;
  nan.position[5].y = std::numeric_limits<float>::quiet_NaN();
  const Status refused = cones.update(tracer, nan.receivers(), {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("pixel 5"), std::string::npos);
  wrong = picture.receivers();
  wrong.clipFromWorld[3][3] = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(cones.update(tracer, wrong, {}));
  EXPECT_EQ(cones.light()[100], before);
  EXPECT_FALSE(PixelCones::create({.mostFrames = 0}));
  EXPECT_FALSE(PixelCones::create({.falloff = -1.0f}));
}

}  // namespace
}  // namespace relume
