// SPDX-License-Identifier: MIT
// Relume in Vulkan without a window: a level lit by its sun and lamp, with shadows, and drawn into a file.
//   vulkan_headless LEVEL_GAME.glb LEVEL.relume OUT.png [FRAMES [all|indirect]]
//       FRAMES: of light, each one bounce more; 12 without. indirect: irradiance / pi by indirect light alone
// LEVEL_GAME.glb is what `relume bake LEVEL.glb -o LEVEL.relume --export-glb LEVEL_GAME.glb` wrote.
#include "device.h"
#include "light_options.h"
#include "renderer.h"

#include <relume/bake_file.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include <stb/stb_image_write.h>

namespace {

constexpr std::uint32_t kWidth = 480, kHeight = 270;

int fail(const relume::Error& error) {
  std::fprintf(stderr, "vulkan_headless: %s\n", error.message.c_str());
  return relume::exitCode(error.code);
}

int light(const std::string& glb, const std::string& relume, const char* picture, int frames, bool indirect) {
  // 1. The level, its bake, and a device
  relume::Result<Level> level = loadLevel(glb);
  if (!level) return fail(level.error());
  relume::Result<relume::Bake> bake = relume::mapBake(relume);
  if (!bake) return fail(bake.error());
  if (level->bakeScene != bake->provenance.sceneHash)
    return fail({relume::ErrorCode::invalidFile, relume + " is not the bake that " + glb + " was exported with"});
  if (bake->links.kind == relume::LinkKind::irradiance)
    return fail({relume::ErrorCode::usage, relume + " has irradiance links, the picture's shader is for others"});
  if (bake->caches.grid.resolution.x == 0)
    std::fprintf(stderr, "%s: no grid, so that backs get no indirect light: bake without --grid-caches 0\n",
                 relume.c_str());
  Device device;
  if (relume::Status opened = device.open(); !opened) return fail(opened.error());

  // 2. Relume's passes as data
  relume::GpuDevice limits = relume::gpuDeviceOf(device.handles());
  limits.hasSurfelShader = true;
  relume::Result<relume::GpuPasses> passes = relume::GpuPasses::create(*bake, lightOptions(), limits);
  if (!passes) return fail(passes.error());

  // 3. What runs them, the game's loop, and a picture of its last frame
  Renderer renderer(device, *level, *passes);
  for (int frame = 0; frame < frames; ++frame) {
    if (relume::Status lit = renderer.relight(*level); !lit) return fail(lit.error());
  }
  const std::vector<unsigned char> rgba = renderer.draw(*level, kWidth, kHeight, indirect);
  if (stbi_write_png(picture, kWidth, kHeight, 4, rgba.data(), 4 * kWidth) == 0)
    return fail({relume::ErrorCode::io, std::string(picture) + " could not be written"});
  return 0;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string show = argc > 5 ? argv[5] : "all";
  const int frames = argc > 4 ? std::atoi(argv[4]) : 12;
  if (argc < 4 || argc > 6 || frames < 1 || (show != "all" && show != "indirect")) {
    std::fprintf(stderr, "usage: vulkan_headless LEVEL_GAME.glb LEVEL.relume OUT.png [FRAMES [all|indirect]]\n");
    return 1;
  }
  return light(argv[1], argv[2], argv[3], frames, show == "indirect");
} catch (const relume::Error& error) {
  return fail(error);
}
