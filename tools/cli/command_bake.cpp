// SPDX-License-Identifier: MIT
// relume bake SCENE.glb -o FILE: imports, bakes, writes; bake_shards.cpp has --plan and --shard. One option of the
// command line for each row of the table of options (relume/bake/options.h) that has a flag; preset, then options file,
// then flags.
#include "bake/export/export_level.h"
#include "formats/chunks.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"
#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/base/usage_message.h"
#include "tools/cli/bake_arguments.h"
#include "tools/cli/commands.h"
#include "tools/cli/describe.h"
#include "tools/cli/verify_bake.h"
#include "tools/compare/staleness.h"

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace relume {
namespace {

// The options as JSON with a comment a line; `--options` reads it back.
std::string describeOptions(const BakeOptions& options) {
  std::string text = "{\n", group;
  const std::vector<OptionInfo> list = listOptions(options);
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::size_t dot = list[i].name.find('.');
    const std::string itsGroup = dot == std::string::npos ? "" : list[i].name.substr(0, dot);
    const std::string nextGroup =
        i + 1 < list.size() ? list[i + 1].name.substr(0, std::min(list[i + 1].name.find('.'), list[i + 1].name.size()))
                            : "";
    if (!itsGroup.empty() && itsGroup != group) text += "  \"" + itsGroup + "\": {\n";
    group = itsGroup;
    const std::string indent = itsGroup.empty() ? "  " : "    ";
    const bool lastOfGroup = !itsGroup.empty() && nextGroup != itsGroup;
    text += indent + "// " + list[i].comment + " [" + list[i].range + (list[i].unit.empty() ? "" : " " + list[i].unit) +
            "]\n";
    text += indent + "\"" + list[i].name.substr(itsGroup.empty() ? 0 : dot + 1) + "\": " + list[i].value;
    text += (lastOfGroup ? "\n  }" : "") + std::string(i + 1 < list.size() ? ",\n" : "\n");
  }
  return text + "}\n";
}

// The bake that stands at the output, when scene and options would give its file again. Whatever is wrong with it: no.
Result<Bake> existingBake(const std::string& output, const Scene& scene, const BakeOptions& options, Context& context) {
  Result<Bake> bake = mapBake(output);
  if (!bake) return bake;
  const Result<bool> packed = isPackedFile(output);
  if (!packed) return packed.error();
  if (*packed)
    return Error{ErrorCode::usage, "\"" + output +
                                       "\" is a packed bake (relume pack) and will be a plain one; pack to another "
                                       "name to keep both"};
  const Staleness stale = findStaleness(scene, &options, *bake);
  constexpr std::size_t kMaxNamed = 8;
  const std::string changes = listChanges(stale.sentences(), kMaxNamed);
  if (!stale.upToDate()) return Error{ErrorCode::usage, changes};
  if (!changes.empty()) context.message(Severity::info, "baking: " + changes);
  return bake;
}

// The level with the bake's light-map coordinates.
Status writeLevel(const BakeArguments& arguments, const Scene& scene, const Bake& bake, Context& context) {
  if (arguments.exportedLevel.empty()) return done();
  const Result<std::uint64_t> hash = identifyBakeFile(arguments.output);
  if (!hash) return hash.error();
  const Result<ExportedLevel> level = exportLevel(arguments.scene, scene, bake, *hash, context);
  return level ? level->document.write(arguments.exportedLevel) : level.error();
}

CommandFiles filesOf(const BakeArguments& arguments) {
  CommandFiles files;
  files.read("the scene", arguments.scene);
  files.read("the file of --options", arguments.optionsFile);
  files.write("-o", arguments.output, FileKind::bake);
  files.write("--report", arguments.reportFile, FileKind::bakeReport);
  files.write("--export-glb", arguments.exportedLevel, FileKind::exportedLevel);
  files.write("--depfile", arguments.depfile, FileKind::depfile);
  files.force = arguments.force;
  return files;
}

// What --plan and --shard go with.
Status checkForm(const BakeArguments& arguments) {
  if (arguments.plan.empty()) {
    return arguments.shard.empty() ? done() : Status(usage("--shard: needs the plan that it is a shard of, --plan"));
  }
  if (!arguments.exportedLevel.empty())
    return usage("--export-glb: not with --plan; merge the shards, then use relume export");
  if (arguments.verify) return usage("--verify: not with --plan; relume compare compares a merged bake with another");
  if (!arguments.store.where.empty())
    return usage("--store: not with --plan; a farm's shards lie in a folder of their own (docs/guide/farm.md)");
  if (arguments.shard.empty() && !arguments.output.empty())
    return usage("-o: not with --plan alone, which writes the plan; with --shard it is the shard to write");
  return done();
}

int runBake(const BakeArguments& arguments) {
  if (const Status status = checkForm(arguments); !status) return fail(status.error());
  if (!arguments.plan.empty() && !arguments.printOptions)
    return arguments.shard.empty() ? runPlan(arguments) : runShard(arguments);
  const auto begin = std::chrono::steady_clock::now();
  const Result<BakeOptions> options = chooseOptions(arguments, presetOptions(arguments.preset));
  if (!options) return fail(options.error());
  if (arguments.printOptions) {
    std::fputs(describeOptions(*options).c_str(), stdout);
    return 0;
  }

  // Find out now, not after the bake, whether the results can be written, and over what. Where a bake is there that may
  // be up to date, the former waits: its folder may be read-only.
  Terminal terminal(arguments.terminal, planBake(*options, arguments.verify));
  Context& context = terminal.context();
  CommandFiles files = filesOf(arguments);
  const bool mayBeThere = mayBeMade(arguments.output, arguments.force || arguments.verify);
  if (const Status status = mayBeThere ? checkKinds(files) : checkOutputs(files, context); !status)
    return fail(status.error());
  const Result<Scene> scene =
      loadScene(arguments.scene, context, toImportOptions(arguments.sceneOptions), MeshReport::log);
  if (!scene) return terminal.finish(), fail(scene.error());
  files.read("a file of the scene", scene->files);
  if (const Status status = checkApart(files); !status) return terminal.finish(), fail(status.error());
  if (const Status status = checkDepfile(arguments, arguments.output, *scene, context); !status)
    return terminal.finish(), fail(status.error());
  if (!arguments.exportedLevel.empty()) {
    if (const Status status = checkExportable(arguments.scene); !status) return terminal.finish(), fail(status.error());
  }
  const auto existing = takeExisting(arguments.output, arguments.force || arguments.verify, "baking", context,
                                     [&] { return existingBake(arguments.output, *scene, *options, context); });
  if (existing) {
    const Status exported = writeLevel(arguments, *scene, *existing, context);
    terminal.finish();
    if (!exported) return fail(exported.error());
    const MadeCounts there = countsOf(*existing);
    const std::string report =
        describeRun(context, *options, existing->provenance.rayTracer, there, secondsSince(begin), true);
    return endUpToDate(arguments, arguments.output, *scene, report,
                       std::to_string(there.surfels) + " surfels, " + std::to_string(there.caches) + " caches, " +
                           std::to_string(there.links) + " links");
  }
  if (const Status status = mayBeThere ? checkOutputs(files, context) : done(); !status)
    return terminal.finish(), fail(status.error());
  std::string storeStats;
  const Result<Bake> baked = bakeByStore(*scene, *options, arguments.store, context, storeStats);
  if (!baked) return terminal.finish(), fail(baked.error());
  if (arguments.verify) {
    const Context::Stage stage(context, "verify");
    if (const Status status = verifyBake(*scene, *options, *baked, context); !status)
      return terminal.finish(), fail(status.error());
  }
  {
    const Context::Stage stage(context, "write");
    if (const Status status = writeBake(*baked, arguments.output); !status)
      return terminal.finish(), fail(status.error());
  }
  const Status exported = writeLevel(arguments, *scene, *baked, context);
  terminal.finish();
  if (!exported) return fail(exported.error());

  const std::string report =
      describeRun(context, *options, baked->provenance.rayTracer, countsOf(*baked), secondsSince(begin), false);
  if (const Status status = writeSideFiles(arguments, arguments.output, *scene, report); !status)
    return fail(status.error());
  const std::string certified = certificateText(*baked);
  std::printf("%s: %u surfels, %u caches, %u links in %.2f s, peak memory %.0f MiB, %s%s%s\n",
              printable(arguments.output).c_str(), baked->surfels.count(), baked->caches.count(), baked->links.count(),
              secondsSince(begin), peakMemoryMiB(), costText(*baked).c_str(), arguments.verify ? ", verified" : "",
              certified.empty() ? "" : (", " + certified).c_str());
  if (!storeStats.empty()) std::printf("%s\n", printable(storeStats).c_str());
  return 0;
}

}  // namespace

