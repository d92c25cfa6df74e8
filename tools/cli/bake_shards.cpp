// SPDX-License-Identifier: MIT
// relume bake LEVEL --plan FILE writes a plan; with --shard I/N -o SHARD it reads one and traces a shard of it. Both do
// nothing where what they would write is there already: a job that is run again costs no more than reading the level.
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

CommandFiles filesOf(const BakeArguments& arguments) {
  CommandFiles files;
  files.read("the scene", arguments.scene);
  files.read("the file of --options", arguments.optionsFile);
  files.write("--report", arguments.reportFile, FileKind::bakeReport);
  files.write("--depfile", arguments.depfile, FileKind::depfile);
  files.force = arguments.force;
  return files;
}

Result<Scene> loadLevel(const BakeArguments& arguments, const std::string& output, CommandFiles& files,
                        MeshReport report, Context& context) {
  Result<Scene> scene = loadScene(arguments.scene, context, toImportOptions(arguments.sceneOptions), report);
  if (!scene) return scene;
  files.read("a file of the scene", scene->files);
  if (const Status status = checkApart(files); !status) return status.error();
  if (const Status status = checkDepfile(arguments, output, *scene, context); !status) return status.error();
  return scene;
}

// The plan that stands there, where it is the one that would be made. Whatever is wrong with it: no.
Result<BakePlan> existingPlan(const std::string& path, const Scene& scene, const BakeOptions& options) {
  Result<BakePlan> plan = readPlan(path);
  if (!plan) return plan;
  if (const Status status = checkPlanVersion(*plan); !status) return status.error();
  if (const Status status = checkPlanTracer(*plan); !status) return status.error();
  if (const Status status = checkPlanLevel(*plan, scene); !status) return status.error();
  if (plan->bake.provenance.optionsJson == optionsToJson(options)) return plan;
  return Error{ErrorCode::usage, "the plan there has other options"};
}

std::string sizesOf(const BakePlan& plan) {
  const MadeCounts made = countsOf(plan.bake);
  return std::to_string(made.surfels) + " surfels, " + std::to_string(made.caches) + " caches";
}

// Of a shard the caches and links that are its own.
MadeCounts countsOf(const BakePlan& plan, const Shard& shard) {
  MadeCounts made = countsOf(plan.bake);
  made.caches = shard.range.count();
  made.links = shard.links.count();
  return made;
}

std::string sizesOf(const BakePlan& plan, const Shard& shard) {
  const MadeCounts made = countsOf(plan, shard);
  return std::to_string(made.caches) + " of " + std::to_string(plan.bake.caches.count()) + " caches, " +
         std::to_string(made.links) + " links";
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

// The shard that stands there, where it is complete and the one that would be made.
Result<Shard> existingShard(const std::string& path, const BakePlan& plan, const ShardNumber& number) {
  Result<Shard> shard = readShard(path);
  if (!shard) return shard;
  if (const Status status = checkShard(*shard, plan); !status) return status.error();
  if (shard->number == number) return shard;
  return Error{ErrorCode::usage, "shard " + toString(shard->number) + " of this plan is there"};
}

// The level of the plan, or what changed in it.
Status explainLevel(const Scene& scene, const BakePlan& plan) {
  const Status status = checkPlanLevel(plan, scene);
  if (status) return status;
  constexpr std::size_t kMaxNamed = 4;
  const std::string changes = listChanges(findStaleness(scene, nullptr, plan.bake).sentences(), kMaxNamed);
  return Error{status.error().code, status.error().message + (changes.empty() ? "" : "\n  " + changes)};
}

}  // namespace

