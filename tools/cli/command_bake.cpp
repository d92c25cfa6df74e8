// SPDX-License-Identifier: MIT
// relume bake SCENE.glb -o FILE: imports, bakes, writes. One option of the command line for each row of the table of
// options (relume/bake/options.h) that has a flag; preset, then options file, then flags.
#include "bake/export/export_level.h"
#include "formats/file_io.h"
#include "relume/bake/bake.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"
#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/base/scene_options.h"
#include "tools/cli/bake_flags.h"
#include "tools/cli/commands.h"
#include "tools/cli/depfile.h"
#include "tools/cli/terminal.h"
#include "tools/cli/verify_bake.h"
#include "tools/compare/staleness.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace relume {
namespace {

struct BakeArguments {
  std::string scene, output, optionsFile, reportFile, depfile, exportedLevel;
  Preset preset = Preset::high;
  bool printOptions = false, force = false, verify = false;
  BakeFlags flags;
  SceneOptions sceneOptions;
  TerminalOptions terminal;
};

constexpr std::size_t kMaxOptionsBytes = 1 << 20;

Result<std::string> readText(const std::string& path) {
  const Result<FileBytes> file = readFile(path, kMaxOptionsBytes);
  if (!file) return Error{file.error().code == ErrorCode::io ? ErrorCode::io : ErrorCode::usage, file.error().message};
  return std::string(reinterpret_cast<const char*>(file->bytes.data()), file->bytes.size());
}

Status writeText(const std::string& path, const std::string& text) {
  return writeFileAtomically(path, [&](const ByteSink& sink) { return sink(std::as_bytes(std::span(text))); });
}

// Preset, options file, then the flags.
Result<BakeOptions> chooseOptions(const BakeArguments& arguments) {
  BakeOptions options = presetOptions(arguments.preset);
  if (!arguments.optionsFile.empty()) {
    const Result<std::string> text = readText(arguments.optionsFile);
    if (!text) return text.error();
    Result<BakeOptions> read = optionsFromJson(*text, options);
    if (!read) return Error{read.error().code, arguments.optionsFile + ": " + read.error().message};
    options = *read;
  }
  return chooseBakeOptions(options, arguments.flags);
}

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

double peakMemoryMiB() {
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

// Stages with seconds and figures, options, sizes. Unlike the bake itself it may say when and how long.
std::string describeRun(const Context& context, const BakeOptions& options, const Bake& bake, double seconds,
                        bool upToDate) {
  nlohmann::json stages = nlohmann::json::array();
  for (const StageReport& stage : context.report()) {
    nlohmann::json figures = nlohmann::json::object();
    for (const auto& [name, value] : stage.figures) figures[name] = value;
    stages.push_back({{"stage", stage.stage}, {"seconds", stage.seconds}, {"figures", figures}});
  }
  const nlohmann::json report = {{"seconds", seconds},
                                 {"upToDate", upToDate},
                                 {"peakMemoryMiB", peakMemoryMiB()},
                                 {"stages", stages},
                                 {"options", nlohmann::json::parse(optionsToJson(options))},
                                 {"surfels", bake.surfels.count()},
                                 {"nodes", bake.hierarchy.nodeCount()},
                                 {"caches", bake.caches.count()},
                                 {"links", bake.links.count()},
                                 {"rayTracer", bake.provenance.rayTracer}};
  return jsonText(report) + "\n";
}

// The bake that stands at the output, when scene and options would give it again. Whatever is wrong with it: no.
std::optional<Bake> existingBake(const BakeArguments& arguments, const Scene& scene, const BakeOptions& options,
                                 Context& context) {
  std::error_code ignored;
  if (arguments.force || arguments.verify || !std::filesystem::is_regular_file(arguments.output, ignored))
    return std::nullopt;
  const Result<Bake> bake = mapBake(arguments.output);
  if (!bake) {
    context.message(Severity::info, "baking: " + bake.error().message);
    return std::nullopt;
  }
  const Staleness stale = findStaleness(scene, &options, *bake);
  constexpr std::size_t kMaxNamed = 8;
  const std::vector<std::string> sentences = stale.sentences();
  for (std::size_t i = 0; i < std::min(kMaxNamed, sentences.size()); ++i)
    context.message(Severity::info, "baking: " + sentences[i]);
  if (sentences.size() > kMaxNamed)
    context.message(Severity::info, "baking: and " + std::to_string(sentences.size() - kMaxNamed) + " changes more");
  if (!stale.upToDate()) return std::nullopt;
  return *bake;
}

// The level with the bake's light-map coordinates.
Status writeLevel(const BakeArguments& arguments, const Scene& scene, const Bake& bake, Context& context) {
  if (arguments.exportedLevel.empty()) return done();
  const Result<std::uint64_t> hash = identifyBakeFile(arguments.output);
  if (!hash) return hash.error();
  const Result<ExportedLevel> level = exportLevel(arguments.scene, scene, bake, *hash, context);
  return level ? level->document.write(arguments.exportedLevel) : level.error();
}

// Level, report and depfile, which are written whether or not there was something to bake.
Status writeSideFiles(const BakeArguments& arguments, const Scene& scene, const std::string& report) {
  if (!arguments.reportFile.empty()) {
    if (const Status status = writeText(arguments.reportFile, report); !status) return status;
  }
  if (arguments.depfile.empty()) return done();
  std::vector<std::filesystem::path> files = scene.files;
  if (!arguments.optionsFile.empty()) files.emplace_back(arguments.optionsFile);
  return writeText(arguments.depfile, makeDepfile(arguments.output, files));
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

int runBake(const BakeArguments& arguments) {
  const auto begin = std::chrono::steady_clock::now();
  const Result<BakeOptions> options = chooseOptions(arguments);
  if (!options) return fail(options.error());
  if (arguments.printOptions) {
    std::fputs(describeOptions(*options).c_str(), stdout);
    return 0;
  }

  if (arguments.output.empty()) return fail({ErrorCode::usage, "-o: a file's name expected, \"\" found"});
  // Find out now, not after the bake, whether the results can be written, and over what.
  Terminal terminal(arguments.terminal, planBake(*options, arguments.verify));
  Context& context = terminal.context();
  CommandFiles files = filesOf(arguments);
  if (const Status status = checkOutputs(files, context); !status) return fail(status.error());
  const Result<Scene> scene =
      loadScene(arguments.scene, context, toImportOptions(arguments.sceneOptions), MeshReport::log);
  if (!scene) return terminal.finish(), fail(scene.error());
  files.read("a file of the scene", scene->files);
  if (const Status status = checkApart(files); !status) return terminal.finish(), fail(status.error());
  if (!arguments.exportedLevel.empty()) {
    if (const Status status = checkExportable(arguments.scene); !status) return terminal.finish(), fail(status.error());
  }
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  if (const std::optional<Bake> existing = existingBake(arguments, *scene, *options, context)) {
    const Status exported = writeLevel(arguments, *scene, *existing, context);
    terminal.finish();
    if (!exported) return fail(exported.error());
    // Younger than its inputs, so that a build system that goes by time does not ask again.
    std::error_code ignored;
    std::filesystem::last_write_time(arguments.output, std::filesystem::file_time_type::clock::now(), ignored);
    const std::string report = describeRun(context, *options, *existing, seconds(), true);
    if (const Status status = writeSideFiles(arguments, *scene, report); !status) return fail(status.error());
    std::printf("%s: up to date (--force bakes again)\n", printable(arguments.output).c_str());
    return 0;
  }
  const Result<Bake> baked = bake(*scene, *options, context);
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

  const std::string report = describeRun(context, *options, *baked, seconds(), false);
  if (const Status status = writeSideFiles(arguments, *scene, report); !status) return fail(status.error());
  std::printf("%s: %u surfels, %u caches, %u links in %.2f s, peak memory %.0f MiB%s\n",
              printable(arguments.output).c_str(), baked->surfels.count(), baked->caches.count(), baked->links.count(),
              seconds(), peakMemoryMiB(), arguments.verify ? ", verified" : "");
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
  command->add_option("--preset", arguments->preset, presets + presetNames())
      ->option_text("NAME [high]")
      ->transform(CLI::CheckedTransformer(presetsByName()).description(""));
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
      "Bake even if the output is up to date with scene and options, and write over files that are something else");
  command->add_flag("--verify", arguments->verify,
                    "Bake twice, with other numbers of threads, and fail when the bytes differ; implies --force");
  command
      ->add_option("--export-glb", arguments->exportedLevel,
                   "Write the level with its light-map coordinates for the game, as relume export does (.glb)")
      ->option_text("FILE");
  command->add_option("--depfile", arguments->depfile, "Write what the bake depends on, for Make and Ninja")
      ->option_text("FILE");
  addSceneOptions(*command, arguments->sceneOptions);
  addTerminalOptions(*command, arguments->terminal);
  addBakeFlags(*command, arguments->flags);
  command->callback([arguments, &action] { action = [arguments] { return runBake(*arguments); }; });
}

}  // namespace relume
