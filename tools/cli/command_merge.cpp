// SPDX-License-Identifier: MIT
// relume merge PLAN SHARD... -o BAKE: joins the shards of a plan to the bake that relume bake would have written.
#include "bake/shards/shard.h"
#include "relume/bake_file.h"
#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/cli/bake_arguments.h"
#include "tools/cli/commands.h"
#include "tools/cli/describe.h"
#include "tools/cli/reserve_bake.h"

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

struct MergeArguments {
  std::string plan, output, reportFile;
  std::vector<std::string> shards;
  bool force = false;
  TerminalOptions terminal;
};

int runMerge(const MergeArguments& arguments) {
  const auto begin = std::chrono::steady_clock::now();
  Terminal terminal(arguments.terminal);
  Context& context = terminal.context();
  CommandFiles files;
  files.read("the plan", arguments.plan);
  for (const std::string& shard : arguments.shards) files.read("a shard", shard);
  files.write("-o", arguments.output, FileKind::bake);
  files.write("--report", arguments.reportFile, FileKind::bakeReport);
  files.force = arguments.force;
  if (const Status status = checkOutputs(files, context); !status) return fail(status.error());

  std::vector<NamedShard> shards;
  if (const Status status = reserveBake(context, "merge", arguments.plan); !status) return fail(status.error());
  Result<BakePlan> plan = readPlan(arguments.plan);
  if (!plan) return fail(plan.error());
  {
    const Context::Stage stage(context, "read");
    for (const std::string& shard : arguments.shards) {
      if (context.cancelled()) return terminal.finish(), fail(cancelledError());
      if (const Status status = reserveBake(context, "merge", shard); !status) return fail(status.error());
      shards.push_back({shard, readShard(shard)});
    }
  }
  const BakeOptions options = plan->options;
  const Result<Bake> bake = mergeShards(std::move(*plan), std::move(shards), context);
  if (!bake) return terminal.finish(), fail(bake.error());
  {
    const Context::Stage stage(context, "write");
    if (const Status status = writeBake(*bake, arguments.output); !status)
      return terminal.finish(), fail(status.error());
  }
  terminal.finish();
  const MadeCounts made = countsOf(*bake);
  const std::string report =
      describeRun(context, options, bake->provenance.rayTracer, made, secondsSince(begin), false);
  if (const Status status = writeReport(arguments.reportFile, report); !status) return fail(status.error());
  const std::string certified = certificateText(*bake);
  std::printf("%s: %zu shards, %u surfels, %u caches, %u links in %.2f s, peak memory %.0f MiB, %s%s\n",
              printable(arguments.output).c_str(), arguments.shards.size(), made.surfels, made.caches, made.links,
              secondsSince(begin), peakMemoryMiB(), costText(*bake).c_str(),
              certified.empty() ? "" : (", " + certified).c_str());
  return 0;
}

}  // namespace

void addMergeCommand(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("merge", "Join the shards of a plan to a bake");
  auto arguments = std::make_shared<MergeArguments>();
  command->add_option("PLAN", arguments->plan, "Plan, of relume bake --plan")->option_text("FILE REQUIRED")->required();
  command->add_option("SHARD", arguments->shards, "All shards of the plan, in any order (relume bake --shard)")
      ->option_text("FILE... REQUIRED")
      ->required();
  command->add_option("-o,--output", arguments->output, "Bake to write (.relume)")
      ->option_text("FILE REQUIRED")
      ->required();
  command->add_option("--report", arguments->reportFile, "Write stage times and figures to this JSON file")
      ->option_text("FILE");
  command->add_flag("--force", arguments->force, "Write over files that are something else than a bake, or read-only");
  addMemoryOption(*command, arguments->terminal.maxMemory);
  addProgressOption(*command, arguments->terminal.progress);
  command->callback([arguments, &action] { action = [arguments] { return runMerge(*arguments); }; });
}

}  // namespace relume