int runPlan(const BakeArguments& arguments) {
  const auto begin = std::chrono::steady_clock::now();
  const Result<BakeOptions> options = chooseOptions(arguments, presetOptions(arguments.preset));
  if (!options) return fail(options.error());
  Terminal terminal(arguments.terminal, stagesOf(*options,
                                                 {"import", "rays", "play space", "surfels", "hierarchy", "caches",
                                                  "test rays", "receivers", "provenance"},
                                                 0.0));
  Context& context = terminal.context();
  CommandFiles files = filesOf(arguments);
  files.write("--plan", arguments.plan, FileKind::plan);
  const bool mayBeThere = mayBeMade(arguments.plan, arguments.force);
  if (const Status status = mayBeThere ? checkKinds(files) : checkOutputs(files, context); !status)
    return fail(status.error());
  const Result<Scene> scene = loadLevel(arguments, arguments.plan, files, MeshReport::log, context);
  if (!scene) return terminal.finish(), fail(scene.error());

  const auto existing = takeExisting(arguments.plan, arguments.force, "planning", context,
                                     [&] { return existingPlan(arguments.plan, *scene, *options); });
  if (existing) {
    terminal.finish();
    const std::string report = describeRun(context, *options, existing->bake.provenance.rayTracer,
                                           countsOf(existing->bake), secondsSince(begin), true);
    return endUpToDate(arguments, arguments.plan, *scene, report, "a plan of " + sizesOf(*existing));
  }
  if (const Status status = mayBeThere ? checkOutputs(files, context) : done(); !status)
    return terminal.finish(), fail(status.error());
  const Result<BakePlan> plan = makePlan(*scene, *options, context);
  if (!plan) return terminal.finish(), fail(plan.error());
  {
    const Context::Stage stage(context, "write");
    if (const Status status = writePlan(*plan, arguments.plan); !status) return terminal.finish(), fail(status.error());
  }
  terminal.finish();
  const std::string report =
      describeRun(context, *options, plan->bake.provenance.rayTracer, countsOf(plan->bake), secondsSince(begin), false);
  if (const Status status = writeSideFiles(arguments, arguments.plan, *scene, report); !status)
    return fail(status.error());
  std::printf("%s: a plan of %s in %.2f s, peak memory %.0f MiB\n", printable(arguments.plan).c_str(),
              sizesOf(*plan).c_str(), secondsSince(begin), peakMemoryMiB());
  return 0;
}

int runShard(const BakeArguments& arguments) {
  const auto begin = std::chrono::steady_clock::now();
  const Result<ShardNumber> number = parseShardNumber(arguments.shard);
  if (!number) return fail({number.error().code, "--shard: " + number.error().message});
  if (arguments.output.empty()) return fail({ErrorCode::usage, "-o: the name of the shard to write expected"});
  const Result<BakePlan> plan = [&]() -> Result<BakePlan> {
    Terminal reading(arguments.terminal.maxMemory);
    if (const Status status = reserveBake(reading.context(), "plan", arguments.plan); !status) return status.error();
    return readPlan(arguments.plan);
  }();
  if (!plan) return fail(plan.error());
  if (const Status status = checkSameOptions(arguments, *plan); !status) return fail(status.error());

  Terminal terminal(arguments.terminal, stagesOf(plan->options, {"import", "rays", "links"}, 1.0 / number->count));
  Context& context = terminal.context();
  CommandFiles files = filesOf(arguments);
  files.read("the plan", arguments.plan);
  files.write("-o", arguments.output, FileKind::shard);
  const bool mayBeThere = mayBeMade(arguments.output, arguments.force);
  if (const Status status = mayBeThere ? checkKinds(files) : checkOutputs(files, context); !status)
    return fail(status.error());
  const std::string& rayTracer = plan->bake.provenance.rayTracer;
  const auto existing = takeExisting(arguments.output, arguments.force, "shard " + toString(*number) + " again",
                                     context, [&] { return existingShard(arguments.output, *plan, *number); });
  if (const Status status = mayBeThere && !existing ? checkOutputs(files, context) : done(); !status)
    return terminal.finish(), fail(status.error());
  // A shard that is there names its plan only: whether that still is the level's is asked in any case.
  const Result<Scene> scene = loadLevel(arguments, arguments.output, files, MeshReport::none, context);
  if (!scene) return terminal.finish(), fail(scene.error());
  if (const Status status = explainLevel(*scene, *plan); !status) return terminal.finish(), fail(status.error());
  if (existing) {
    terminal.finish();
    const std::string report =
        describeRun(context, plan->options, rayTracer, countsOf(*plan, *existing), secondsSince(begin), true);
    return endUpToDate(arguments, arguments.output, *scene, report,
                       "shard " + toString(*number) + " of this plan, " + sizesOf(*plan, *existing));
  }

  const Result<Shard> shard = traceShard(*scene, *plan, *number, context);
  if (!shard) return terminal.finish(), fail(shard.error());
  {
    const Context::Stage stage(context, "write");
    if (const Status status = writeShard(*shard, arguments.output); !status)
      return terminal.finish(), fail(status.error());
  }
  terminal.finish();
  const std::string report =
      describeRun(context, plan->options, rayTracer, countsOf(*plan, *shard), secondsSince(begin), false);
  if (const Status status = writeSideFiles(arguments, arguments.output, *scene, report); !status)
    return fail(status.error());
  std::printf("%s: shard %s, %s in %.2f s, peak memory %.0f MiB\n", printable(arguments.output).c_str(),
              toString(*number).c_str(), sizesOf(*plan, *shard).c_str(), secondsSince(begin), peakMemoryMiB());
  return 0;
}

}  // namespace relume
