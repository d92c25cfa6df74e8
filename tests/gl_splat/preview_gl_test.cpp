// SPDX-License-Identifier: MIT
// Previews whose records OpenGL splats show what those show that splat here, whatever happens to light and camera.
#include "bake/preview/live_preview.h"
#include "bake/preview/preview.h"
#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "tests/gl_splat/splat_view.h"
#include "tests/preview/sliced_room.h"
#include "tests/runtime/gl_test_support.h"
#include "tools/gl_splat/splats_gl.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr std::uint32_t kWidth = 160, kHeight = 100;

// A rasteriser that stops working after some calls.
class FailsAfter final : public SplatDrawer {
 public:
  FailsAfter(SplatDrawer& other, int calls) : other_(other), left_(calls) {}
  Status look(const CameraRays& camera, std::span<const PixelReceiver> receivers) override {
    return isOut() ? out() : other_.look(camera, receivers);
  }
  Status draw(std::span<const Record> records, const Interpolation& options) override {
    return isOut() ? out() : other_.draw(records, options);
  }
  Status add(std::span<const Record> records) override { return isOut() ? out() : other_.add(records); }
  Status relight(std::span<const Record> records) override { return isOut() ? out() : other_.relight(records); }
  Status read(std::span<Splat> picture) override { return isOut() ? out() : other_.read(picture); }

 private:
  bool isOut() { return left_-- <= 0; }
  static Status out() { return Error{ErrorCode::memory, "the cable is loose"}; }
  SplatDrawer& other_;
  int left_;
};

class PreviewsByGl : public GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (!context_) return;
    auto made = SplatsGl::create({EglContext::getProcAddress});
    ASSERT_TRUE(made) << made.error().message;
    gl_ = std::move(*made);
  }
  void TearDown() override {
    gl_.reset();
    GlTest::TearDown();
  }
  // Both from one light, view and number of records to the next.
  struct Pair {
    LivePreview here, drawn;
    Pair(const SlicedRoom& room, SplatDrawer& drawer)
        : here(*room.tracer, SlicedRoom::leavesOf, {}, {}), drawn(*room.tracer, SlicedRoom::leavesOf, {}, {}) {
      drawn.drawBy(&drawer);
    }
    template <class Do>
    void both(const Do& what) {
      what(here);
      what(drawn);
    }
  };
  void expectSamePicture(const Pair& pair, const char* when, std::size_t least) {
    std::vector<Splat> picture(pair.drawn.picture().begin(), pair.drawn.picture().end());
    if (pair.drawn.isDrawn()) {
      const Status ok = gl_->read(picture);
      ASSERT_TRUE(ok) << ok.error().message;
    }
    Interpolation options;
    options.accuracy = LivePreview::Options{}.accuracy;
    const SplatDifference d = compareSplats(pair.here.picture(), picture, options);
    EXPECT_LE(d.rms, 1e-5) << when;
    EXPECT_EQ(d.apart, 0u) << when;
    EXPECT_LE(d.ties, 1 + d.lit / 1000) << when;
    EXPECT_GE(d.lit, least) << when;
    EXPECT_EQ(pair.here.records().records().size(), pair.drawn.records().records().size()) << when;
  }
  std::unique_ptr<SplatsGl> gl_;
};

TEST_F(PreviewsByGl, frameByFrameTheyShowTheSame) {
  const SlicedRoom room;
  Context context;
  Pair pair(room, *gl_);
  pair.both([&](LivePreview& live) {
    live.relight(SlicedRoom::lightAround(0.3f), context);
    live.look(SlicedRoom::cameraAt(0.0f), kWidth, kHeight, context);
  });
  EXPECT_TRUE(pair.drawn.isDrawn());
  for (int frame = 0; frame < 4; ++frame) {
    pair.both([&](LivePreview& live) { live.fill(40, {}, context); });
    expectSamePicture(pair, "filling", 1000);
  }
  const auto fillAll = [&](LivePreview& live) {
    while (!live.isComplete()) live.fill(100, {}, context);
  };
  pair.both(fillAll);
  expectSamePicture(pair, "filled", kWidth * kHeight);
  pair.both([&](LivePreview& live) { live.relight(SlicedRoom::lightAround(0.7f), context); });
  EXPECT_EQ(gl_->sentBytes(), pair.drawn.records().records().size() * 9 * 16) << "coefficients alone";
  expectSamePicture(pair, "relit", kWidth * kHeight);
  pair.both([&](LivePreview& live) { live.settle(context); });
  expectSamePicture(pair, "settled", kWidth * kHeight);
  pair.both(fillAll);
  expectSamePicture(pair, "filled again", kWidth * kHeight);
  pair.both([&](LivePreview& live) { live.look(SlicedRoom::cameraAt(5.0f), kWidth / 2, kHeight, context); });
  expectSamePicture(pair, "turned", 1000);
  pair.both(fillAll);
  expectSamePicture(pair, "turned and filled", kWidth / 2 * kHeight);
}

