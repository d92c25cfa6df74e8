// SPDX-License-Identifier: MIT
// Cones on the CPU (one thread) and in OpenGL, by turns: the least milliseconds of each pass, and how far the two
// lights are apart. Voxels send out the lights' direct light and emission. Prints the table of backends of
// docs/notes/cones.md.
//
//   bench_cone_backends LEVEL.glb CAMERA LIGHTS [CELLS [WIDTH HEIGHT [FRAMES]]]      (by default 32, 320 180, 4)
#include "runtime/live_gl/cones_gl.h"
#include "tests/measure/g_buffer.h"
#include "tests/measure/or_exit.h"
#include "tests/measure/traced_light.h"
#include "tools/gl_scene/egl_context.h"
#include "tools/render/live_view.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace {

using namespace relume;

using Least = std::map<std::string, double>;

void take(Least& least, const std::vector<PassTime>& times, const std::string& prefix = {}) {
  for (const PassTime& time : times) {
    if (time.ms <= 0.0) continue;
    const auto [at, isNew] = least.emplace(prefix + time.pass, time.ms);
    at->second = std::min(at->second, time.ms);
  }
}

template <class Vector>
double relativeRmse(std::span<const Vector> expected, std::span<const Vector> found) {
  double square = 0.0, off = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Vector d = expected[i] - found[i];
    square += static_cast<double>(glm::dot(expected[i], expected[i]));
    off += static_cast<double>(glm::dot(d, d));
  }
  return std::sqrt(off / std::max(square, 1e-30));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4)
    return std::fprintf(stderr, "bench_cone_backends LEVEL.glb CAMERA LIGHTS [CELLS [WIDTH HEIGHT [FRAMES]]]\n"), 2;
  const auto number = [&](int at, int otherwise) { return argc > at ? std::atoi(argv[at]) : otherwise; };
  Context context;
  const auto view = test::openView(argv[1], "", argv[2], context);
  if (!view) return std::fprintf(stderr, "%s\n", view.error().message.c_str()), 1;
  RenderRequest request;
  request.camera = view->camera;
  request.lights = test::lightsNamed(*view->scene, argv[3]);
  request.emissive = true;
  request.bounces = 1;
  request.live = LiveRequest{};
  request.live->cells = static_cast<std::uint32_t>(number(4, 32));
  auto light = orExit(lightLive(view->tracer, request, context));
  VoxelView& voxels = light.voxels;
  const auto width = static_cast<std::uint32_t>(number(5, 320)), height = static_cast<std::uint32_t>(number(6, 180));
  const test::GBuffer g(*view, view->camera, width, height);
  std::vector<glm::vec4> mirrored(g.depth.size(), glm::vec4(0.0f, 0.0f, 0.0f, -1.0f));
  constexpr float kExponent = 64.0f;
  const glm::vec3 eye(view->camera.toWorld[3]);
  for (std::size_t i = 0; i < mirrored.size(); ++i) {
    if (g.depth[i] > 0.0f)
      mirrored[i] = glm::vec4(glm::reflect(glm::normalize(g.position[i] - eye), g.normal[i]), kExponent);
  }

  const EglContext egl = orExit(EglContext::create({}));
  const PixelConeOptions all{.interleaved = false, .gather = false, .blur = false, .keep = false};
  PixelCones cpu = orExit(PixelCones::create({})), cpuAll = orExit(PixelCones::create(all));
  ConesGl gl = orExit(ConesGl::create({{}, RadianceMips::Directions::six, true, EglContext::getProcAddress}));
  ConesGl glAll = orExit(ConesGl::create({all, RadianceMips::Directions::six, true, EglContext::getProcAddress}));
  const ConeTracer tracer(voxels.volume, voxels.mips, voxels.sky());
  Least onCpu, onGpu;
  std::vector<glm::vec3> glossy(mirrored.size());
  for (int f = 0; f < number(7, 4); ++f) {
    orExit(voxels.mips.update(voxels.volume));
    take(onCpu, voxels.mips.passTimes());
    orExit(cpu.update(tracer, g.receivers(), {}));
    take(onCpu, cpu.passTimes());
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < mirrored.size(); ++i) {
      if (mirrored[i].w >= 0.0f)
        glossy[i] = tracer.glossy(g.position[i], g.plane[i], glm::vec3(mirrored[i]), mirrored[i].w);
    }
    take(onCpu,
         {{"lobes", std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count()}});
    orExit(gl.fill(voxels.volume));
    orExit(gl.trace(g.receivers(), voxels.sky(), mirrored));
    glFinish();
    take(onGpu, gl.passTimes());
  }
  // As where something moves: all voxels are numbered and listed anew.
  orExit(voxels.volume.move({}));
  orExit(gl.fill(voxels.volume));
  const double anew = gl.passTimes()[0].ms;
  orExit(cpuAll.update(tracer, g.receivers(), {}));
  take(onCpu, cpuAll.passTimes(), "25 ");
  orExit(glAll.fill(voxels.volume));
  orExit(glAll.trace(g.receivers(), voxels.sky()));
  glFinish();
  take(onGpu, glAll.passTimes(), "25 ");

  std::printf("%s, %u x %u pixels, %u cells, %u voxels; CPU: one thread; OpenGL: %s\n", argv[1], width, height,
              request.live->cells, voxels.volume.stats().occupied,
              reinterpret_cast<const char*>(glGetString(GL_RENDERER)));
  std::printf("| pass | CPU, ms | OpenGL, ms |\n|---|---:|---:|\n");
  const std::pair<const char*, const char*> passes[] = {
      {"", "voxels"},   {"mips", "levels"}, {"cones", "cones"},       {"edges", "edges"}, {"gather", "gather"},
      {"blur", "blur"}, {"keep", "keep"},   {"25 cones", "25 cones"}, {"lobes", "lobes"}};
  for (const auto& [ofCpu, ofGpu] : passes) std::printf("| %s | %.2f | %.2f |\n", ofGpu, onCpu[ofCpu], onGpu[ofGpu]);
  std::printf("voxels, where something moves: %.1f ms\n", anew);
  const std::vector<glm::vec4> found = gl.light(), foundAll = glAll.light();
  const std::vector<glm::vec3> foundGlossy = gl.glossy();
  std::printf("relative RMSE: 25 cones %.2e, one cone, filtered and kept %.2e, lobes of exponent %.0f %.2e\n",
              relativeRmse<glm::vec4>(cpuAll.light(), foundAll), relativeRmse<glm::vec4>(cpu.light(), found),
              static_cast<double>(kExponent), relativeRmse<glm::vec3>(glossy, foundGlossy));
  for (const auto& [name, bytes] : gl.bufferSizes())
    std::printf("%s: %.1f MiB\n", name.c_str(), static_cast<double>(bytes) / (1 << 20));
  return 0;
}
