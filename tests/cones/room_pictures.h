// SPDX-License-Identifier: MIT
// A lit room of boxes, and what a camera in it sees, for tests of cones of pixels.
#pragma once

#include "runtime/cones/pixel_cones.h"
#include "tests/live/lit_volumes.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace relume::test {

// A room that sends out 1 and has a lamp's worth more on one wall, and its mips.
struct Room {
  VoxelVolume volume;
  RadianceMips mips;

  explicit Room(bool even) : volume(make()) {
    const auto irradiance = [&](const SideAt& at) {
      const bool isRed = !even && volume.positionOf(at).x > 3.5f;
      return std::numbers::pi_v<float> * (isRed ? glm::vec3(5.0f, 0.0f, 0.0f) : glm::vec3(1.0f));
    };
    volume.reflect(irradiance, glm::vec3(0.0f));
    EXPECT_TRUE(mips.update(volume));
  }
  static VoxelVolume make() {
    VoxelLevel level;
    level.surfaces[0] = {glm::vec3(1.0f)};
    level.addBox({-4, -4, -4}, {4, 4, 4}, true);
    level.addBox({-1, -4, -1}, {1, -2, 1}, false);
    return volumeOf(level, coarse(16));
  }
};

// What a camera in the room sees, by rays against its two boxes.
struct Picture {
  std::uint32_t width, height;
  std::vector<glm::vec3> position, normal;
  std::vector<float> depth;
  glm::mat4 clipFromWorld;

  Picture(std::uint32_t w, std::uint32_t h, const glm::vec3& eye, const glm::vec3& target)
      : width(w), height(h), position(w * h), normal(w * h), depth(w * h) {
    const float aspect = static_cast<float>(w) / static_cast<float>(h);
    const glm::mat4 view = glm::lookAt(eye, target, glm::vec3(0, 1, 0));
    clipFromWorld = glm::perspective(1.2f, aspect, 0.1f, 100.0f) * view;
    const glm::mat4 worldFromView = glm::inverse(view);
    const float half = std::tan(0.6f);
    for (std::uint32_t i = 0; i < w * h; ++i) {
      const float x = (2.0f * (static_cast<float>(i % w) + 0.5f) / static_cast<float>(w) - 1.0f) * half * aspect,
                  y = (1.0f - 2.0f * (static_cast<float>(i / w) + 0.5f) / static_cast<float>(h)) * half;
      const glm::vec3 d(worldFromView * glm::vec4(x, y, -1.0f, 0.0f));
      depth[i] = hit(eye, d, position[i], normal[i]);
    }
  }

  // In lengths of the ray, which goes one metre along the viewing axis.
  static float hit(const glm::vec3& eye, const glm::vec3& d, glm::vec3& position, glm::vec3& normal) {
    float nearest = std::numeric_limits<float>::infinity();
    for (int a = 0; a < 3; ++a) {
      const auto plane = [&](float at, float towards, const glm::vec3& low, const glm::vec3& high) {
        const float t = (at - eye[a]) / d[a];
        const glm::vec3 p = eye + t * d;
        for (int b = 0; b < 3; ++b) {
          if (b != a && (p[b] < low[b] || p[b] > high[b])) return;
        }
        if (t > 0.0f && t < nearest) {
          nearest = t;
          position = p;
          normal = glm::vec3(0.0f);
          normal[a] = towards;
        }
      };
      if (d[a] == 0.0f) continue;
      plane(d[a] > 0.0f ? 4.0f : -4.0f, d[a] > 0.0f ? -1.0f : 1.0f, glm::vec3(-4.001f), glm::vec3(4.001f));
      const glm::vec3 low(-1, -4, -1), high(1, -2, 1);
      plane(d[a] > 0.0f ? low[a] : high[a], d[a] > 0.0f ? -1.0f : 1.0f, low, high);
    }
    return nearest;
  }

  PixelReceivers receivers() const { return {width, height, position, normal, normal, depth, clipFromWorld}; }
};

inline PixelCones conesOf(const PixelConeOptions& options) { return std::move(*PixelCones::create(options)); }

inline double meanDifference(std::span<const glm::vec4> a, std::span<const glm::vec4> b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += glm::length(glm::vec3(a[i]) - glm::vec3(b[i]));
  return sum / static_cast<double>(a.size());
}

}  // namespace relume::test
