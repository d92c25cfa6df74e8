// SPDX-License-Identifier: MIT
// What `relume bake` was asked for, in all of its forms (a bake, a plan, a shard), and what they have in common.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "tools/base/scene_options.h"
#include "tools/cli/bake_flags.h"
#include "tools/cli/terminal.h"

#include <chrono>
#include <string>

namespace relume {

struct BakeArguments {
  std::string scene, output, optionsFile, reportFile, depfile, exportedLevel, plan, shard;
  Preset preset = Preset::high;
  bool presetGiven = false, printOptions = false, force = false, verify = false;
  BakeFlags flags;
  SceneOptions sceneOptions;
  TerminalOptions terminal;
};

// Preset, options file, then the flags. Where no preset was given, options start from `base`.
Result<BakeOptions> chooseOptions(const BakeArguments& arguments, const BakeOptions& base);

// Sizes of what was made, for the report and the line at the end.
struct MadeCounts {
  std::uint32_t surfels = 0, nodes = 0, caches = 0, links = 0;
};

double secondsSince(std::chrono::steady_clock::time_point begin);
double peakMemoryMiB();

// Stages with seconds and figures, options, sizes. Unlike the bake itself it may say when and how long.
std::string describeRun(const Context& context, const BakeOptions& options, const std::string& rayTracer,
                        const MadeCounts& made, double seconds, bool upToDate);

// The report, where one was asked for.
Status writeReport(const std::string& path, const std::string& report);
// Report and depfile of `output`, which are written whether or not there was something to bake.
Status writeSideFiles(const BakeArguments& arguments, const std::string& output, const Scene& scene,
                      const std::string& report);

// A file of this age is younger than its inputs, so that a build system that goes by time does not ask again.
void touch(const std::string& path);

// relume bake --plan FILE, and with --shard I/N.
int runPlan(const BakeArguments& arguments);
int runShard(const BakeArguments& arguments);

}  // namespace relume
