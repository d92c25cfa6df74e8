// SPDX-License-Identifier: MIT
// A deferred renderer in five passes: shadow maps, the surfels' light and Relume's frame, a G-buffer, lighting with
// tone mapping. Its OpenGL objects live as long as the context.
#pragma once

#include "level.h"

#include <relume/bake_data.h>
#include <relume/relighter.h>

#include <glm/mat4x4.hpp>

#include <optional>
#include <vector>

// What changes from frame to frame.
struct Frame {
  glm::mat4 worldFromCamera{1.0f};
  float fovYRad = 1.0f;
  relume::Light sun, lamp;
  std::vector<glm::mat4> boxes;  // the character: cubes, put into the world
  int show = 0;                  // 0 all; irradiance / pi by 1 direct, 2 indirect light
};

class Renderer {
 public:
  // `cube`: of the level, for Frame::boxes. The level must outlive the renderer.
  static relume::Result<Renderer> create(const Level& level, const Draw& cube, const relume::Bake& bake, int width,
                                         int height, relume::GetProcAddress getProcAddress);
  // Draws into a picture of its own; present() puts it on the window.
  relume::Status draw(const Frame& frame);
  void present(int windowWidth, int windowHeight) const;
  std::vector<unsigned char> picture() const;  // RGB, rows from the bottom
  const relume::Relighter& relighter() const { return *relighter_; }

 private:
  void makeMeshes();
  void makeTargets();
  void drawSolids(const glm::mat4& clipFromWorld, const Frame& frame) const;
  glm::mat4 drawShadows(const Frame& frame);  // and hands the frame to the shaders; returns clip from world
  glm::mat4 clipOfSun(const glm::vec3& direction, float& texel) const;

  const Level* level_ = nullptr;
  Draw cube_;
  std::optional<relume::Relighter> relighter_;
  int width_ = 0, height_ = 0;
  unsigned solid_ = 0, lighting_ = 0, surfels_ = 0;  // programs
  unsigned vertexArray_ = 0, frameBlock_ = 0, white_ = 0;
  std::vector<unsigned> images_;
  unsigned gBuffer_ = 0, target_[6] = {};  // albedo, normals, light-map coordinates, emission, depth
  unsigned result_ = 0, resultColor_ = 0, shadowBuffer_ = 0, sunMap_ = 0, lampMap_ = 0;
};
