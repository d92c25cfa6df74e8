// SPDX-License-Identifier: MIT
// Voxels of a level found on the CPU and in OpenGL, by turns: the least milliseconds of the bits of all that stands,
// and of a ball that moves. Both begin with vertices and transforms.
//
//   bench_voxel_backends LEVEL.glb [CELLS [FRAMES]]      (by default 32, 24; all threads of the machine)
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "runtime/live_gl/voxels_gl.h"
#include "runtime/shared/stopwatch.h"
#include "runtime/voxels/packed_mesh.h"
#include "runtime/voxels/voxel_volume.h"
#include "tests/measure/or_exit.h"
#include "tests/runtime/ball.h"
#include "tools/base/worker_threads.h"
#include "tools/gl_scene/egl_context.h"
#include "tools/render/voxel_scene.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

using namespace relume;

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "bench_voxel_backends LEVEL.glb [CELLS [FRAMES]]\n");
    return 2;
  }
  const auto cells = static_cast<std::uint32_t>(argc > 2 ? std::atoi(argv[2]) : 32);
  const int frames = argc > 3 ? std::atoi(argv[3]) : 24;
  Context context;
  const Scene scene = orExit(importGltf(argv[1], context));
  WorkerThreads pool(std::max(1u, std::thread::hardware_concurrency()));
  const ParallelFor parallelFor = pool.parallelFor();
  // Uncut, as an engine has its meshes: pieces of any size.
  const VoxelScene level = orExit(VoxelScene::create(scene, 1e6f, context));
  const VoxelGeometry found = level.geometry();
  std::vector<VoxelMesh> meshes(found.meshes.begin(), found.meshes.end());
  std::vector<VoxelPart> parts(found.parts.begin(), found.parts.end());
  VoxelOptions options;
  options.cells = cells;
  options.parallelFor = parallelFor;
  const VolumeGrid whole = orExit(VoxelVolume::create(found, options)).grid();
  const test::Ball ball(2.5f * whole.cell(), 70);
  const std::vector<std::uint32_t> ballSurface(ball.triangle.size(), 0);
  meshes.push_back({ball.position, ball.triangle, ballSurface});
  for (VoxelPart& part : parts) part.moves = false;
  parts.push_back({static_cast<std::uint32_t>(meshes.size() - 1), glm::mat4x3(1.0f), true});
  const VoxelGeometry geometry{found.surfaces, meshes, parts};
  options.boxMin = whole.originWorld + 0.5f * whole.voxel;
  options.boxMax = options.boxMin + whole.voxel * (glm::vec3(whole.voxels()) - 1.0f);

  VoxelVolume volume = orExit(VoxelVolume::create(geometry, options));
  const EglContext context2 = orExit(EglContext::create({}));
  VoxelsGl gl = orExit(VoxelsGl::create(geometry, volume.grid(), {EglContext::getProcAddress}));
  std::size_t triangles = 0;
  for (std::size_t p = 0; p + 1 < parts.size(); ++p) triangles += meshes[parts[p].mesh].triangle.size();
  double all = 1e9, allGl = 1e9, ballAll = 1e9, ballBits = 1e9, ballGl = 1e9;
  const PackedGeometry packed = packGeometry(geometry, parallelFor);
  const auto bitsOf = [&](bool moves, std::vector<std::uint64_t>& bits) {
    std::vector<std::vector<SnappedTriangle>> snapped(parts.size());
    parallelFor(static_cast<std::uint32_t>(parts.size()), [&](std::uint32_t p) {
      SnapCounts counts;
      const PackedMesh& mesh = packed.mesh[parts[p].mesh];
      if (parts[p].moves == moves)
        snapRuns(volume.grid(), SnapBox::of(volume.grid()), mesh, parts[p].toWorld, 0,
                 static_cast<std::uint32_t>(mesh.run.size()), snapped[p], counts);
    });
    bits.assign(volume.grid().cellCount(), 0);
    for (const auto& each : snapped) addBits(volume.grid(), each, parallelFor, bits);
  };
  bool same = true;
  for (int f = 0; f < frames; ++f) {
    const float turn = 0.1f * static_cast<float>(f);
    glm::mat4x3 to{{std::cos(turn), 0, std::sin(turn)}, {0, 1, 0}, {-std::sin(turn), 0, std::cos(turn)}, {}};
    to[3] = 0.5f * (options.boxMin + options.boxMax) + 0.03f * turn;
    parts.back().toWorld = to;
    std::vector<std::uint64_t> bits;
    Stopwatch watch;
    bitsOf(false, bits);
    all = std::min(all, watch.lap());
    orExit(gl.edit({}));
    glFinish();
    allGl = std::min(allGl, watch.lap());
    same = same && gl.standingBits() == bits;
    watch.lap();
    bitsOf(true, bits);
    ballBits = std::min(ballBits, watch.lap());
    orExit(volume.move({&to, 1}));
    ballAll = std::min(ballAll, watch.lap());
    orExit(gl.move({&to, 1}));
    glFinish();
    ballGl = std::min(ballGl, watch.lap());
    same = same && gl.movingBits() == bits;
  }
  std::printf("%s: %zu triangles, %u voxels; %s\n", argv[1], triangles, volume.stats().occupied,
              reinterpret_cast<const char*>(glGetString(GL_RENDERER)));
  std::printf("what stands: bits, CPU %8.2f ms, OpenGL %8.2f ms\n", all, allGl);
  std::printf("a ball of %zu triangles: bits, CPU %8.2f ms, OpenGL %8.2f ms; with sides, CPU %8.2f ms\n",
              ball.triangle.size(), ballBits, ballGl, ballAll);
  std::printf("%s\n", same ? "the same bits" : "OTHER BITS");
  return same ? 0 : 1;
}
