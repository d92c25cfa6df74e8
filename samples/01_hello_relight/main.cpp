// SPDX-License-Identifier: MIT
// The runtime in one sitting: load a bake, relight it under a moving lamp and a sun, ask what light arrives at a point.
//   hello_relight LEVEL.relume [X Y Z]        X Y Z: the point [m], by default over the middle of the floor
#include "relume/bake_file.h"
#include "relume/relighter.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

// Whether the text is a finite number and nothing else.
static bool readNumber(const char* text, float& number) {
  char* end = nullptr;
  number = std::strtof(text, &end);
  return end != text && *end == '\0' && std::isfinite(number);
}

int main(int argc, char** argv) {
  glm::vec3 given(0.0f);
  const bool isGiven =
      argc == 5 && readNumber(argv[2], given.x) && readNumber(argv[3], given.y) && readNumber(argv[4], given.z);
  if (argc != 2 && !isGiven) {
    std::fprintf(stderr, "usage: hello_relight LEVEL.relume [X Y Z]\n");
    return 1;
  }

  // 1. Map the bake: its arrays are used where they lie in the file
  relume::Result<relume::Bake> bake = relume::mapBake(argv[1]);
  if (!bake) return std::fprintf(stderr, "%s\n", bake.error().message.c_str()), exitCode(bake.error().code);
  if (bake->caches.grid.resolution.x == 0) {
    std::fprintf(stderr, "%s: no grid to read light in the air from: bake without --grid-caches 0\n", argv[1]);
    return 1;
  }

  // 2. A relighter on the CPU; options.parallelFor would hand its loops to the game's job system
  relume::Result<relume::Relighter> relighter = relume::Relighter::create(*bake, relume::RelightOptions{});
  if (!relighter)
    return std::fprintf(stderr, "%s\n", relighter.error().message.c_str()), exitCode(relighter.error().code);

  // 3. Where to look: half a metre over the floor that is nearest to the middle, which itself may lie in a wall
  glm::vec3 middle(0.0f);
  for (const glm::vec3& p : bake->surfels.positionWorld) middle += p / static_cast<float>(bake->surfels.count());
  glm::vec3 point = middle;
  float nearest = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < bake->surfels.count(); ++i) {
    const float distance = glm::distance(bake->surfels.positionWorld[i], middle);
    if (bake->surfels.normal[i].y < 0.7f || distance >= nearest) continue;
    nearest = distance;
    point = bake->surfels.positionWorld[i] + glm::vec3(0.0f, 0.5f, 0.0f);
  }
  if (isGiven) point = given;

  // 4. This frame's light: a sun and a lamp. Nothing is in shadow here; a game sets `visibility`
  relume::Light sun, lamp;
  sun.kind = relume::LightKind::directional;
  sun.intensity = {9.0f, 8.5f, 7.5f};                              // [W/m²]
  sun.direction = glm::normalize(glm::vec3(0.28f, -0.75f, 0.6f));  // of length 1, or relight() refuses it
  lamp.kind = relume::LightKind::point;
  lamp.intensity = {4.0f, 3.0f, 2.0f};  // [W/sr]

  // 5. The game's loop: move the lamp, relight, read. Each frame adds one bounce of the frame before
  for (int frame = 0; frame < 16; ++frame) {
    const float angle = 0.4f * static_cast<float>(frame);
    lamp.positionWorld = point + glm::vec3(std::cos(angle), 0.5f, std::sin(angle));
    const relume::Light lights[] = {sun, lamp};
    relume::LightSetup setup;
    setup.lights = lights;
    // A setup that cannot be lit leaves last frame's light: look, or the light freezes in silence
    if (const relume::Status lit = relighter->relight(setup); !lit)
      return std::fprintf(stderr, "%s\n", lit.error().message.c_str()), exitCode(lit.error().code);

    const glm::vec3 up = relighter->irradianceInGrid(point, {0.0f, 1.0f, 0.0f});
    std::printf("frame %2d: irradiance at (%.2f %.2f %.2f) facing up: %.4f %.4f %.4f W/m2", frame, point.x, point.y,
                point.z, up.r, up.g, up.b);
    double total = 0.0;
    for (const relume::PassTime& pass : relighter->passTimes()) total += pass.ms;
    std::printf("   %.2f ms\n", total);
  }
  return 0;
}