void addBakeCommand(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("bake", "Bake how light travels through a level");
  auto arguments = std::make_shared<BakeArguments>();
  CLI::Option* scene = command->add_option("SCENE", arguments->scene, "Level, glTF 2.0 (.glb, .gltf)");
  scene->option_text("FILE REQUIRED")->required();
  CLI::Option* output = command->add_option("-o,--output", arguments->output, "Bake to write (.relume)");
  output->option_text("FILE REQUIRED")->required();
  std::string presets = "Where options start from:";
  for (const PresetInfo& info : kPresets) presets += std::string(" ") + info.name + ", " + info.comment + ";";
  presets.back() = ' ';
  CLI::Option* preset = command->add_option("--preset", arguments->preset, presets + presetNames());
  preset->option_text("NAME [high]")->transform(CLI::CheckedTransformer(presetsByName()).description(""));
  command->add_option("--options", arguments->optionsFile, "JSON file with options, over the preset")
      ->option_text("FILE");
  // Called before what is required is looked at.
  const auto printOnly = [arguments, scene, output] {
    arguments->printOptions = true;
    scene->required(false);
    output->required(false);
  };
  command->add_flag_callback("--print-options", printOnly, "Print all options as JSON with comments, and stop");
  command->add_option("--report", arguments->reportFile, "Write stage times and figures to this JSON file")
      ->option_text("FILE");
  command->add_flag(
      "--force", arguments->force,
      "Bake even if the output is up to date with scene and options, and write over files that are something else or "
      "read-only");
  command->add_flag("--verify", arguments->verify,
                    "Bake twice, with other numbers of threads, and fail when the bytes differ; implies --force");
  command
      ->add_option("--export-glb", arguments->exportedLevel,
                   "Write the level with its light-map coordinates for the game, as relume export does (.glb)")
      ->option_text("FILE");
  command->add_option("--depfile", arguments->depfile, "Write what the bake depends on, for Make and Ninja")
      ->option_text("FILE");
  command
      ->add_option_function<std::string>(
          "--plan",
          [arguments, output](const std::string& file) {
            arguments->plan = file;
            output->required(false);
          },
          "Write what the level's shards have in common to this file, and stop; with --shard: read it")
      ->option_text("FILE");
  command
      ->add_option("--shard", arguments->shard,
                   "Trace the links of shard I of N of --plan, on any machine; relume merge joins all N to the bake")
      ->option_text("I/N");
  addStoreOptions(*command, arguments->store);
  addSceneOptions(*command, arguments->sceneOptions);
  addTerminalOptions(*command, arguments->terminal);
  addBakeFlags(*command, arguments->flags);
  command->callback([arguments, preset, &action] {
    arguments->presetGiven = preset->count() > 0;
    action = [arguments] { return runBake(*arguments); };
  });
}

}  // namespace relume
