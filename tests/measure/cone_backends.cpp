// SPDX-License-Identifier: MIT
// Cones on the CPU (one thread) and in OpenGL, by turns: the least milliseconds of each pass, and how far the two
// lights are apart. Voxels send out the lights' direct light and emission; and the same by reflective shadow maps, with
// how far what lobes find there is from that. Prints the table of backends of docs/notes/cones.md.
//
//   bench_cone_backends LEVEL.glb CAMERA LIGHTS [CELLS [WIDTH HEIGHT [FRAMES [MAP [MORE [VOLUMES]]]]]]
// (by default 32, 320 180, 4, maps of 512 texels along a side, 0, one volume; several have no maps)
#include "runtime/live_gl/cones_gl.h"
#include "tests/measure/g_buffer.h"
#include "tests/measure/or_exit.h"
#include "tests/measure/traced_light.h"
#include "tools/gl_scene/egl_context.h"
#include "tools/render/live_view.h"
#include "tools/render/rsm_maps.h"

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
    return std::fprintf(
               stderr,
               "bench_cone_backends LEVEL.glb CAMERA LIGHTS [CELLS [WIDTH HEIGHT [FRAMES [MAP [MORE [VOLUMES]]]]]]\n"
               "MORE: frames by OpenGL alone; with 0 FRAMES those are all, and nothing is compared\n"),
           2;
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
  request.live->cascades = static_cast<std::uint32_t>(number(10, 1));
  const bool isOne = request.live->cascades == 1;
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
  orExit(voxels.mips.update(voxels.volumes.all()));
  const ConeTracer tracer(voxels.volumes.all(), voxels.mips.all(), voxels.sky());
  Least onCpu, onGpu;
  take(onCpu, voxels.volume().passTimes());
  std::vector<glm::vec3> glossy(mirrored.size());
  const auto lobes = [&] {
    for (std::size_t i = 0; i < mirrored.size(); ++i) {
      if (mirrored[i].w >= 0.0f)
        glossy[i] = tracer.glossy(g.position[i], g.plane[i], glm::vec3(mirrored[i]), mirrored[i].w);
    }
  };
  const int frames = number(7, 4), more = number(9, 0);
  for (int f = 0; f < frames; ++f) {
    orExit(voxels.mips.update(voxels.volumes.all()));
    take(onCpu, voxels.mips.passTimes());
    orExit(cpu.update(tracer, g.receivers(), {}));
    take(onCpu, cpu.passTimes());
    const auto begin = std::chrono::steady_clock::now();
    lobes();
    take(onCpu,
         {{"lobes", std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count()}});
    orExit(gl.fill(voxels.volumes));
    glFinish();  // or the pixels' upload may count as the levels' time
    orExit(gl.trace(g.receivers(), voxels.sky(), mirrored));
    glFinish();
    take(onGpu, gl.passTimes());
  }
  // As where something moves: all voxels are numbered and listed anew.
  orExit(voxels.volumes.move({}));
  orExit(gl.fill(voxels.volumes));
  const double anew = gl.passTimes()[0].ms;
  if (frames > 0) orExit(cpuAll.update(tracer, g.receivers(), {}));
  take(onCpu, cpuAll.passTimes(), "25 ");
  for (int f = 0; f <= more; ++f) {
    orExit(glAll.fill(voxels.volumes));
    glFinish();
    orExit(glAll.trace(g.receivers(), voxels.sky()));
    glFinish();
    take(onGpu, glAll.passTimes(), "25 ");
  }

  const std::vector<glm::vec4> found = gl.light(), foundAll = glAll.light();
  const std::vector<glm::vec3> foundGlossy = gl.glossy(), direct = glossy;
  for (int f = 0; f < more; ++f) {
    orExit(gl.fill(voxels.volumes));
    glFinish();  // or the pixels' upload may count as the levels' time
    orExit(gl.trace(g.receivers(), voxels.sky(), mirrored));
    glFinish();
    take(onGpu, gl.passTimes());
  }

  // The same voxels lit by reflective shadow maps
  const auto side = static_cast<std::uint32_t>(number(8, kRsmVoxelsSide));
  std::vector<RsmMap> maps;
  for (const SceneLight& l : request.lights)
    if (isOne) maps.push_back(renderRsm(view->tracer, l, side, context));
  std::vector<RsmImage> images;
  for (const RsmMap& map : maps) images.push_back(map.image());
  RsmVoxels byMaps;
  onGpu.erase("inject");  // of frames without maps
  for (int f = 0; f < frames && isOne; ++f) {
    orExit(byMaps.light(voxels.volume(), images, glm::vec3(1.0f)));
    take(onCpu, {byMaps.passTimes()[1]});
    if (f == 0) take(onCpu, {byMaps.passTimes()[0]});
    orExit(gl.fill(voxels.volume(), images, glm::vec3(1.0f)));
    glFinish();
    take(onGpu, {gl.passTimes()[1]});
  }
  for (int f = 0; f < more && isOne; ++f) {
    orExit(gl.fill(voxels.volume(), images, glm::vec3(1.0f)));
    glFinish();
    take(onGpu, {gl.passTimes()[1]});
  }
  const std::vector<glm::vec3> foundSides = gl.sideRadiance();
  std::uint32_t apart = 0;
  for (std::uint32_t s = 0; frames > 0 && isOne && s < voxels.volume().sideCount(); ++s) {
    if (byMaps.targets().perFlux[s] > 0.0f && PackedLight(foundSides[s]).value() != voxels.volume().radianceOf(s))
      ++apart;
  }
  if (frames > 0 && isOne) {
    orExit(voxels.mips.update(voxels.volumes.all()));
    lobes();
  }
  double lightOfMaps = 0.0, lightDirect = 0.0;
  for (std::size_t i = 0; i < glossy.size(); ++i) {
    lightOfMaps += static_cast<double>(glossy[i].x + glossy[i].y + glossy[i].z);
    lightDirect += static_cast<double>(direct[i].x + direct[i].y + direct[i].z);
  }

  std::printf("%s, %u x %u pixels, %u cells, %zu volumes, %u voxels; CPU: one thread; OpenGL: %s\n", argv[1], width,
              height, request.live->cells, voxels.volumes.size(), voxels.volumes.stats().occupied,
              reinterpret_cast<const char*>(glGetString(GL_RENDERER)));
  std::printf("| pass | CPU, ms | OpenGL, ms |\n|---|---:|---:|\n");
  const std::pair<const char*, const char*> passes[] = {{"", "voxels"},           {"direct", "direct light by rays"},
                                                        {"inject", "inject"},     {"voxel sides", "voxel sides"},
                                                        {"mips", "levels"},       {"cones", "cones"},
                                                        {"edges", "edges"},       {"gather", "gather"},
                                                        {"blur", "blur"},         {"keep", "keep"},
                                                        {"25 cones", "25 cones"}, {"lobes", "lobes"}};
  for (const auto& [ofCpu, ofGpu] : passes) std::printf("| %s | %.2f | %.2f |\n", ofGpu, onCpu[ofCpu], onGpu[ofGpu]);
  std::printf("voxels, where something moves: %.1f ms\n", anew);
  if (frames == 0) return 0;
  std::printf("relative RMSE: 25 cones %.2e, one cone, filtered and kept %.2e, lobes of exponent %.0f %.2e\n",
              relativeRmse<glm::vec4>(cpuAll.light(), foundAll), relativeRmse<glm::vec4>(cpu.light(), found),
              static_cast<double>(kExponent), relativeRmse<glm::vec3>(direct, foundGlossy));
  if (isOne)
    std::printf(
        "maps of %u texels along a side, %zu: %.2f %% of their flux in voxels; sides that differ between CPU and "
        "OpenGL: %u; lobes beside those in voxels lit directly: relative RMSE %.3f, energy %.3f\n",
        side, maps.size(), 100.0 * static_cast<double>(byMaps.arrived()), apart,
        relativeRmse<glm::vec3>(direct, glossy), lightOfMaps / lightDirect);
  std::printf("mips on the CPU: %.1f MiB\n", static_cast<double>(voxels.mips.sizeBytes()) / (1 << 20));
  for (const auto& [name, bytes] : gl.bufferSizes())
    std::printf("%s: %.1f MiB\n", name.c_str(), static_cast<double>(bytes) / (1 << 20));
  return 0;
}
