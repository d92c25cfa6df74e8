// SPDX-License-Identifier: MIT
// Light without a bake on the CPU and in OpenGL, by turns: the least milliseconds of each pass, and how far the two
// lights are apart. Nothing is in shadow, so that direct light is the same work on both. Of several volumes in one
// another, about the level's first camera, also the frame after the eye has gone a cell of the innermost on. With a
// bake of the level also the voxels lit by it, which cones read.
//
//   bench_live_backends LEVEL.glb [CELLS [RAYS [FRAMES [VOLUMES [BAKE]]]]]
//   (by default 32, 64, 24, 1; all threads of the machine)
#include "bake/scene/camera_rays.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/bake_file.h"
#include "runtime/live/nested_caches.h"
#include "runtime/live_gl/bake_voxels_gl.h"
#include "runtime/live_gl/live_caches_gl.h"
#include "runtime/shared/stopwatch.h"
#include "tests/measure/or_exit.h"
#include "tools/base/worker_threads.h"
#include "tools/gl_scene/egl_context.h"
#include "tools/render/live_view.h"
#include "tools/render/render_frame.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>
#include <optional>
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

// The voxels lit by a bake: times, how far both lights are apart, and on how many of the voxels' sides it has surfels.
void lightByBake(const Bake& bake, VoxelVolume& volume, const LightSetup& setup, int frames) {
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  Relighter relighter = orExit(Relighter::create(bake, options));
  BakeVoxelsGl onGl =
      orExit(BakeVoxelsGl::create({relighter.lumaBands(), relighter.chromaBands(), EglContext::getProcAddress, ""}));
  SurfelVoxels surfels = orExit(SurfelVoxels::create(volume, bake));
  orExit(volume.lightDirectly(setup));
  double cpu = std::numeric_limits<double>::infinity();
  Least gpu;
  for (int f = 0; f < frames; ++f) {
    orExit(relighter.relight(setup));
    Stopwatch watch;
    orExit(surfels.light(volume, relighter, glm::vec3(1.0f)));
    cpu = std::min(cpu, watch.lap());
    orExit(onGl.light(volume, surfels, relighter.gl()->inputs(), setup.lights, glm::vec3(1.0f)));
    glFinish();
    take(gpu, onGl.passTimes());
  }
  double square = 0.0, off = 0.0;
  const std::vector<glm::vec3> found = onGl.radiance();
  for (std::uint32_t s = 0; s < volume.sideCount(); ++s) {
    const glm::vec3 expected = volume.radianceOf(s), error = found[s] - expected;
    square += static_cast<double>(glm::dot(expected, expected));
    off += static_cast<double>(glm::dot(error, error));
  }
  std::printf(
      "by the bake: CPU %.2f ms, OpenGL %.2f ms; relative RMSE of radiance %.2e; OpenGL %.1f MiB; surfels on %.0f %%\n",
      cpu, gpu["voxels by the bake"], std::sqrt(off / std::max(square, 1e-30)), mebibytes(onGl.bufferSizes()),
      100.0 * static_cast<double>(surfels.covered()));
}

