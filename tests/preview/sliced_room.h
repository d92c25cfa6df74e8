// SPDX-License-Identifier: MIT
// A room with two blocks for previews: each of its slices along x is a leaf, whose light a test says.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace relume::test {

struct SlicedRoom {
  static constexpr std::uint32_t kSlices = 32;

  Scene scene;
  std::optional<RayTracer> tracer;

  SlicedRoom() {
    addInstance(scene, box({-2, 0, -2}, {2, 3, 2}, true));
    addInstance(scene, box({-1, 0, -1}, {0, 1.2f, 0}, false));
    addInstance(scene, box({0.6f, 0, -0.9f}, {1.1f, 0.7f, -0.2f}, false));
    finish(scene);
    Context context;
    auto made = RayTracer::create(scene, "avx2", context, RayStructure::bundles);
    EXPECT_TRUE(made);
    tracer.emplace(std::move(*made));
  }
  static void leavesOf(std::span<const Ray> rays, std::span<const Hit> hits, std::span<std::uint32_t> leaf) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const float x = rays[i].origin.x + hits[i].distance * rays[i].direction.x;
      if (hits[i]) leaf[i] = static_cast<std::uint32_t>(std::clamp((x + 2.0f) / 4.0f, 0.0f, 0.999f) * kSlices);
    }
  }
  // Of the slices: brightest at `center` [0..1].
  static std::vector<glm::vec3> lightAround(float center) {
    std::vector<glm::vec3> radiance;
    for (std::uint32_t i = 0; i < kSlices; ++i) {
      const float x = (static_cast<float>(i) + 0.5f) / kSlices - center;
      radiance.push_back(glm::vec3(1.0f, 0.8f, 0.5f) * (0.2f + 2.0f * std::exp(-20.0f * x * x)));
    }
    return radiance;
  }
  static Camera cameraAt(float turnDeg) {
    const glm::vec3 eye(0.8f, 1.8f, 1.0f), forward = glm::normalize(glm::vec3(-0.5f, 0.4f, -0.6f) - eye);
    const glm::mat4 turn = glm::rotate(glm::mat4(1.0f), glm::radians(turnDeg), glm::vec3(0, 1, 0));
    return lookAt(eye, eye + glm::vec3(turn * glm::vec4(forward, 0.0f)), 1.0f);
  }
};

}  // namespace relume::test
