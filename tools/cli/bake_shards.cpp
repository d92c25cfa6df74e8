// SPDX-License-Identifier: MIT
// relume bake LEVEL --plan FILE writes a plan; with --shard I/N -o SHARD it reads one and traces a shard of it. Both do
// nothing where what they would write is there already: a job that is run again costs nothing.
#include "bake/shards/shard.h"
#include "relume/bake/load_scene.h"
#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/cli/bake_arguments.h"
#include "tools/cli/commands.h"
#include "tools/cli/reserve_bake.h"
#include "tools/compare/staleness.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace relume {
namespace {

// Those stages of a bake that are run here; links count for the share of them that is traced.
ProgressPlan stagesOf(const BakeOptions& options, std::initializer_list<std::string_view> stages, double share) {
  ProgressPlan plan;
  for (ProgressPlan::Part part : planBake(options, false).parts) {
    if (std::find(stages.begin(), stages.end(), part.stage) == stages.end()) continue;
    if (part.stage == "links") part.weight *= share;
    plan.parts.push_back(std::move(part));
  }
  return plan;
}

bool isThere(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored) && std::filesystem::file_size(path, ignored) > 0;
}

CommandFiles filesOf(const BakeArguments& arguments) {
  CommandFiles files;
  files.read("the scene", arguments.scene);
  files.read("the file of --options", arguments.optionsFile);
  files.write("--report", arguments.reportFile, FileKind::bakeReport);
  files.write("--depfile", arguments.depfile, FileKind::depfile);
  files.force = arguments.force;
  return files;
}

Result<Scene> loadLevel(const BakeArguments& arguments, CommandFiles& files, MeshReport report, Context& context) {
  Result<Scene> scene = loadScene(arguments.scene, context, toImportOptions(arguments.sceneOptions), report);
  if (!scene) return scene;
  files.read("a file of the scene", scene->files);
  if (const Status status = checkApart(files); !status) return status.error();
  return scene;
}

// Whether the plan that stands there is the one that would be made. Whatever is wrong with it: no.
Status checkExistingPlan(const std::string& path, const Scene& scene, const BakeOptions& options) {
  const Result<BakePlan> plan = readPlan(path);
  if (!plan) return plan.error();
  if (const Status status = checkPlanVersion(*plan); !status) return status;
  if (const Status status = checkPlanTracer(*plan); !status) return status;
  if (const Status status = checkPlanLevel(*plan, scene); !status) return status;
  if (plan->bake.provenance.optionsJson == optionsToJson(options)) return done();
  return Error{ErrorCode::usage, "the plan there has other options"};
}

MadeCounts countsOf(const Bake& bake) {
  return {bake.surfels.count(), bake.hierarchy.nodeCount(), bake.caches.count(), bake.links.count()};
}

// Options of the command line, if there are any, are the plan's.
Status checkSameOptions(const BakeArguments& arguments, const BakePlan& plan) {
  const Result<BakeOptions> options = chooseOptions(arguments, plan.options);
  if (!options) return options.error();
  const std::vector<OptionInfo> mine = listOptions(*options), planned = listOptions(plan.options);
  for (std::size_t i = 0; i < mine.size(); ++i) {
    if (mine[i].value != planned[i].value)
      return Error{ErrorCode::usage, mine[i].name + ": a shard has the options of its plan, which has " +
                                         planned[i].value + ", found " + mine[i].value +
                                         "; leave it out, or make the plan with it"};
  }
  return done();
}

// Whether the shard that stands there is complete and the one that would be made.
Status checkExistingShard(const std::string& path, const BakePlan& plan, const ShardNumber& number) {
  const Result<Shard> shard = readShard(path);
  if (!shard) return shard.error();
  if (const Status status = checkShard(*shard, plan); !status) return status;
  if (shard->number == number) return done();
  return Error{ErrorCode::usage, "shard " + toString(shard->number) + " of this plan is there"};
}

// The level of the plan, or what changed in it.
Status explainLevel(const Scene& scene, const BakePlan& plan) {
  const Status status = checkPlanLevel(plan, scene);
  if (status) return status;
  constexpr std::size_t kMaxNamed = 4;
  std::string message = status.error().message;
  const std::vector<std::string> changes = findStaleness(scene, nullptr, plan.bake).sentences();
  for (std::size_t i = 0; i < std::min(kMaxNamed, changes.size()); ++i) message += "\n  " + changes[i];
  if (changes.size() > kMaxNamed) message += "\n  and " + std::to_string(changes.size() - kMaxNamed) + " changes more";
  return Error{status.error().code, message};
}

}  // namespace

