// SPDX-License-Identifier: MIT
// Run by the build: puts Relume's GLSL in front of a shader of the sample's.
//   vulkan_headless_shaders light_surfels|picture SCENE.glsl SHADER.comp OUT.comp
#include "light_options.h"

#include <relume/gpu_passes.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

int main(int argc, char** argv) {
  if (argc != 5) return std::fprintf(stderr, "usage: vulkan_headless_shaders NAME SCENE SHADER OUT\n"), 1;
  const bool picture = std::string(argv[1]) == "picture";
  // Bakes of the default links, oct6.
  const relume::Result<std::string> relume =
      picture ? relume::gpuResolveGlsl(lightOptions(), relume::LinkKind::oct6) : relume::gpuSurfelGlsl();
  if (!relume) return std::fprintf(stderr, "%s\n", relume.error().message.c_str()), exitCode(relume.error().code);
  std::ofstream out(argv[4]);
  out << "#version 450\n" << *relume;
  for (const char* path : {argv[2], argv[3]}) {
    std::ifstream in(path);
    out << std::string(std::istreambuf_iterator<char>(in), {});
  }
  return out.flush() ? 0 : (std::fprintf(stderr, "%s cannot be written\n", argv[4]), 2);
}
