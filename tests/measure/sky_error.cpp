// SPDX-License-Identifier: MIT
// Error of a view that a sky map lights, and nothing else, against `relume reference`'s path tracer, for turns of the
// map. The sky rises from the horizon, is blue, ten times as bright and warm toward +X, and has a dark ground. Prints
// rows of docs/notes/sky.md.
//   bench_sky_error LEVEL.glb BAKE.relume CAMERA [PATHS [DEGREES...]]
#include "formats/equirectangular.h"
#include "tests/measure/compare_frame.h"
#include "tests/measure/open_view.h"
#include "tools/render/reference_layers.h"
#include "tools/render/render_cpu.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

namespace relume {
namespace {

SkyMap makeSky() {
  SkyMap map{256, 128, {}};
  for (std::uint32_t y = 0; y < map.height; ++y) {
    for (std::uint32_t x = 0; x < map.width; ++x) {
      const glm::vec3 d = fromEquirectangular({(x + 0.5) / map.width, (y + 0.5) / map.height});
      const float glow = std::pow(std::max(0.0f, d.x), 4.0f);
      const glm::vec3 above = glm::vec3(0.6f, 0.9f, 1.6f) + glow * glm::vec3(6.0f, 3.5f, 0.5f);
      map.texels.push_back(d.y < 0.0f ? glm::vec3(0.1f, 0.09f, 0.08f) : above);
    }
  }
  return map;
}

int fail(const std::string& message) { return std::fprintf(stderr, "%s\n", message.c_str()), 1; }

int measure(const std::string& level, const std::string& bakePath, const std::string& camera, std::uint32_t paths,
            const std::vector<float>& turns) {
  Context context;
  const auto view = test::openView(level, bakePath, camera, context);
  if (!view) return fail(view.error().message);

  const auto map = std::make_shared<const SkyMap>(makeSky());
  std::printf("| turned by | RMSE %% | t1 %% | energy | noise of the reference %% |\n|---:|---:|---:|---:|---:|\n");
  for (const float turn : turns) {
    const Sky sky{{}, {}, map, turn};
    RenderRequest request;
    request.bake = &view->bake;
    request.camera = view->camera;
    request.sky = sky;
    ReferenceOptions options;
    options.samplesPerPixel = paths;
    options.sky = sky;
    const auto frame = renderCpu(view->tracer, request, context);
    if (!frame) return fail(frame.error().message);
    const auto truth = renderReference(view->tracer, view->camera, {}, options, context);
    if (!truth) return fail(truth.error().message);
    const auto d =
        test::compareFrame(toChannels(*truth, radianceOf(*truth)), {"DiffDir", "DiffInd"}, *frame, Aov::indirect);
    if (!d) return fail(d.error().message);
    std::printf("| %g | %.1f | %.1f | %.3f | %.1f |\n", static_cast<double>(turn), 100 * d->rmseClean,
                100 * d->rmseTrimmed, d->energy, 100 * d->noise);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 4)
    return std::fprintf(stderr, "usage: bench_sky_error LEVEL.glb BAKE.relume CAMERA [PATHS [DEGREES...]]\n"), 1;
  std::vector<float> turns;
  for (int i = 5; i < argc; ++i) turns.push_back(std::strtof(argv[i], nullptr));
  if (turns.empty()) turns = {0.0f, 120.0f};
  const int paths = argc > 4 ? std::atoi(argv[4]) : 256;
  return relume::measure(argv[1], argv[2], argv[3], static_cast<std::uint32_t>(std::max(1, paths)), turns);
}
