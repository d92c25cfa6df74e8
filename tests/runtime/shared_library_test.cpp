// SPDX-License-Identifier: MIT
// librelume.so alone, as a game links it: each function that include/relume/ declares is there. The list of what it
// exports (runtime/relume.map) is written by hand.
#include "relume/bake_file.h"
#include "relume/edit_blend.h"
#include "relume/gpu_passes.h"
#include "relume/live_light.h"
#include "relume/moving_shapes.h"
#include "relume/relighter.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

TEST(SharedLibrary, hasWhatTheHeadersDeclareOfFiles) {
  const Bake none;
  const char* const nowhere = "/nowhere/at/all.relume";
  EXPECT_FALSE(writeBake(none, nowhere));
  EXPECT_FALSE(serializeBake(none));
  EXPECT_FALSE(writePackedBake(none, 1, nowhere));
  EXPECT_FALSE(serializePackedBake(none, 1));
  EXPECT_FALSE(readBake(nowhere));
  EXPECT_FALSE(mapBake(nowhere));
  EXPECT_FALSE(parseBake({}, nullptr));
  EXPECT_FALSE(identifyBakeFile(nowhere));
}

TEST(SharedLibrary, hasWhatTheHeadersDeclareOfLight) {
  const Bake none;
  EXPECT_FALSE(Relighter::create(none, {}));
  EXPECT_FALSE(GpuPasses::create(none, {}, {}));
  EXPECT_FALSE(gpuResolveGlsl({}, LinkKind::oct6));
  EXPECT_TRUE(gpuSurfelGlsl());
  EXPECT_TRUE(MovingShapes::create({}));
  LiveLightOptions options;
  options.cells = 0;
  EXPECT_FALSE(LiveLight::create({}, options));
  EXPECT_TRUE(EditBlend::create({}));
  EXPECT_EQ(blendEdited(glm::vec3(1.0f), glm::vec3(2.0f), glm::vec3(3.0f), {}), glm::vec3(1.0f));
  EXPECT_TRUE(projectEnvironment({}, {}, 1, 1).empty());
  EXPECT_TRUE(twoColorSky({}, glm::vec3(0.0f), glm::vec3(0.0f)).empty());
  EXPECT_TRUE(shSky({}, {}).empty());
  // No relighter comes of an empty bake: its address has to do.
  Result<int> (*volatile converge)(Relighter&, const LightSetup&, float, int) = &relightUntilConverged;
  EXPECT_TRUE(converge != nullptr);
}

}  // namespace
}  // namespace relume
