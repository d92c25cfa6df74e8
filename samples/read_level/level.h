// SPDX-License-Identifier: MIT
// A level as the game loads it: what `relume bake --export-glb` wrote, with light-map coordinates on its vertices.
#pragma once

#include <relume/lights.h>
#include <relume/result.h>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <string>
#include <vector>

struct Vertex {
  glm::vec3 position, normal;  // world space
  glm::vec2 uv;
  std::uint16_t lightmapUv[2];  // 65535, 65535: lit by the grid
};

struct Material {
  glm::vec4 color{1.0f};
  glm::vec3 emission{0.0f};  // [W/m²/sr]
  float alphaCutoff = 0.0f;
  int image = -1;
};

struct Image {
  int width = 0, height = 0;
  std::vector<unsigned char> rgba;  // sRGB
};

struct Draw {
  std::uint32_t firstIndex = 0, indexCount = 0;
  std::size_t material = 0;
};

struct Level {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<Draw> draws;
  std::vector<Material> materials;  // the last is that of primitives without one
  std::vector<Image> images;
  relume::Light sun{.kind = relume::LightKind::directional, .intensity = glm::vec3(0.0f)};
  relume::Light lamp{.intensity = glm::vec3(0.0f)};
  glm::mat4 worldFromCamera{1.0f};     // a rotation and a place: no scale
  float fovYRad = 1.0471976f;          // of a level without a perspective camera: 60 degrees
  glm::vec3 low{1e30f}, high{-1e30f};  // bounds [m]
  std::uint64_t bakeScene = 0;         // Provenance::sceneHash of the bake that belongs to it
};

relume::Result<Level> loadLevel(const std::string& path);

// Appends a unit cube about the origin, lit by the grid as all that moves. It is none of `draws`.
Draw appendCube(Level& level);
