// SPDX-License-Identifier: MIT
// Colour and strength of a light are set apart from one another, frame after frame while a control is held.
#include "tools/view/light_intensity.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

namespace relume {
namespace {

constexpr glm::vec3 kWarm(40.0f, 30.0f, 10.0f);

TEST(LightIntensity, aColourThatIsHeldLeavesTheStrength) {
  for (const glm::vec3& color : {glm::vec3(0.5f), glm::vec3(0.2f, 0.1f, 0.4f), glm::vec3(1e-6f, 0, 0)}) {
    glm::vec3 intensity = kWarm;
    for (int frame = 0; frame < 60; ++frame) intensity = withColor(intensity, color);
    EXPECT_FLOAT_EQ(strengthOf(intensity), 40.0f);
    EXPECT_LT(glm::distance(colorOfLight(intensity), color / strengthOf(color)), 1e-6f);
  }
}

TEST(LightIntensity, blackIsNoColour) {
  EXPECT_EQ(withColor(kWarm, glm::vec3(0.0f)), kWarm);
  EXPECT_EQ(withColor(kWarm, glm::vec3(-1.0f)), kWarm);
}

TEST(LightIntensity, aLightThatIsTurnedDownKeepsItsColour) {
  const glm::vec3 dark = withStrength(kWarm, 0.0f);
  EXPECT_LE(strengthOf(dark), kLeastStrength);
  EXPECT_LT(glm::distance(withStrength(dark, 40.0f), kWarm), 1e-4f);
  EXPECT_EQ(withStrength(glm::vec3(0.0f), 3.0f), glm::vec3(3.0f)) << "one that never had any is white";
}

}  // namespace
}  // namespace relume