int runPlan(const BakeArguments& arguments) {
  const auto begin = std::chrono::steady_clock::now();
  const Result<BakeOptions> options = chooseOptions(arguments, presetOptions(arguments.preset));
  if (!options) return fail(options.error());
  Terminal terminal(
      arguments.terminal,
      stagesOf(*options, {"import", "rays", "play space", "surfels", "hierarchy", "caches", "receivers", "provenance"},
               0.0));
  Context& context = terminal.context();
  CommandFiles files = filesOf(arguments);
  files.write("--plan", arguments.plan, FileKind::plan);
  if (const Status status = checkOutputs(files, context); !status) return fail(status.error());
  const Result<Scene> scene = loadLevel(arguments, files, MeshReport::log, context);
  if (!scene) return terminal.finish(), fail(scene.error());

  if (!arguments.force && isThere(arguments.plan)) {
    const Status same = checkExistingPlan(arguments.plan, *scene, *options);
    if (same) {
      terminal.finish();
      touch(arguments.plan);
      const std::string report = describeRun(context, *options, "", {}, secondsSince(begin), true);
      if (const Status status = writeSideFiles(arguments, arguments.plan, *scene, report); !status)
        return fail(status.error());
      std::printf("%s: up to date (--force makes it again)\n", printable(arguments.plan).c_str());
      return 0;
    }
    context.message(Severity::info, "planning: " + same.error().message);
  }
  const Result<BakePlan> plan = makePlan(*scene, *options, context);
  if (!plan) return terminal.finish(), fail(plan.error());
  {
    const Context::Stage stage(context, "write");
    if (const Status status = writePlan(*plan, arguments.plan); !status) return terminal.finish(), fail(status.error());
  }
  terminal.finish();
  const MadeCounts made = countsOf(plan->bake);
  const std::string report =
      describeRun(context, *options, plan->bake.provenance.rayTracer, made, secondsSince(begin), false);
  if (const Status status = writeSideFiles(arguments, arguments.plan, *scene, report); !status)
    return fail(status.error());
  std::printf("%s: a plan of %u surfels, %u caches in %.2f s, peak memory %.0f MiB\n",
              printable(arguments.plan).c_str(), made.surfels, made.caches, secondsSince(begin), peakMemoryMiB());
  return 0;
}

int runShard(const BakeArguments& arguments) {
  const auto begin = std::chrono::steady_clock::now();
  const Result<ShardNumber> number = parseShardNumber(arguments.shard);
  if (!number) return fail({number.error().code, "--shard: " + number.error().message});
  if (arguments.output.empty()) return fail({ErrorCode::usage, "-o: the name of the shard to write expected"});
  Context quiet;
  quiet.maxMemory = arguments.terminal.maxMemory;
  if (const Status status = reserveBake(quiet, "plan", arguments.plan); !status) return fail(status.error());
  const Result<BakePlan> plan = readPlan(arguments.plan);
  if (!plan) return fail(plan.error());
  if (const Status status = checkSameOptions(arguments, *plan); !status) return fail(status.error());

  Terminal terminal(arguments.terminal, stagesOf(plan->options, {"import", "rays", "links"}, 1.0 / number->count));
  Context& context = terminal.context();
  CommandFiles files = filesOf(arguments);
  files.read("the plan", arguments.plan);
  files.write("-o", arguments.output, FileKind::shard);
  if (const Status status = checkOutputs(files, context); !status) return fail(status.error());
  const std::string& rayTracer = plan->bake.provenance.rayTracer;
  if (!arguments.force && isThere(arguments.output)) {
    const Status same = checkExistingShard(arguments.output, *plan, *number);
    if (same) {
      terminal.finish();
      touch(arguments.output);
      const std::string report = describeRun(context, plan->options, rayTracer, {}, secondsSince(begin), true);
      if (const Status status = writeReport(arguments.reportFile, report); !status) return fail(status.error());
      std::printf("%s: up to date, shard %s of this plan (--force makes it again)\n",
                  printable(arguments.output).c_str(), toString(*number).c_str());
      return 0;
    }
    context.message(Severity::info, "shard " + toString(*number) + " again: " + same.error().message);
  }
  const Result<Scene> scene = loadLevel(arguments, files, MeshReport::none, context);
  if (!scene) return terminal.finish(), fail(scene.error());
  if (const Status status = explainLevel(*scene, *plan); !status) return terminal.finish(), fail(status.error());

  const Result<Shard> shard = traceShard(*scene, *plan, *number, context);
  if (!shard) return terminal.finish(), fail(shard.error());
  {
    const Context::Stage stage(context, "write");
    if (const Status status = writeShard(*shard, arguments.output); !status)
      return terminal.finish(), fail(status.error());
  }
  terminal.finish();
  MadeCounts made = countsOf(plan->bake);
  made.caches = shard->range.count();
  made.links = shard->links.count();
  const std::string report = describeRun(context, plan->options, rayTracer, made, secondsSince(begin), false);
  if (const Status status = writeSideFiles(arguments, arguments.output, *scene, report); !status)
    return fail(status.error());
  std::printf("%s: shard %s, %u of %u caches, %u links in %.2f s, peak memory %.0f MiB\n",
              printable(arguments.output).c_str(), toString(*number).c_str(), made.caches, plan->bake.caches.count(),
              made.links, secondsSince(begin), peakMemoryMiB());
  return 0;
}

}  // namespace relume
