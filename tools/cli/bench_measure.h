// SPDX-License-Identifier: MIT
// What `relume bench` measures: the stages of a bake, the passes of a frame, memory.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/shared/bands.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// A bake's stages, each with the least of its seconds over several bakes.
struct BakeTimes {
  std::vector<StageReport> stages;
  double seconds = 0.0;  // of the fastest whole bake, import excluded
  double peakMiB = 0.0;  // most memory the process had during the bakes; 0 where the system does not tell
};
struct MeasuredBake {
  Bake bake;
  BakeTimes times;
};

// Bakes `repeat` times. Errors of bake().
Result<MeasuredBake> measureBake(const Scene& scene, const BakeOptions& options, int repeat, Context& context);

struct PassFigures {
  std::string pass;  // "surfels", "pull", "caches", "frame" (all of them)
  double medianMs = 0.0, minMs = 0.0;
};
PassFigures figuresOf(const std::string& pass, std::vector<double> ms);  // [Size ms >= 1]

struct RelightTimes {
  std::string how;      // "CPU, 2 threads", "OpenGL"
  std::string backend;  // "cpu", "gl"
  int threads = 0;      // cpu only
  std::string bands;    // that were lit: "Y4Co4Cg4"
  std::vector<PassFigures> passes;
  std::vector<std::pair<std::string, std::size_t>> buffers;  // name, bytes
};

// Relights under one directional and one spot light without shadows, with emission and bounces, `frames` times after a
// few frames to warm up. With OpenGL the context of getProcAddress must be current. Errors of Relighter::create();
// failed: cancelled.
Result<RelightTimes> measureCpu(const Bake& bake, const Bands& bands, int threads, int frames, Context& context);
Result<RelightTimes> measureGl(const Bake& bake, const Bands& bands, const GetProcAddress& getProcAddress, int frames,
                               Context& context);

// Model and cores of the processor; never a host's name.
struct Machine {
  std::string processor;
  unsigned cores = 0;
};
Machine describeMachine();

}  // namespace relume
