// SPDX-License-Identifier: MIT
// What `relume bake` was asked for, in all of its forms (a bake, a plan, a shard), and what they have in common.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"
#include "tools/base/scene_options.h"
#include "tools/cli/bake_flags.h"
#include "tools/cli/bake_store.h"
#include "tools/cli/terminal.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace relume {

struct BakeArguments {
  std::string scene, output, optionsFile, reportFile, depfile, exportedLevel, plan, shard;
  Preset preset = Preset::high;
  bool presetGiven = false, printOptions = false, force = false, verify = false;
  BakeFlags flags;
  StoreArguments store;
  SceneOptions sceneOptions;
  TerminalOptions terminal;
};

// Preset, options file, then the flags. Where no preset was given, options start from `base`.
Result<BakeOptions> chooseOptions(const BakeArguments& arguments, const BakeOptions& base);

// Sizes of what was made or is there, for the report and the line at the end.
struct MadeCounts {
  std::uint32_t surfels = 0, nodes = 0, caches = 0, links = 0;
};
MadeCounts countsOf(const Bake& bake);

double secondsSince(std::chrono::steady_clock::time_point begin);
// Of the process, since Linux was told to count anew (/proc/self/clear_refs), elsewhere since it began.
double peakMemoryMiB();

// Stages with seconds and figures, options, sizes. Unlike the bake itself it may say when and how long.
std::string describeRun(const Context& context, const BakeOptions& options, const std::string& rayTracer,
                        const MadeCounts& made, double seconds, bool upToDate);

// The report, where one was asked for.
Status writeReport(const std::string& path, const std::string& report);
// Report and depfile of `output`, which are written whether or not there was something to bake.
Status writeSideFiles(const BakeArguments& arguments, const std::string& output, const Scene& scene,
                      const std::string& report);
// Whether the depfile of `output` can be written, where one is asked for; a warning for what not everybody can read.
Status checkDepfile(const BakeArguments& arguments, const std::string& output, const Scene& scene, Context& context);

// Whether there is a file at the output that may be what would be made: one with a byte in it.
bool mayBeMade(const std::string& output, bool force);

// What stands at the output, where `read` takes it for what would be made; else nothing, and a message says why it is
// made again, behind `doing`. Nothing and no message where there is no file, or one without a byte.
template <class Read>
auto takeExisting(const std::string& output, bool force, const std::string& doing, Context& context, const Read& read)
    -> std::optional<std::remove_cvref_t<decltype(*read())>> {
  if (!mayBeMade(output, force)) return std::nullopt;
  auto existing = read();
  if (existing) return std::move(*existing);
  context.message(Severity::info, doing + ": " + existing.error().message);
  return std::nullopt;
}

// Ends a run that found such an output: gives it a time after that of its inputs, so that a build system that goes by
// time does not ask again; writes report and depfile; prints what is there. Returns the exit status.
int endUpToDate(const BakeArguments& arguments, const std::string& output, const Scene& scene,
                const std::string& report, const std::string& what);

// The first of them, each in a line of its own, and how many more there are.
std::string listChanges(const std::vector<std::string>& changes, std::size_t max);

// relume bake --plan FILE, and with --shard I/N.
int runPlan(const BakeArguments& arguments);
int runShard(const BakeArguments& arguments);

}  // namespace relume