TEST_F(PreviewsByGl, aRasteriserThatFailsIsDoneWithout) {
  const SlicedRoom room;
  Context context;
  for (int calls = 0; calls < 9; ++calls) {
    FailsAfter loose(*gl_, calls);
    Pair pair(room, loose);
    std::optional<Error> error;
    const auto also = [&](const auto& what) {
      pair.both(what);
      if (auto now = pair.drawn.takeDrawError()) error = now;
    };
    also([&](LivePreview& live) { live.relight(SlicedRoom::lightAround(0.3f), context); });
    also([&](LivePreview& live) { live.look(SlicedRoom::cameraAt(0.0f), kWidth, kHeight, context); });
    for (int frame = 0; frame < 2; ++frame) also([&](LivePreview& live) { live.fill(50, {}, context); });
    also([&](LivePreview& live) { live.relight(SlicedRoom::lightAround(0.6f), context); });
    also([&](LivePreview& live) { live.settle(context); });
    also([&](LivePreview& live) { live.look(SlicedRoom::cameraAt(5.0f), kWidth, kHeight, context); });
    also([&](LivePreview& live) { live.fill(50, {}, context); });
    ASSERT_TRUE(error) << calls;
    EXPECT_EQ(error->message, "the cable is loose");
    EXPECT_FALSE(pair.drawn.isDrawn());
    EXPECT_FALSE(pair.drawn.takeDrawError()) << "it is told once";
    expectSamePicture(pair, "after it failed", 1000);
  }
}

// A rasteriser is taken from one look to the next, not in between.
TEST_F(PreviewsByGl, whoSplatsChangesWithTheNextLook) {
  const SlicedRoom room;
  Context context;
  LivePreview live(*room.tracer, SlicedRoom::leavesOf, {}, {});
  live.relight(SlicedRoom::lightAround(0.3f), context);
  live.look(SlicedRoom::cameraAt(0.0f), kWidth, kHeight, context);
  live.fill(200, {}, context);
  live.drawBy(gl_.get());
  live.relight(SlicedRoom::lightAround(0.5f), context);
  live.fill(20, {}, context);
  EXPECT_FALSE(live.isDrawn());
  const std::vector<Splat> here(live.picture().begin(), live.picture().end());
  live.look(SlicedRoom::cameraAt(0.0f), kWidth, kHeight, context);
  EXPECT_TRUE(live.isDrawn());
  std::vector<Splat> drawn(here.size());
  ASSERT_TRUE(gl_->read(drawn));
  Interpolation options;
  options.accuracy = LivePreview::Options{}.accuracy;
  const SplatDifference d = compareSplats(here, drawn, options);
  EXPECT_LE(d.rms, 1e-5);
  EXPECT_GT(d.lit, 1000u);
  live.drawBy(nullptr);
  live.relight(SlicedRoom::lightAround(0.2f), context);
  EXPECT_TRUE(live.isDrawn());
  live.look(SlicedRoom::cameraAt(0.0f), kWidth, kHeight, context);
  EXPECT_FALSE(live.isDrawn());
  EXPECT_FALSE(live.takeDrawError());
}

// A whole frame: every layer, and the pixels that no record reached.
TEST_F(PreviewsByGl, aFrameIsTheSame) {
  const SlicedRoom room;
  Context context;
  const Camera camera = SlicedRoom::cameraAt(0.0f);
  Sky sky;
  sky.radiance = {0.2f, 0.3f, 0.4f};
  const HitRadiance reflected = [](std::uint64_t, float, std::span<const Ray>, std::span<const Hit> hits,
                                   std::span<glm::vec3> radiance) {
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (hits[i]) radiance[i] = glm::vec3(0.5f, 1.0f, 0.2f) * hits[i].distance;
    }
  };
  PreviewOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.samples = 2;
  options.rays = 256;
  for (const std::uint32_t most : {200000u, 60u}) {
    options.maxRecords = most;
    std::vector<PreviewFrame> frames;
    for (SplatDrawer* drawer : {static_cast<SplatDrawer*>(nullptr), static_cast<SplatDrawer*>(gl_.get())}) {
      std::vector<Record> cache;
      const PreviewScene view{*room.tracer, *room.tracer, camera, {}, false, sky, nullptr, drawer};
      auto frame = renderPreview(view, reflected, options, cache, context);
      ASSERT_TRUE(frame) << frame.error().message;
      frames.push_back(std::move(*frame));
    }
    EXPECT_EQ(frames[0].records, frames[1].records);
    EXPECT_NEAR(frames[0].extended, frames[1].extended, 1 + frames[0].extended / 100.0);
    if (most == 60) {
      EXPECT_GT(frames[0].extended, 100u) << "reached out for";
    }
    double square = 0.0, sum = 0.0;
    for (std::size_t i = 0; i < frames[0].bounced.size(); ++i) {
      const glm::vec3 d = frames[0].bounced[i] - frames[1].bounced[i];
      square += glm::dot(d, d);
      sum += glm::dot(frames[0].bounced[i], frames[0].bounced[i]);
    }
    EXPECT_GT(sum, 0.0);
    EXPECT_LE(std::sqrt(square / sum), 1e-3);
  }
  // A rasteriser's error is the frame's.
  FailsAfter loose(*gl_, 1);
  std::vector<Record> cache;
  const auto refused = renderPreview({*room.tracer, *room.tracer, camera, {}, false, sky, nullptr, &loose}, reflected,
                                     options, cache, context);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "the cable is loose");
}

}  // namespace
}  // namespace relume
