// SPDX-License-Identifier: MIT
// Views that fill frame by frame: what they show is what the records say, and light and camera may move.
#include "bake/preview/live_preview.h"

#include "bake/preview/receivers.h"
#include "relume/bake/context.h"
#include "tests/preview/sliced_room.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr std::uint32_t kWidth = 192, kHeight = 128;

LivePreview::Options quick() {
  LivePreview::Options options;
  options.rays = 256;
  return options;
}

std::uint32_t fillAll(LivePreview& live, Context& context) {
  std::uint32_t added = 0;
  for (int frame = 0; frame < 10000 && !live.isComplete(); ++frame) {
    const std::uint32_t now = live.fill(100, {}, context);
    EXPECT_LE(now, 100u);
    added += now;
  }
  EXPECT_TRUE(live.isComplete());
  return added;
}

// Eq. (1) over all records, without tiles.
glm::vec3 bruteForce(const LivePreview& live, const PixelReceiver& receiver, const Interpolation& interpolation) {
  glm::vec3 sum(0.0f);
  float weights = 0.0f;
  for (const Record& record : live.records().records()) {
    const float reach = reachOf(record, interpolation), w = weightOf(record, reach, receiver, interpolation);
    if (!(w > 0.0f)) continue;
    const glm::vec3 offset =
        gradientShare(record, reach, interpolation) * (receiver.positionWorld - record.positionWorld);
    sum += w * extrapolate(record.reflected, offset, receiver.normal);
    weights += w;
  }
  return weights > 0.0f ? sum / weights : glm::vec3(-1.0f);
}

void expectPictureIsTheRecords(const LivePreview& live) {
  const Interpolation interpolation{RecordWeight::smooth, quick().accuracy};
  for (std::size_t i = 0; i < live.picture().size(); i += 7) {
    const glm::vec3 truth = bruteForce(live, live.receivers()[i], interpolation);
    ASSERT_GE(truth.x, 0.0f) << i;
    EXPECT_LT(glm::distance(live.picture()[i].reflected, truth), 1e-5f * (1.0f + glm::length(truth))) << i;
  }
}

TEST(LivePreview, frameByFrameItComesToWhatAllRecordsSay) {
  const SlicedRoom room;
  Context context;
  LivePreview live(*room.tracer, SlicedRoom::leavesOf, {}, quick());
  EXPECT_FALSE(live.isComplete());
  EXPECT_EQ(live.fill(100, {}, context), 0u) << "no view yet";
  live.relight(SlicedRoom::lightAround(0.3f), context);
  live.look(SlicedRoom::cameraAt(0), kWidth, kHeight, context);
  EXPECT_EQ(live.fill(10, {}, context), 10u);
  const auto lit = [&live] {
    return std::count_if(live.picture().begin(), live.picture().end(), [](const Splat& s) { return s.weight > 0.0f; });
  };
  const auto before = lit();
  EXPECT_GT(before, 10);
  EXPECT_GT(fillAll(live, context), 50u);
  EXPECT_GT(lit(), before);
  expectPictureIsTheRecords(live);
}

TEST(LivePreview, aLightThatMovesKeepsEveryPixelLit) {
  const SlicedRoom room;
  Context context;
  LivePreview live(*room.tracer, SlicedRoom::leavesOf, {}, quick());
  live.relight(SlicedRoom::lightAround(0.3f), context);
  live.look(SlicedRoom::cameraAt(0), kWidth, kHeight, context);
  fillAll(live, context);
  const std::size_t records = live.records().records().size();
  const glm::vec3 before = live.picture()[kWidth * kHeight / 2].reflected;
  for (const float center : {0.4f, 0.5f, 0.6f, 0.7f}) {
    live.relight(SlicedRoom::lightAround(center), context);
    EXPECT_TRUE(live.isComplete()) << "no record is asked for while it moves";
    for (const Splat& s : live.picture()) ASSERT_GT(s.weight, 0.0f);
    expectPictureIsTheRecords(live);
  }
  EXPECT_EQ(live.records().records().size(), records);
  EXPECT_NE(live.picture()[kWidth * kHeight / 2].reflected, before);

  // Once it stands still the records fit the new light, and nothing goes dark on the way there.
  live.settle(context);
  for (const Splat& s : live.picture()) ASSERT_GT(s.weight, 0.0f);
  fillAll(live, context);
  expectPictureIsTheRecords(live);
  LivePreview fresh(*room.tracer, SlicedRoom::leavesOf, {}, quick());
  fresh.relight(SlicedRoom::lightAround(0.7f), context);
  fresh.look(SlicedRoom::cameraAt(0), kWidth, kHeight, context);
  fillAll(fresh, context);
  double square = 0.0, sum = 0.0;
  for (std::size_t i = 0; i < live.picture().size(); ++i) {
    const glm::dvec3 truth = fresh.picture()[i].reflected, d = glm::dvec3(live.picture()[i].reflected) - truth;
    square += glm::dot(d, d);
    sum += glm::dot(truth, truth);
  }
  EXPECT_LT(std::sqrt(square / sum), 0.03);
}

