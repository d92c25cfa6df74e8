// SPDX-License-Identifier: MIT
// Shadows that are asked for once.
#include "tools/render/kept_shadows.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

namespace relume {
namespace {

TEST(KeptShadows, askForEachBatchOfEachLightOnce) {
  std::atomic<int> asked{0};
  KeptShadows shadows([&](std::uint32_t light, const glm::vec3& position, const glm::vec3& normal) {
    ++asked;
    return 100.0f * static_cast<float>(light) + 10.0f * normal.y + position.x;
  });
  const std::vector<glm::vec3> up(3, glm::vec3(0, 1, 0)), down(3, glm::vec3(0, -1, 0)),
      here = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, there = {{0, 0, 0}, {2, 0, 0}, {1, 0, 0}};
  const auto ask = [&](std::uint32_t light, const std::vector<glm::vec3>& position,
                       const std::vector<glm::vec3>& normal) {
    std::vector<float> visible(position.size(), -1.0f);
    shadows(light, position, normal, visible);
    return visible;
  };
  for (int frame = 0; frame < 3; ++frame) {
    EXPECT_EQ(ask(0, here, up), (std::vector<float>{10, 11, 12}));
    EXPECT_EQ(ask(1, here, up), (std::vector<float>{110, 111, 112}));
    EXPECT_EQ(ask(0, there, up), (std::vector<float>{10, 12, 11}));
    EXPECT_EQ(ask(0, here, down), (std::vector<float>{-10, -9, -8}));
    EXPECT_EQ(ask(0, {here[0], here[1]}, {up[0], up[1]}), (std::vector<float>{10, 11}));
    EXPECT_EQ(asked, 14) << "in frame " << frame;
  }
}

}  // namespace
}  // namespace relume
