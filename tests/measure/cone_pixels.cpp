// SPDX-License-Identifier: MIT
// What one cone a pixel loses against 25, stage by stage, what each pass costs (one thread), and how much the picture
// flickers as the camera moves. Prints the tables of pixels of docs/notes/cones.md.
//   bench_cone_pixels LEVEL.glb CAMERA LIGHTS BAKE.relume [WIDTH HEIGHT]
#include "tests/measure/g_buffer.h"
#include "tests/measure/traced_light.h"
#include "tools/render/live_view.h"
#include "tools/render/relight_by_rays.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr int kFrames = 10;      // of the dolly
constexpr float kStepM = 0.02f;  // [m] a frame

int fail(const std::string& message) { return std::fprintf(stderr, "%s\n", message.c_str()), 1; }

struct Run {
  std::vector<glm::vec4> light;
  std::vector<PassTime> times;
};

Run runOnce(const ConeTracer& tracer, const test::GBuffer& g, const PixelConeOptions& options) {
  auto cones = PixelCones::create(options);
  if (Status ok = cones->update(tracer, g.receivers(), {}); !ok) std::exit(fail(ok.error().message));
  return {{cones->light().begin(), cones->light().end()}, cones->passTimes()};
}

// Brightness that all but one pixel in a hundred stay below.
double whiteOf(const std::vector<glm::vec4>& light) {
  std::vector<float> values;
  for (const glm::vec4& l : light) values.push_back(std::max({l.x, l.y, l.z}));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return std::max(1e-9, static_cast<double>(*at));
}

// Share of pixels whose sum of absolute differences of R, G, B is over 0.1 of white, and its mean.
void printDifference(const char* name, const std::vector<glm::vec4>& all, const Run& run, double white) {
  double over = 0.0, sum = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const glm::vec3 d = glm::abs(glm::vec3(all[i]) - glm::vec3(run.light[i]));
    const double sad = static_cast<double>(d.x + d.y + d.z) / white;
    sum += sad;
    if (sad > 0.1) over += 1.0;
  }
  const auto n = static_cast<double>(all.size());
  std::printf("| %s | %.1f | %.4f |", name, 100.0 * over / n, sum / n);
  for (const PassTime& pass : run.times) std::printf(" %.1f |", pass.ms);
  std::printf("\n");
}

// Mean change of a surface's light from frame to frame, of white, as the camera moves sideways.
double flicker(const test::OpenedView& view, const ConeTracer& tracer, std::uint32_t w, std::uint32_t h,
               const PixelConeOptions& options, double white) {
  auto cones = PixelCones::create(options);
  std::vector<glm::vec4> before;
  std::vector<float> depth;
  glm::mat4 clip(1.0f);
  double sum = 0.0, count = 0.0;
  for (int f = 0; f < kFrames; ++f) {
    Camera camera = view.camera;
    camera.toWorld[3] += static_cast<float>(f) * kStepM * glm::normalize(camera.toWorld[0]);
    const test::GBuffer g(view, camera, w, h);
    if (Status ok = cones->update(tracer, g.receivers(), {}); !ok) std::exit(fail(ok.error().message));
    for (std::size_t i = 0; i < g.depth.size() && f > kFrames / 2; ++i) {
      if (g.depth[i] == 0.0f) continue;
      const glm::vec4 c = clip * glm::vec4(g.position[i], 1.0f);
      const float x = (0.5f + 0.5f * c.x / c.w) * static_cast<float>(w),
                  y = (0.5f - 0.5f * c.y / c.w) * static_cast<float>(h);
      if (!(x >= 0.0f && y >= 0.0f && x < static_cast<float>(w) && y < static_cast<float>(h))) continue;
      const std::size_t q = static_cast<std::size_t>(y) * w + static_cast<std::size_t>(x);
      if (std::abs(depth[q] - c.w) > 0.02f * c.w) continue;
      const glm::vec3 d = glm::abs(glm::vec3(cones->light()[i]) - glm::vec3(before[q]));
      sum += static_cast<double>(d.x + d.y + d.z) / white;
      count += 1.0;
    }
    before.assign(cones->light().begin(), cones->light().end());
    depth = g.depth;
    clip = g.clipFromWorld;
  }
  return sum / count;
}

int run(int argc, char** argv) {
  Context context;
  const auto view = test::openView(argv[1], argv[4], argv[2], context);
  if (!view) return fail(view.error().message);
  RenderRequest request;
  request.bake = &view->bake;
  request.camera = view->camera;
  request.lights = test::lightsNamed(*view->scene, argv[3]);
  if (request.lights.empty()) return fail(std::string(argv[1]) + ": no such lights");
  request.live = LiveRequest{};
  const auto w = static_cast<std::uint32_t>(argc > 6 ? std::atoi(argv[5]) : 320),
             h = static_cast<std::uint32_t>(argc > 6 ? std::atoi(argv[6]) : 180);
  const auto relit = relightByRays(view->tracer, request, context);
  if (!relit) return fail(relit.error().message);
  auto voxels = lightByBake(view->tracer, request, *relit->all, context);
  if (!voxels) return fail(voxels.error().message);
  if (Status ok = voxels->mips.update(voxels->volumes.all()); !ok) return fail(ok.error().message);
  const ConeTracer tracer(voxels->volumes.all(), voxels->mips.all(), voxels->sky());
  const test::GBuffer g(*view, view->camera, w, h);

  const Run all = runOnce(tracer, g, {.interleaved = false, .gather = false, .blur = false, .keep = false});
  const double white = whiteOf(all.light);
  std::printf(
      "| picture | SAD over 0.1, %% | mean SAD | cones, ms | edges | gather | blur | keep |\n"
      "|---|---:|---:|---:|---:|---:|---:|---:|\n");
  printDifference("25 cones a pixel", all.light, all, white);
  printDifference("one", all.light, runOnce(tracer, g, {.gather = false, .blur = false, .keep = false}), white);
  printDifference("gathered", all.light, runOnce(tracer, g, {.blur = false, .keep = false}), white);
  printDifference("blurred", all.light, runOnce(tracer, g, {.keep = false}), white);
  printDifference("25, blurred", all.light, runOnce(tracer, g, {.interleaved = false, .gather = false, .keep = false}),
                  white);
  std::printf(
      "flicker, mean SAD from frame to frame: 25 cones %.5f, one gathered and blurred %.5f, kept %.5f\n",
      flicker(*view, tracer, w, h, {.interleaved = false, .gather = false, .blur = false, .keep = false}, white),
      flicker(*view, tracer, w, h, {.keep = false}, white), flicker(*view, tracer, w, h, {}, white));
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 5)
    return std::fprintf(stderr, "usage: bench_cone_pixels LEVEL.glb CAMERA LIGHTS BAKE.relume [WIDTH HEIGHT]\n"), 1;
  return relume::run(argc, argv);
}
