// SPDX-License-Identifier: MIT
// Writes the GLSL that hosts put into their shaders into a folder, for excerpts_test.py to compile what the guide has
// of such shaders with: no OpenGL is needed. Exit status 1 where a text cannot be made.
//   print_glsl FOLDER
#include "relume/edit_blend.h"
#include "relume/gpu_passes.h"
#include "runtime/live_gl/live_resolve_gl.h"
#include "runtime/shared/resolve_defines.h"
#include "runtime/shared/shader_text.h"

#include <cstdio>
#include <fstream>
#include <string>
#include <utility>

namespace {

using relume::Result;

constexpr relume::CacheBands kBands{4, 2};

bool write(const std::string& path, const Result<std::string>& text) {
  if (!text) return std::fprintf(stderr, "%s: %s\n", path.c_str(), text.error().message.c_str()), false;
  return static_cast<bool>(std::ofstream(path) << *text << std::flush);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: print_glsl FOLDER\n"), 1;
  // What a level's own numbers would be (runtime/passes/frame_plan.cpp).
  const std::pair<std::string, std::string> surfels[] = {{"RELUME_SURFEL_SLOTS", "64u"},
                                                         {"RELUME_SURFEL_ORIGIN", "vec3(0.0)"},
                                                         {"RELUME_SURFEL_STEP", "vec3(0.001)"},
                                                         {"RELUME_SURFEL_RADIUS", "0.1"}};
  const std::pair<const char*, Result<std::string>> texts[] = {
      {"glsl", relume::expandShader("resolve.glsl", relume::resolveDefines(kBands))},
      {"surfelGlsl", relume::expandShader("surfels.glsl", surfels)},
      {"beforeGlsl", relume::liveResolveGlsl({"relumeBefore", {19, 20, 21}})},
      {"afterGlsl", relume::liveResolveGlsl({"relumeAfter", {22, 23, 24}})},
      {"editGlsl", relume::EditBlend::glsl()},
      {"gpuSurfelGlsl", relume::gpuSurfelGlsl()}};
  for (const auto& [name, text] : texts)
    if (!write(std::string(argv[1]) + "/" + name, text)) return 1;
  return 0;
}
