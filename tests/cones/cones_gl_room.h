// SPDX-License-Identifier: MIT
// What tests of cones in OpenGL share: a room, cones on it, textures of a host's, and how far twins are apart.
#pragma once

#include "runtime/live_gl/cones_gl.h"
#include "tests/cones/room_pictures.h"
#include "tests/runtime/gl_test_support.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <vector>

namespace relume::test {

using Directions = RadianceMips::Directions;

// The room of the pictures with its ceiling half open, a thin wall, slanted squares and a box that moves; its sides
// send out by where they are.
struct Level {
  VoxelLevel level;
  VoxelVolume volume;
  RadianceMips mips;

  explicit Level(Directions directions = Directions::six, std::uint32_t cells = 16)
      : volume(make(level, cells)), mips(directions) {
    light();
  }
  static VoxelVolume make(VoxelLevel& level, std::uint32_t cells) {
    level.surfaces[0] = {glm::vec3(0.8f)};
    level.addQuad({-4, -4, -4}, {-4, -4, 4}, {4, -4, 4}, {4, -4, -4});
    for (const float s : {-1.0f, 1.0f}) {
      level.addBox({4 * s - 0.01f, -4, -4}, {4 * s + 0.01f, 4, 4}, false);
      level.addBox({-4, -4, 4 * s - 0.01f}, {4, 4, 4 * s + 0.01f}, false);
    }
    level.addQuad({-4, 4, -4}, {0.5f, 4, -4}, {0.5f, 4, 4}, {-4, 4, 4});
    level.addBox({-1, -4, -1}, {1, -2, 1}, false);
    std::mt19937 random(5);
    for (int i = 0; i < 30; ++i) {
      const glm::vec3 at = 3.0f * unit(random), a = 0.6f * unit(random), b = 0.6f * unit(random);
      level.addQuad(at, at + a, at + a + b, at + b);
    }
    level.addBox({-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}, false);
    level.parts.back().moves = true;
    level.parts.back().toWorld[3] = {-2.5f, -2.0f, 1.0f};
    return volumeOf(level, coarse(cells));
  }
  void light() {
    for (std::uint32_t s = 0; s < volume.sideCount(); ++s) {
      const glm::vec3 p = volume.positionOfSide(s);
      volume.setRadiance(s, {p.x > 3.5f ? 6.0f : 0.2f, 0.5f + 0.1f * p.y, volume.side(s).isFaced ? 1.0f : 0.0f});
    }
    EXPECT_TRUE(mips.update(volume));
  }
};

// Root mean square of the difference, over that of the first.
template <class Vector>
double relativeRmse(std::span<const Vector> expected, std::span<const Vector> found) {
  EXPECT_EQ(expected.size(), found.size());
  double sum = 0.0, all = 0.0;
  for (std::size_t i = 0; i < std::min(expected.size(), found.size()); ++i) {
    const Vector d = expected[i] - found[i];
    EXPECT_TRUE(std::isfinite(glm::dot(d, d))) << i;
    sum += static_cast<double>(glm::dot(d, d));
    all += static_cast<double>(glm::dot(expected[i], expected[i]));
  }
  EXPECT_GT(all, 0.0);
  return std::sqrt(sum / std::max(all, 1e-30));
}

inline double relativeRmse(std::span<const glm::vec4> expected, const std::vector<glm::vec4>& found) {
  return relativeRmse<glm::vec4>(expected, std::span<const glm::vec4>(found));
}

// groups: levels in floats, which are compared, or in halves.
inline ConesGl onGl(const PixelConeOptions& options, Directions directions = Directions::six,
                    gpu::GroupThreads groups = gpu::GroupThreads::serial) {
  auto cones = ConesGl::create({options, directions, true, EglContext::getProcAddress, groups});
  EXPECT_TRUE(cones) << cones.error().message;
  return std::move(*cones);
}

// A texture of RGBA32F.
inline GLuint textureOf(std::uint32_t width, std::uint32_t height, const std::vector<glm::vec4>& texels) {
  GLuint name = 0;
  glGenTextures(1, &name);
  glBindTexture(GL_TEXTURE_2D, name);
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height), GL_RGBA, GL_FLOAT,
                  texels.data());
  glBindTexture(GL_TEXTURE_2D, 0);
  return name;
}

class ConesOnGl : public GlTest {};

}  // namespace relume::test
