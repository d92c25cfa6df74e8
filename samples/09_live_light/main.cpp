// SPDX-License-Identifier: MIT
// Light without a bake: two rooms, a lamp in one of them, and a wall between that is taken away while the light runs.
//   live_light
// Prints the irradiance on the floor of the dark room, frame by frame.
#include "relume/live_light.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace {

// The level as a game would hand it over: triangles in the axes of their part.
struct Box {
  std::vector<glm::vec3> position;
  std::vector<glm::uvec3> triangle;
  std::vector<std::uint32_t> surface = std::vector<std::uint32_t>(12, 0);

  Box(const glm::vec3& low, const glm::vec3& high, bool inward) {
    for (unsigned i = 0; i < 8; ++i)
      position.emplace_back((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                            (i & 4) != 0 ? high.z : low.z);
    const unsigned faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (const auto& f : faces) {
      triangle.emplace_back(inward ? glm::uvec3(f[0], f[2], f[1]) : glm::uvec3(f[0], f[1], f[2]));
      triangle.emplace_back(inward ? glm::uvec3(f[0], f[3], f[2]) : glm::uvec3(f[0], f[2], f[3]));
    }
  }
  relume::VoxelMesh mesh() const { return {position, triangle, surface}; }
};

int refuse(const relume::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return relume::exitCode(error.code);
}

}  // namespace

int main() {
  // 1. What there is: a surface, two meshes, a part of each
  const Box rooms({0, 0, 0}, {8, 3, 4}, true), wall({3.9f, 0, 0}, {4.1f, 3, 4}, false);
  const relume::VoxelSurface surfaces[] = {{glm::vec3(0.7f, 0.6f, 0.5f)}};
  const relume::VoxelMesh meshes[] = {rooms.mesh(), wall.mesh()};
  const relume::VoxelPart parts[] = {{.mesh = 0}, {.mesh = 1}};

  // 2. Its voxels; options.parallelFor would hand the loops to the game's job system, BackendKind::gl the frames to the
  // GPU
  relume::Result<relume::LiveLight> light = relume::LiveLight::create({surfaces, meshes, parts}, {});
  if (!light) return refuse(light.error());
  std::printf("%u voxels\n", light->voxels().occupied);

  // 3. A lamp. Its shadows are the game's: here the wall's, while it stands
  bool stands = true;
  relume::Light lamp;
  lamp.positionWorld = {1.5f, 2.2f, 2.0f};
  lamp.intensity = {12, 10, 8};  // [W/sr]
  const relume::Light lights[] = {lamp};
  relume::LightSetup setup;
  setup.lights = lights;
  setup.visibility = [&](std::uint32_t, const glm::vec3& p, const glm::vec3&) {
    return stands && p.x > 4.0f ? 0.0f : 1.0f;
  };

  // 4. Frames of 1/30 s. After half of them the wall is gone
  constexpr int kFrames = 60;
  for (int frame = 0; frame < kFrames; ++frame) {
    if (frame == kFrames / 2) {
      stands = false;
      const relume::PartEdit gone[] = {{.part = 1, .present = false}};
      if (const relume::Status edited = light->edit(gone); !edited) return refuse(edited.error());
    }
    relume::LiveFrame next;
    next.raySet = static_cast<std::uint32_t>(frame);
    next.keep = std::exp(-1.0f / 30.0f / 0.15f);  // noise of single frames fades into the ones before
    if (const relume::Status lit = light->update(setup, next); !lit) return refuse(lit.error());
    const glm::vec3 e = light->irradiance({6, 0, 2}, {0, 1, 0});
    if (frame % 10 == 9) std::printf("frame %2d: indirect %.4f %.4f %.4f W/m2\n", frame, e.r, e.g, e.b);
  }
  return 0;
}
