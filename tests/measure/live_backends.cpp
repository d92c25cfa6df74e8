// SPDX-License-Identifier: MIT
// Light without a bake on the CPU and in OpenGL, by turns: the least milliseconds of each pass, and how far the two
// lights are apart. Nothing is in shadow, so that direct light is the same work on both.
//
//   bench_live_backends LEVEL.glb [CELLS [RAYS [FRAMES]]]      (by default 32, 64, 24; all threads of the machine)
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "runtime/live/live_caches.h"
#include "runtime/live_gl/live_caches_gl.h"
#include "tests/measure/or_exit.h"
#include "tools/base/worker_threads.h"
#include "tools/gl_scene/egl_context.h"
#include "tools/render/live_view.h"
#include "tools/render/render_frame.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <thread>
#include <vector>

namespace {

using namespace relume;

using Least = std::map<std::string, double>;

void take(Least& least, const std::vector<PassTime>& times) {
  for (const PassTime& time : times) {
    if (time.ms <= 0.0) continue;
    const auto [at, isNew] = least.emplace(time.pass, time.ms);
    at->second = std::min(at->second, time.ms);
  }
}

double mebibytes(const std::vector<std::pair<std::string, std::size_t>>& sizes) {
  std::size_t sum = 0;
  for (const auto& [name, bytes] : sizes) sum += bytes;
  return static_cast<double>(sum) / (1 << 20);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "bench_live_backends LEVEL.glb [CELLS [RAYS [FRAMES]]]\n");
    return 2;
  }
  const auto number = [&](int at, int otherwise) { return argc > at ? std::atoi(argv[at]) : otherwise; };
  const auto cells = static_cast<std::uint32_t>(number(2, 32)), rays = static_cast<std::uint32_t>(number(3, 64));
  const int frames = number(4, 24);
  Context context;
  const Scene scene = orExit(importGltf(argv[1], context));
  WorkerThreads pool(std::max(1u, std::thread::hardware_concurrency()));
  VoxelVolume volume = orExit(voxeliseScene(
      scene, cells, [&](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) { pool.run(tasks, body); },
      context));
  const EglContext gl = orExit(EglContext::create({}));
  LiveCaches onCpu = orExit(LiveCaches::create({rays}));
  LiveCachesGl onGl = orExit(LiveCachesGl::create({{rays}, EglContext::getProcAddress, "", {}}));

  std::vector<Light> lights;
  for (const SceneLight& light : scene.lights) lights.push_back(toRuntimeLight(light));
  LightSetup setup;
  setup.lights = lights;
  Least cpu, gpu;
  for (int f = 0; f < frames; ++f) {
    LiveFrame frame;
    frame.raySet = static_cast<std::uint32_t>(f);
    frame.keep = f > 2 ? 0.5f : 0.0f;
    frame.sky.radiance = glm::vec3(0.2f);
    orExit(volume.lightDirectly(setup));
    orExit(onCpu.update(volume, frame));
    take(cpu, {volume.passTimes()[2]});
    take(cpu, onCpu.passTimes());
    orExit(onGl.lightDirectly(volume, setup));
    orExit(onGl.update(volume, frame));
    glFinish();
    take(gpu, onGl.passTimes());
  }
  double square = 0.0, off = 0.0;
  const std::vector<float> found = onGl.coefficients();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double expected = onCpu.coefficients()[i], error = found[i] - expected;
    square += expected * expected;
    off += error * error;
  }
  std::printf("%s: %u voxels, %u caches, %zu lights; %s\n", argv[1], volume.stats().occupied, onCpu.activeCells(),
              lights.size(), reinterpret_cast<const char*>(glGetString(GL_RENDERER)));
  for (const char* pass : {"direct", "bounce", "gather"})
    std::printf("%-7s CPU %8.2f ms, OpenGL %8.2f ms\n", pass, cpu[pass], gpu[pass]);
  std::printf("relative RMSE of coefficients %.2e; OpenGL %.1f MiB\n", std::sqrt(off / std::max(square, 1e-30)),
              mebibytes(onGl.bufferSizes()));
  return 0;
}
