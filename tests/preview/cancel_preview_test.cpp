// SPDX-License-Identifier: MIT
// Pictures by records that are cancelled: nothing is begun after the cancel, and the picture is an error. Light and
// rasterisers cancel the work while they are asked for something, so that each moment comes, on any machine.
#include "bake/preview/preview.h"
#include "relume/glossy.h"
#include "tests/preview/known_light.h"
#include "tests/preview/small_picture.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <vector>

namespace relume {
namespace {

using namespace test;

// A room with a block in it and a mirror on a wall.
struct CancelRoom {
  Scene scene;
  Camera camera = lookAt({1.6f, 1.9f, 1.7f}, {-0.4f, 0.9f, -1.5f}, 1.0f);
  Sky sky;
  CancelRoom() {
    const std::uint32_t metal = addMaterial(scene, {0.9f, 0.8f, 0.6f});
    scene.materials[metal].gloss.metalness = 1.0f;
    scene.materials[metal].gloss.roughness = glossyRoughness(12.0f);
    const std::uint32_t wall = addMaterial(scene, glm::vec3(0.6f));
    addInstance(scene, box({-2, 0, -2}, {2, 3, 2}, true, wall));
    addInstance(scene, box({-1, 0, -1}, {0, 0.8f, 0}, false, wall));
    addInstance(scene, quad({-1.9f, 0.1f, -1.9f}, {3.8f, 0, 0}, {0, 2.8f, 0}, metal));
    finish(scene);
  }
};

PreviewOptions quickPicture() { return pictureOf(24, 16, 1, 16); }

void expectCancelled(const Result<PreviewFrame>& frame) {
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().message, "cancelled");
}

// What draws nothing; reading it cancels, where that is asked for.
class NoSplats : public SplatDrawer {
 public:
  explicit NoSplats(Context* cancelled = nullptr) : cancelled_(cancelled) {}
  Status look(const CameraRays&, std::span<const PixelReceiver>) override {
    ++looks;
    return done();
  }
  Status draw(std::span<const Record>, const Interpolation&) override { return done(); }
  Status add(std::span<const Record>) override { return done(); }
  Status relight(std::span<const Record>) override { return done(); }
  Status read(std::span<Splat>) override {
    if (cancelled_ != nullptr) cancelled_->cancel();
    return done();
  }
  int looks = 0;

 private:
  Context* cancelled_;
};

TEST(CancelPreview, noRecordIsBegunAfterACancel) {
  const CancelRoom room;
  const RayTracer tracer = tracerOf(room.scene);
  const HitRadiance even = lightAt([](const glm::vec3&) { return glm::vec3(1.0f); });
  for (int at = 1; at <= 48; ++at) {
    Context context;
    context.threads = 1;
    std::set<std::uint64_t> pixels;
    const HitRadiance light = [&](std::uint64_t item, float spread, std::span<const Ray> rays,
                                  std::span<const Hit> hits, std::span<glm::vec3> found) {
      pixels.insert(item & 0xffffffffu);  // above are second looks from the same pixel
      if (pixels.size() == static_cast<std::size_t>(at)) context.cancel();
      even(item, spread, rays, hits, found);
    };
    std::vector<Record> cache;
    expectCancelled(
        renderPreview({tracer, tracer, room.camera, {}, false, room.sky}, light, quickPicture(), cache, context));
    EXPECT_EQ(pixels.size(), static_cast<std::size_t>(at));
    // Records that were not gathered to their end are none.
    for (const Record& record : cache) EXPECT_GT(glm::length(record.normal), 0.5f);
  }
}

// A picture that is asked for all that draws: rounds against contradictions, records of mirrors, and with a time limit
// coarse records before fine ones, without one finer ones where they are few.
struct DrawnPicture {
  Result<PreviewFrame> frame = cancelledError();
  int draws = 0, looks = 0;
};

DrawnPicture drawPicture(const CancelRoom& room, const RayTracer& tracer, double timeLimitSeconds, int cancelAt) {
  DrawnPicture out;
  Context context;
  context.threads = 1;
  const DrawHemispheres draw = [&](std::span<const glm::mat4> poses, std::span<glm::vec3> radiance,
                                   std::span<float> distance) {
    if (++out.draws == cancelAt) context.cancel();
    // Light that differs from place to place, so that records contradict each other.
    const std::size_t cells = poses.empty() ? 0 : radiance.size() / poses.size();
    for (std::size_t i = 0; i < radiance.size(); ++i)
      radiance[i] = glm::vec3(poses[i / cells][3].x > 0.0f ? 1.0f : 20.0f);
    std::fill(distance.begin(), distance.end(), 3.0f);
  };
  const HitRadiance even = lightAt([](const glm::vec3&) { return glm::vec3(1.0f); });
  NoSplats splats;
  PreviewScene asked{tracer, tracer, room.camera, {}, false, room.sky, &draw, &splats};
  PreviewOptions options = quickPicture();
  options.hemisphere = Hemisphere::plane;
  options.planeSide = 4;
  options.gloss = true;
  options.fewRecords = 1000000;
  options.timeLimitSeconds = timeLimitSeconds;
  std::vector<Record> cache;
  out.frame = renderPreview(asked, even, options, cache, context);
  out.looks = splats.looks;
  return out;
}

TEST(CancelPreview, nothingIsDrawnAfterACancel) {
  const CancelRoom room;
  const RayTracer tracer = tracerOf(room.scene);
  for (const double limit : {0.0, 1e6}) {
    const DrawnPicture whole = drawPicture(room, tracer, limit, 0);
    ASSERT_TRUE(whole.frame) << whole.frame.error().message;
    ASSERT_GT(whole.draws, 20) << limit;
    EXPECT_EQ(whole.looks, 1);
    // Moments of each part; the last draws are of mirrors.
    for (const int at : {1, 2, whole.draws / 8, whole.draws / 4, whole.draws / 2, whole.draws - 1, whole.draws}) {
      const DrawnPicture cancelled = drawPicture(room, tracer, limit, at);
      expectCancelled(cancelled.frame);
      EXPECT_EQ(cancelled.draws, at);
      EXPECT_EQ(cancelled.looks, 0) << "after " << at << " of " << whole.draws;
    }
  }
}

TEST(CancelPreview, aPictureThatIsCancelledWhileItIsPutTogetherIsAnError) {
  const CancelRoom room;
  const RayTracer tracer = tracerOf(room.scene);
  Context context;
  NoSplats splats(&context);
  std::vector<Record> cache;
  const HitRadiance even = lightAt([](const glm::vec3&) { return glm::vec3(1.0f); });
  expectCancelled(renderPreview({tracer, tracer, room.camera, {}, false, room.sky, nullptr, &splats}, even,
                                quickPicture(), cache, context));
}

}  // namespace
}  // namespace relume
