// SPDX-License-Identifier: MIT
// The thread that lights a level without a bake: what it hands over of the voxels, and when; and that who takes it has
// it alone while the thread goes on.
#include "tools/view/live_job.h"
#include "tests/load_level.h"

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <limits>
#include <thread>

namespace relume {
namespace {

constexpr double kStep = 1.0 / 15.0, kPatience = 300.0;  // [s]
constexpr LiveLevelOptions kOptions{8, 16, 2};

class LiveJobs : public testing::Test {
 protected:
  LiveScene lit(float intensity) const {
    LiveScene scene;
    Light lamp;
    lamp.kind = LightKind::point;
    lamp.positionWorld = glm::vec3(level_.cameras.front().toWorld[3]);
    lamp.intensity = glm::vec3(20.0f * intensity);
    scene.lights.push_back(lamp);
    return scene;
  }
  // With a thing elsewhere.
  LiveScene lifted(float metres) const {
    LiveScene scene = lit(1.0f);
    for (const Instance& instance : level_.instances) scene.toWorld.push_back(instance.toWorld);
    scene.toWorld.back() = glm::translate(glm::mat4(1.0f), {0.0f, metres, 0.0f}) * scene.toWorld.back();
    return scene;
  }
  static bool isSame(std::span<const VoxelRadiance> a, std::span<const VoxelRadiance> b) {
    return std::ranges::equal(a, b);
  }
  // The next frame of a job that follows at its own pace.
  static LitFrame next(LiveJob& job) {
    auto found = job.take(kPatience);
    if (!found || !*found) {
      ADD_FAILURE() << (found ? found->error().message : "nothing comes");
      return {};
    }
    return std::move(**found);
  }
  // The next frame that has copies of voxels; frames of before a wish was heard have none.
  static LitFrame nextCopies(LiveJob& job) {
    LitFrame found = next(job);
    while (!found.hasCopies() && !HasFailure()) found = next(job);
    return found;
  }
  static void wait(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

  const Scene level_ = test::loadLevel(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb");
};

TEST_F(LiveJobs, voxelsComeWhereTheyAreWantedAndRadianceWithEachFrame) {
  Context context;
  auto own = LiveLevel::create(level_, kOptions, context);
  ASSERT_TRUE(own);
  LiveJob job(level_, kOptions);
  const auto both = [&](const LiveScene& scene, bool wantsVoxels) {
    EXPECT_TRUE(own->update(scene, kStep));
    job.followOnce(scene, kStep, wantsVoxels);
    auto found = job.wait();
    EXPECT_TRUE(found);
    return found ? std::move(*found) : LitFrame{};
  };
  const LitFrame none = both(lit(1.0f), false);
  EXPECT_TRUE(none.volumes.empty());
  EXPECT_FALSE(none.texels.light.empty());

  const LitFrame first = both(lit(1.0f), true);
  ASSERT_EQ(first.volumes.size(), 1u);
  ASSERT_TRUE(first.volumes[0].copy);
  EXPECT_TRUE(isSame(first.volumes[0].copy->radiance(), own->volume().radiance()));
  EXPECT_TRUE(isSame(first.volumes[0].radiance, own->volume().radiance()));
  // Other light, the same voxels
  const LitFrame brighter = both(lit(3.0f), true);
  ASSERT_EQ(brighter.volumes.size(), 1u);
  EXPECT_FALSE(brighter.volumes[0].copy);
  EXPECT_TRUE(isSame(brighter.volumes[0].radiance, own->volume().radiance()));
  EXPECT_FALSE(isSame(brighter.volumes[0].radiance, first.volumes[0].radiance));
  // Other voxels
  const LitFrame moved = both(lifted(0.7f), true);
  ASSERT_EQ(moved.volumes.size(), 1u);
  ASSERT_TRUE(moved.volumes[0].copy);
  EXPECT_FALSE(std::ranges::equal(moved.volumes[0].copy->bits(), first.volumes[0].copy->bits()));
  EXPECT_TRUE(isSame(moved.volumes[0].radiance, own->volume().radiance()));

  EXPECT_TRUE(both(lifted(0.7f), false).volumes.empty());
  EXPECT_TRUE(both(lifted(0.7f), true).hasCopies()) << "who no longer wanted them has kept none";
}

// Who has taken the first frame draws it: the second one is not begun before they come back.
TEST_F(LiveJobs, restsWhileTheFirstFrameIsDrawn) {
  LiveJob job(level_, kOptions);
  job.follow(lit(1.0f), false);
  EXPECT_EQ(next(job).number, 1u);
  wait(300);
  EXPECT_FALSE(job.take()) << "it has been found while the first was drawn";
  EXPECT_GT(next(job).number, 1u);
}

TEST_F(LiveJobs, voxelsThatNobodyHasTakenAreNotLost) {
  LiveJob job(level_, kOptions);
  job.follow(lit(1.0f), true);
  EXPECT_TRUE(next(job).hasCopies());
  // Many frames of the same voxels, in place of the one that had them
  job.follow(lifted(0.7f), true);
  wait(200);
  const LitFrame moved = nextCopies(job);
  ASSERT_EQ(moved.volumes.size(), 1u);
  ASSERT_TRUE(moved.volumes[0].copy);
  EXPECT_EQ(moved.volumes[0].radiance.size(), moved.volumes[0].copy->radiance().size());
  // What is refused, in place of it
  job.follow(lifted(0.9f), true);
  wait(200);
  job.follow(lifted(std::numeric_limits<float>::quiet_NaN()), true);
  wait(200);
  bool isTaken = false;  // where the machine is slow, before the refusal
  for (std::optional<Result<LitFrame>> found = job.take(kPatience); found && *found; found = job.take(kPatience))
    isTaken = (*found)->hasCopies();
  job.follow(lifted(0.9f), true);
  EXPECT_TRUE(isTaken || nextCopies(job).hasCopies());
}

// Where OpenGL lights several volumes, those that have changed alone, and none that nobody has taken is lost.
TEST_F(LiveJobs, volumesThatFollowTheEyeComeOneByOne) {
  LiveLevelOptions options = kOptions;
  options.backend = BackendKind::gl;
  options.cascades = 3;
  LiveScene scene = lit(1.0f);
  const glm::vec3 eye = scene.lights.front().positionWorld;
  LiveJob job(level_, options, eye);
  const auto follow = [&](const glm::vec3& to) {
    scene.eyeWorld = to;
    job.follow(scene, true);
  };
  follow(eye);
  const LitFrame first = next(job);
  ASSERT_EQ(first.volumes.size(), 3u);
  for (const FoundVolume& each : first.volumes) ASSERT_TRUE(each.copy);
  // The innermost moves most often, the outermost not at all.
  const float step = 0.4f * first.volumes[2].copy->grid().cell();
  std::array<glm::ivec3, 2> shift{first.volumes[1].copy->grid().shift, first.volumes[2].copy->grid().shift};
  std::array<int, 2> moved{0, 0};
  for (int i = 1; i <= 8; ++i) {
    follow(eye + glm::vec3(step * static_cast<float>(i), 0.0f, 0.0f));
    const LitFrame found = next(job);
    ASSERT_EQ(found.volumes.size(), 3u);
    EXPECT_FALSE(found.volumes[0].copy);
    for (std::size_t l = 0; l < 2; ++l) {
      if (!found.volumes[l + 1].copy) continue;
      EXPECT_NE(found.volumes[l + 1].copy->grid().shift, shift[l]);
      shift[l] = found.volumes[l + 1].copy->grid().shift;
      ++moved[l];
    }
  }
  EXPECT_GT(moved[0], 0);
  EXPECT_GT(moved[1], moved[0]);
  // Both at once, then the innermost before anyone has looked.
  follow(eye - glm::vec3(1.5f, 0.0f, 0.0f));
  wait(200);
  follow(eye - glm::vec3(1.5f - 2.0f * step, 0.0f, 0.0f));
  wait(200);
  std::array<bool, 3> hasCopy{};  // in one frame, or in several where the machine is slow
  while (!(hasCopy[1] && hasCopy[2]) && !HasFailure()) {
    const LitFrame found = next(job);
    ASSERT_EQ(found.volumes.size(), 3u);
    for (std::size_t l = 0; l < 3; ++l) hasCopy[l] = hasCopy[l] || found.volumes[l].copy;
  }
  EXPECT_FALSE(hasCopy[0]);
}

TEST_F(LiveJobs, voxelsComeToLightThatHasSettled) {
  LiveJob job(level_, kOptions);
  job.follow(lit(1.0f), false);
  while (!next(job).isSettled) ASSERT_FALSE(HasFailure());
  EXPECT_FALSE(job.take(0.1)) << "it sleeps";
  job.follow(lit(1.0f), true);
  const LitFrame found = next(job);
  EXPECT_TRUE(found.hasCopies());
  EXPECT_TRUE(found.isSettled);
  EXPECT_FALSE(job.take(0.1));
}

// For the thread sanitizer: what has been taken is read and written while the job goes on.
TEST_F(LiveJobs, whatIsTakenIsTheTakersAlone) {
  LiveJob job(level_, kOptions);
  std::unique_ptr<VoxelVolume> volume;
  int frames = 0, volumes = 0;
  for (int i = 0; frames < 40; ++i) {
    ASSERT_LT(i, 4000);
    const bool wantsVoxels = i / 8 % 4 != 3;
    if (!wantsVoxels) volume.reset();
    job.follow(i % 3 == 0 ? lifted(0.01f * static_cast<float>(i % 50)) : lit(1.0f + static_cast<float>(i % 5)),
               wantsVoxels);
    auto found = job.take(0.05);
    if (!found) continue;
    ASSERT_TRUE(*found) << found->error().message;
    ++frames;
    LitFrame& frame = **found;
    EXPECT_TRUE(wantsVoxels || frame.volumes.empty());
    if (frame.volumes.empty()) continue;
    FoundVolume& only = frame.volumes.front();
    if (only.copy) {
      volume = std::move(only.copy);
      volume->useParallelFor({});
      ++volumes;
    }
    if (!volume || only.radiance.empty()) continue;
    ASSERT_EQ(only.radiance.size(), volume->radiance().size());
    for (std::uint32_t v = 0; v < only.radiance.size(); ++v) {
      volume->setRadiance(2 * v, only.radiance[v].front());
      volume->setRadiance(2 * v + 1, only.radiance[v].back());
    }
    EXPECT_TRUE(isSame(volume->radiance(), only.radiance)) << "axes are of other voxels";
  }
  EXPECT_GT(volumes, 1);
}

}  // namespace
}  // namespace relume
