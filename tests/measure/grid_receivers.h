// SPDX-License-Identifier: MIT
// What the parts of bench_grid_error share: a level whose play space has receivers with path-traced light, and how far
// what they read is from it.
#pragma once

#include "bake/base/parallel.h"
#include "bake/rays/ray_tracer.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/bake.h"
#include "tests/measure/traced_light.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace relume::test {

// What is measured: the level, its lights by their names with commas between, `emissive` alone for its emitters.
struct GridRequest {
  std::string path, lights;
  std::size_t receivers = 1000;
  int paths = 1024;  // of each receiver
  std::uint32_t surfels = 65536;
};

// Receivers are points of the play space with random normals.
struct GridLevel {
  std::unique_ptr<Scene> scene;  // the tracer keeps its address
  std::unique_ptr<RayTracer> tracer;
  BakeOptions options;
  PlaySpace playSpace;
  std::unique_ptr<TracedLevel> level;
  std::vector<TracedReceiver> receivers;
};

inline Result<GridLevel> openGridLevel(const GridRequest& request, Context& context) {
  GridLevel opened;
  auto scene = importGltf(request.path, context);
  if (!scene) return scene.error();
  opened.scene = std::make_unique<Scene>(std::move(*scene));
  auto tracer = RayTracer::create(*opened.scene, "avx2", context);
  if (!tracer) return tracer.error();
  opened.tracer = std::make_unique<RayTracer>(std::move(*tracer));
  opened.options.surfels.count = request.surfels;
  auto playSpace = findPlaySpace(*opened.tracer, opened.options.playSpace, opened.options.seed, context);
  if (!playSpace) return playSpace.error();
  opened.playSpace = std::move(*playSpace);
  opened.level = std::make_unique<TracedLevel>(TracedLevel{
      *opened.scene, *opened.tracer, lightsNamed(*opened.scene, request.lights), request.lights == "emissive"});
  opened.receivers.resize(request.receivers);
  parallelChunks(context, "", request.receivers, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      RandomStream random(11, 0x67726964, i);
      TracedReceiver& r = opened.receivers[i];
      r.position = opened.playSpace.receivers[i * opened.playSpace.receivers.size() / request.receivers];
      r.normal = sphereDirection(random.uniform2());
      traceIrradiance(*opened.level, request.paths, random, r);
    }
  });
  return opened;
}

// tooBright: the mean excess over receivers that have less than a tenth of the mean light, over that mean.
struct GridFigures : TracedError {
  double tooBright = 0.0;
};

template <class Read>
GridFigures compareReceivers(const std::vector<TracedReceiver>& receivers, const Read& read) {
  std::vector<glm::vec3> found;
  double mean = 0.0, excess = 0.0, dark = 0.0;
  for (const TracedReceiver& r : receivers)
    mean += static_cast<double>(r.truth().y) / static_cast<double>(receivers.size());
  for (const TracedReceiver& r : receivers) {
    found.push_back(read(r.position, r.normal));
    if (static_cast<double>(r.truth().y) < 0.1 * mean) {
      excess += static_cast<double>(std::max(0.0f, found.back().y - r.truth().y));
      dark += 1.0;
    }
  }
  return {errorOf(receivers, found), dark > 0.0 ? excess / dark / mean : 0.0};
}

// Grids of several kinds and sizes as they are baked; bases of points at equal bytes. Markdown on standard output;
// false: an error was printed.
bool printGridKinds(const GridLevel& opened, const std::string& lights);
bool printEqualBytes(const GridLevel& opened, const std::string& lights);

}  // namespace relume::test
