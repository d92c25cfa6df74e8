// SPDX-License-Identifier: MIT
// The light that node_test.mjs compares with: native_light BAKE OUT writes, after the frames of frames() there, the
// coefficients of all caches, then the irradiance in the grid at each surfel, then the coefficients after the same
// frames with a box that moves, as floats.
#include "relume/bake_file.h"
#include "relume/relighter.h"

#include <array>
#include <cstdio>
#include <fstream>
#include <span>
#include <vector>

using namespace relume;

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const Result<Bake> bake = readBake(argv[1]);
  if (!bake) return std::fprintf(stderr, "%s\n", bake.error().message.c_str()), 1;
  RelightOptions options;
  options.simd = Simd::baseline;
  Result<Relighter> relighter = Relighter::create(*bake, options);
  if (!relighter) return std::fprintf(stderr, "%s\n", relighter.error().message.c_str()), 1;

  std::array<Light, 2> lights;
  lights[0].kind = LightKind::directional;
  lights[0].intensity = {9.0f, 8.0f, 7.0f};
  lights[0].direction = {0.0f, -1.0f, 0.0f};
  lights[1].kind = LightKind::spot;
  lights[1].intensity = {20.0f, 30.0f, 40.0f};
  lights[1].positionWorld = {1.0f, 1.5f, -1.0f};
  lights[1].direction = {0.0f, 0.0f, -1.0f};
  lights[1].innerConeRad = 0.5f;
  lights[1].outerConeRad = 1.0f;
  LightSetup setup;
  setup.lights = lights;
  setup.skyRadiance = {0.1f, 0.2f, 0.4f};
  setup.emissionScale = {1.0f, 0.5f, 2.0f};
  setup.bounceScale = 0.9f;
  // Points above the horizontal plane of the lamp are in the sun's shadow, by a rule that both sides can follow.
  setup.visibilityBatch = [](std::uint32_t light, std::span<const glm::vec3> positions, std::span<const glm::vec3>,
                             std::span<float> visible) {
    for (std::size_t i = 0; i < positions.size(); ++i) visible[i] = light == 0 && positions[i].y > 1.5f ? 0.25f : 1.0f;
  };
  for (int frame = 0; frame < 4; ++frame) {
    if (const Status lit = relighter->relight(setup); !lit)
      return std::fprintf(stderr, "%s\n", lit.error().message.c_str()), 1;
  }
  std::vector<glm::vec3> irradiance(bake->surfels.count());
  std::vector<glm::vec3> positions = bake->surfels.positionWorld.toVector();
  const std::vector<glm::vec3> normals = bake->surfels.normal.toVector();
  for (std::size_t i = 0; i < positions.size(); ++i) positions[i] += 0.05f * normals[i];
  if (!relighter->irradianceInGrid(positions, normals, irradiance)) return 1;

  const std::vector<float> coefficients = relighter->cacheCoefficients();

  // A box that comes nearer to the lamp, turned about the vertical.
  std::vector<glm::vec3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back((i & 1) != 0 ? 0.4f : -0.4f, (i & 2) != 0 ? 0.3f : -0.3f, (i & 4) != 0 ? 0.5f : -0.5f);
  const std::vector<glm::uvec3> sides{{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const glm::vec3 red(0.8f, 0.2f, 0.1f), glow(0.0f, 2.0f, 1.0f);
  const MovingMesh box{corners, sides, {&red, 1}, {&glow, 1}};
  const Result<MovingShapes> shapes = MovingShapes::create({&box, 1});
  options.movingParts = 2;
  Result<Relighter> moving = Relighter::create(*bake, options);
  if (!shapes || !moving) return 1;
  setup.movingShapes = &*shapes;
  for (int frame = 0; frame < 4; ++frame) {
    MovingPart part;
    part.toWorld = glm::mat4x3{{0.6f, 0.0f, -0.8f},
                               {0.0f, 1.0f, 0.0f},
                               {0.8f, 0.0f, 0.6f},
                               {2.0f + 0.25f * static_cast<float>(frame), 1.0f, 2.0f}};
    setup.movingParts = {&part, 1};
    if (const Status lit = moving->relight(setup); !lit)
      return std::fprintf(stderr, "%s\n", lit.error().message.c_str()), 1;
  }
  const std::vector<float> shadowed = moving->cacheCoefficients();
  std::ofstream out(argv[2], std::ios::binary);
  out.write(reinterpret_cast<const char*>(coefficients.data()),
            static_cast<std::streamsize>(coefficients.size() * sizeof(float)));
  out.write(reinterpret_cast<const char*>(irradiance.data()),
            static_cast<std::streamsize>(irradiance.size() * sizeof(irradiance[0])));
  out.write(reinterpret_cast<const char*>(shadowed.data()),
            static_cast<std::streamsize>(shadowed.size() * sizeof(float)));
  return out.flush() ? 0 : 1;
}
