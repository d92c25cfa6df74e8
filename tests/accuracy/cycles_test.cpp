// SPDX-License-Identifier: MIT
// The path tracer against images of another renderer (Cycles): import, lights and radiometry are right when the mean
// light agrees within the noise, direct and indirect, punctual and emitted.
#include "bake/reference/path_tracer.h"
#include "relume/bake/context.h"
#include "tests/accuracy/compare_images.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

namespace relume {
namespace {

struct Case {
  const char* scene;
  const char* camera;
  const char* light;  // "emissive" = emitting surfaces
  const char* suffix;
  std::uint32_t bounces;
  std::uint32_t samples;
  double directEnergy, indirectEnergy;  // largest deviation of the ratio from 1
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.scene << ' ' << c.camera << ' ' << c.light << c.suffix; }

class AgainstCycles : public testing::TestWithParam<Case> {};

TEST_P(AgainstCycles, energyAgreesWithinTheNoise) {
  const Case& c = GetParam();
  const std::filesystem::path shared = RELUME_SHARED_DIR;
  const auto scenePath = shared / "scenes" / c.scene / (std::string(c.scene) + ".glb");
  const auto imagePath = shared / "references" / c.scene / (std::string(c.camera) + "__" + c.light + c.suffix + ".exr");
  if (!std::filesystem::exists(scenePath) || !std::filesystem::exists(imagePath))
    GTEST_SKIP() << "needs " << imagePath << " (RELUME_SHARED_DIR)";

  Context context;
  const auto scene = importGltf(scenePath, context);
  ASSERT_TRUE(scene) << scene.error().message;
  const auto tracer = RayTracer::create(*scene, "avx2", context);
  ASSERT_TRUE(tracer);
  const auto reference = readExr(imagePath);
  ASSERT_TRUE(reference) << reference.error().message;

  const Camera* camera = nullptr;
  for (const Camera& candidate : scene->cameras) {
    if (candidate.name == c.camera) camera = &candidate;
  }
  ASSERT_NE(camera, nullptr);
  ReferenceOptions options;
  options.samplesPerPixel = c.samples;
  options.maxBounces = c.bounces;
  options.emissive = c.light == std::string("emissive");
  std::vector<SceneLight> lights;
  for (const SceneLight& light : scene->lights) {
    if (light.name == c.light) lights.push_back(light);
  }
  ASSERT_TRUE(options.emissive || !lights.empty());
  const auto image = renderReference(*tracer, *camera, lights, options, context);
  ASSERT_TRUE(image);

  for (const bool direct : {true, false}) {
    ChannelImage candidate{image->width, image->height, {}};
    candidate.setLayer("", direct ? image->direct : image->indirect);
    CompareOptions compare;
    compare.layers = {direct ? "DiffDir" : "DiffInd"};
    const auto difference = compareImages(*reference, candidate, compare);
    ASSERT_TRUE(difference) << difference.error().message;
    const double limit = direct ? c.directEnergy : c.indirectEnergy;
    for (const double energy :
         {difference->energy, difference->energyRgb[0], difference->energyRgb[1], difference->energyRgb[2]}) {
      EXPECT_NEAR(energy, 1.0, limit) << (direct ? "direct" : "indirect");
    }
    // What blocks of 4 x 4 pixels differ by is our own noise (samples are few), and no bias.
    EXPECT_LT(difference->blockP50, 0.2);
  }
}

INSTANTIATE_TEST_SUITE_P(Cornell, AgainstCycles,
                         testing::Values(Case{"cornell", "cam_corner", "spot", "", 12, 16, 0.002, 0.01},
                                         Case{"cornell", "cam_corner", "spot", "__1bounce", 1, 16, 0.002, 0.01},
                                         Case{"cornell", "cam_front", "spot", "", 12, 16, 0.002, 0.01},
                                         Case{"cornell", "cam_corner", "emissive", "", 12, 16, 0.003, 0.01},
                                         Case{"cornell", "cam_front", "emissive", "__1bounce", 1, 16, 0.003, 0.01}));

INSTANTIATE_TEST_SUITE_P(Levels, AgainstCycles,
                         testing::Values(Case{"sponza", "cam_arcade", "torch", "", 12, 4, 0.003, 0.03},
                                         Case{"pandora", "cam_court", "lamp", "", 12, 4, 0.003, 0.02},
                                         Case{"gas_station", "cam_main", "sun", "", 12, 4, 0.005, 0.02}));

}  // namespace
}  // namespace relume
