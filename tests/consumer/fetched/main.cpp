// SPDX-License-Identifier: MIT
// The game: relight a bake once, through the public headers alone.
#include "relume/bake_file.h"
#include "relume/relighter.h"

#include <cstdio>

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  const relume::Result<relume::Bake> bake = relume::mapBake(argv[1]);
  if (!bake) return std::fprintf(stderr, "%s\n", bake.error().message.c_str()), 2;
  relume::Result<relume::Relighter> relighter = relume::Relighter::create(*bake, relume::RelightOptions{});
  if (!relighter) return std::fprintf(stderr, "%s\n", relighter.error().message.c_str()), 3;
  relume::Light sun;
  sun.kind = relume::LightKind::directional;
  sun.direction = {0.0f, -1.0f, 0.0f};
  sun.intensity = {1.0f, 1.0f, 1.0f};
  relume::LightSetup setup;
  setup.lights = {&sun, 1};
  return relighter->relight(setup) ? 0 : 4;
}
