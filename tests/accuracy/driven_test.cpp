// SPDX-License-Identifier: MIT
// Each emitter of samples/area_lights/stars.glb, lit alone, against the path tracer: four asterisks and a ring by a
// colour, and the screen, which is dark in the level, by a colour and by an image.
#include "relume/bake/bake.h"
#include "tests/accuracy/driven_error.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace relume {
namespace {

// Of an image t1 is 3.1 to 3.2 % by four seeds, 2.5 % by preset high.
constexpr double kMaxError = 0.03, kMaxErrorOfImage = 0.035;

const Scene& level() {
  static const Scene scene = [] {
    Context context;
    auto imported = importGltf(RELUME_SOURCE_DIR "/samples/area_lights/stars.glb", context);
    EXPECT_TRUE(imported) << (imported ? "" : imported.error().message);
    return imported ? std::move(*imported) : Scene{};
  }();
  return scene;
}

const Bake& levelBake() {
  static const Bake made = [] {
    Context context;
    BakeOptions options = presetOptions(Preset::medium);
    options.links.emitterRays = 0.5f;  // all light is of emitters
    auto baked = bake(level(), options, context);
    EXPECT_TRUE(baked) << (baked ? "" : baked.error().message);
    return baked ? std::move(*baked) : Bake{};
  }();
  return made;
}

class DrivenEmitter : public testing::TestWithParam<const char*> {};

TEST_P(DrivenEmitter, isCloseToThePathTracer) {
  const std::string name = GetParam();
  DrivenMaterial driven;
  driven.name = name == "screen image" ? "screen" : name;
  driven.radiance = name == "screen image" ? glm::vec3(1.0f) : glm::vec3(4.0f, 3.0f, 2.0f);
  if (name == "screen image") {
    driven.width = 45;
    driven.height = 25;
    driven.image = drawSigns(45, 25, 10.0f);
  }
  // The image's light comes from small spots, which paths meet seldom.
  const std::uint32_t paths = driven.image.empty() ? 96 : 768;
  const auto error = measureDriven(level(), levelBake(), driven, "cam", 96, 60, paths);
  ASSERT_TRUE(error) << error.error().message;
  // Means of 4 x 4 pixels, in which the path tracer's noise is a quarter of a pixel's.
  RecordProperty("t1", std::to_string(error->difference.rmseTrimmed));
  RecordProperty("blocks", std::to_string(error->difference.blockRmse));
  RecordProperty("blockNoise", std::to_string(error->difference.blockNoise));
  const double most = driven.image.empty() ? kMaxError : kMaxErrorOfImage;
  EXPECT_LT(error->difference.rmseTrimmed, most);
  EXPECT_LT(error->difference.blockRmseClean, most);
  EXPECT_NEAR(error->difference.energy, 1.0, kMaxError);
  for (const double energy : error->difference.energyRgb) EXPECT_NEAR(energy, 1.0, kMaxError);
}

INSTANTIATE_TEST_SUITE_P(, DrivenEmitter,
                         testing::Values("star_red", "star_green", "star_blue", "star_yellow", "ring", "screen",
                                         "screen image"));

TEST(DrivenCornell, itsLightIsWithinThreePercentOfThePathTracer) {
  const std::filesystem::path file = RELUME_SHARED_DIR "/scenes/cornell/cornell.glb";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "there is no " << file;
  Context context;
  const auto cornell = importGltf(file.string(), context);
  ASSERT_TRUE(cornell) << cornell.error().message;
  const auto made = bake(*cornell, presetOptions(Preset::medium), context);
  ASSERT_TRUE(made) << made.error().message;
  DrivenMaterial driven;
  driven.name = "light";
  driven.radiance = glm::vec3(4.0f, 3.0f, 2.0f);
  const auto error = measureDriven(*cornell, *made, driven, "cam_front", 96, 60, 256);
  ASSERT_TRUE(error) << error.error().message;
  EXPECT_LT(error->difference.rmseTrimmed, kMaxError);
  EXPECT_NEAR(error->difference.energy, 1.0, kMaxError);
  for (const double energy : error->difference.energyRgb) EXPECT_NEAR(energy, 1.0, kMaxError);
}

}  // namespace
}  // namespace relume