// The eye goes a cell of the innermost volume on, and back: what the frame after it takes, but for voxelising, which is
// the same for both.
void walk(NestedVolumes& volumes, NestedCaches& onCpu, LiveCachesGl& onGl, const LightSetup& setup,
          const LiveFrame& frame) {
  const VolumeGrid inner = volumes[volumes.size() - 1].grid();
  const glm::vec3 middle = inner.toWorld(0.5f * glm::vec3(inner.voxels()));
  double cpu = std::numeric_limits<double>::infinity(), gpu = cpu;
  Least onCpuLeast, onGlLeast;
  for (int i = 0; i < 8; ++i) {
    if (!orExit(volumes.centre(middle + glm::vec3(i % 2 == 0 ? inner.cell() : 0.0f, 0.0f, 0.0f)))) continue;
    Stopwatch watch;
    orExit(onGl.lightDirectly(volumes, setup));
    orExit(onGl.update(volumes, frame));
    glFinish();
    gpu = std::min(gpu, watch.lap());
    take(onGlLeast, onGl.passTimes());
    watch.lap();
    orExit(volumes.lightChanged(setup));
    orExit(onCpu.update(volumes, frame));
    cpu = std::min(cpu, watch.lap());
    take(onCpuLeast, onCpu.passTimes());
  }
  std::printf("the eye a cell on: cells CPU %.2f ms, OpenGL %.2f ms; the frame %.2f, %.2f\n", onCpuLeast["cells"],
              onGlLeast["cells"], cpu, gpu);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "bench_live_backends LEVEL.glb [CELLS [RAYS [FRAMES [VOLUMES [BAKE]]]]]\n");
    return 2;
  }
  const auto number = [&](int at, int otherwise) { return argc > at ? std::atoi(argv[at]) : otherwise; };
  const auto cells = static_cast<std::uint32_t>(number(2, 32)), rays = static_cast<std::uint32_t>(number(3, 64));
  const int frames = number(4, 24);
  Context context;
  const Scene scene = orExit(importGltf(argv[1], context));
  WorkerThreads pool(std::max(1u, std::thread::hardware_concurrency()));
  const auto count = static_cast<std::uint32_t>(number(5, 1));
  std::optional<glm::vec3> eye;
  if (!scene.cameras.empty()) eye = CameraRays(scene.cameras.front(), 1, 1).origin;
  NestedVolumes volumes = orExit(voxeliseScene(scene, {cells, count, eye}, pool.parallelFor(), context));
  const EglContext gl = orExit(EglContext::create({}));
  NestedCaches onCpu = orExit(NestedCaches::create({rays}));
  LiveCachesGl onGl = orExit(LiveCachesGl::create({{rays}, EglContext::getProcAddress, "", {}}));

  std::vector<Light> lights;
  for (const SceneLight& light : scene.lights) lights.push_back(toRuntimeLight(light));
  LightSetup setup;
  setup.lights = lights;
  Least cpu, gpu;
  LiveFrame frame;
  frame.sky.radiance = glm::vec3(0.2f);
  for (int f = 0; f < frames; ++f) {
    frame.raySet = static_cast<std::uint32_t>(f);
    frame.keep = f > 2 ? 0.5f : 0.0f;
    orExit(volumes.lightDirectly(setup));
    orExit(onCpu.update(volumes, frame));
    take(cpu, {volumes.passTimes()[2]});
    take(cpu, onCpu.passTimes());
    orExit(onGl.lightDirectly(volumes, setup));
    orExit(onGl.update(volumes, frame));
    glFinish();
    take(gpu, onGl.passTimes());
  }
  double square = 0.0, off = 0.0;
  for (std::size_t level = 0; level < onCpu.size(); ++level) {
    const std::vector<float> found = onGl.coefficients(level);
    for (std::size_t i = 0; i < found.size(); ++i) {
      const double expected = onCpu[level].coefficients()[i], error = found[i] - expected;
      square += expected * expected;
      off += error * error;
    }
  }
  std::printf("%s: %zu volumes, %u voxels, %u caches, %zu lights; %s\n", argv[1], volumes.size(),
              volumes.stats().occupied, onCpu.activeCells(), lights.size(),
              reinterpret_cast<const char*>(glGetString(GL_RENDERER)));
  for (const char* pass : {"direct", "bounce", "gather"})
    std::printf("%-7s CPU %8.2f ms, OpenGL %8.2f ms\n", pass, cpu[pass], gpu[pass]);
  std::printf("relative RMSE of coefficients %.2e; OpenGL %.1f MiB\n", std::sqrt(off / std::max(square, 1e-30)),
              mebibytes(onGl.bufferSizes()));
  if (volumes.size() > 1) walk(volumes, onCpu, onGl, setup, frame);
  if (argc > 6) lightByBake(orExit(readBake(argv[6])), volumes.outermost(), setup, frames);
  return 0;
}