TEST(LivePreview, aCameraThatTurnsKeepsItsRecords) {
  const SlicedRoom room;
  Context context;
  LivePreview::Options options = quick();
  options.rounds = 0;  // which a new view begins anew
  LivePreview live(*room.tracer, SlicedRoom::leavesOf, {}, options);
  live.relight(SlicedRoom::lightAround(0.3f), context);
  live.look(SlicedRoom::cameraAt(0), kWidth, kHeight, context);
  const std::uint32_t first = fillAll(live, context);
  live.look(SlicedRoom::cameraAt(5), kWidth, kHeight, context);
  const std::uint32_t more = fillAll(live, context);
  EXPECT_GT(more, 0u);
  EXPECT_LE(more, 0.15 * first);
  EXPECT_EQ(live.records().records().size(), first + more);
  expectPictureIsTheRecords(live);
  // And back: nothing is missing.
  live.look(SlicedRoom::cameraAt(0), kWidth, kHeight, context);
  EXPECT_LE(fillAll(live, context), 0.02 * first);
}

TEST(LivePreview, thereAreNoMoreRecordsThanAllowed) {
  const SlicedRoom room;
  Context context;
  LivePreview::Options options = quick();
  options.maxRecords = 60;
  LivePreview live(*room.tracer, SlicedRoom::leavesOf, {}, options);
  live.relight(SlicedRoom::lightAround(0.3f), context);
  live.look(SlicedRoom::cameraAt(0), kWidth, kHeight, context);
  fillAll(live, context);
  EXPECT_EQ(live.records().records().size(), 60u);
  // The other way: records of the first view make room.
  live.look(SlicedRoom::cameraAt(180), kWidth, kHeight, context);
  EXPECT_LT(live.records().records().size(), 60u);
  EXPECT_GT(fillAll(live, context), 0u);
  EXPECT_LE(live.records().records().size(), 60u);
}

TEST(LivePreview, samePictureAtAnyNumberOfThreads) {
  const SlicedRoom room;
  const auto made = [&](int threads) {
    Context context;
    context.threads = threads;
    LivePreview live(*room.tracer, SlicedRoom::leavesOf, {}, quick());
    live.relight(SlicedRoom::lightAround(0.3f), context);
    live.look(SlicedRoom::cameraAt(0), kWidth, kHeight, context);
    for (int frame = 0; frame < 3; ++frame) live.fill(100, {}, context);
    live.relight(SlicedRoom::lightAround(0.6f), context);
    live.settle(context);
    live.look(SlicedRoom::cameraAt(3), kWidth, kHeight, context);
    live.fill(100, {}, context);
    return std::vector<Splat>(live.picture().begin(), live.picture().end());
  };
  const std::vector<Splat> one = made(1);
  for (const int threads : {2, 7}) {
    const std::vector<Splat> more = made(threads);
    for (std::size_t i = 0; i < one.size(); ++i) {
      ASSERT_EQ(more[i].weight, one[i].weight);
      ASSERT_EQ(more[i].reflected, one[i].reflected);
    }
  }
}

TEST(LivePreview, nothingToSeeIsCompleteAtOnce) {
  const SlicedRoom room;
  Context context;
  LivePreview live(*room.tracer, SlicedRoom::leavesOf, {}, quick());
  live.look(lookAt({0, 50, 0}, {0, 60, 0.1f}), kWidth, kHeight, context);
  EXPECT_EQ(live.fill(100, {}, context), 0u);
  EXPECT_TRUE(live.isComplete());
  live.look(SlicedRoom::cameraAt(0), 1, 1, context);
  EXPECT_EQ(fillAll(live, context), 1u);
}

}  // namespace
}  // namespace relume
