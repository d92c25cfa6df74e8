// SPDX-License-Identifier: MIT
// relume export SCENE BAKE -o LEVEL.glb: the level with its light-map coordinates, for the game.
#include "bake/export/export_level.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"
#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/base/scene_options.h"
#include "tools/cli/commands.h"
#include "tools/cli/terminal.h"
#include "tools/compare/fit_bake.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <memory>
#include <string>

namespace relume {
namespace {

struct ExportArguments {
  std::string scene, bake, output;
  bool force = false, json = false;
  SceneOptions sceneOptions;
  TerminalOptions terminal;
};

void printReport(const ExportedLevel& level, const ExportArguments& arguments) {
  if (arguments.json) {
    nlohmann::json report = {
        {"level", arguments.output},     {"texcoord", level.texcoord},           {"lightmapInstances", level.instances},
        {"vertices", level.vertices},    {"verticesAdded", level.verticesAdded}, {"meshesAdded", level.meshesAdded},
        {"nodesAdded", level.nodesAdded}};
    if (level.backTexcoord >= 0) report["backTexcoord"] = level.backTexcoord;
    std::printf("%s\n", jsonText(report).c_str());
    return;
  }
  const std::string backs =
      level.backTexcoord < 0 ? "" : ", of back sides in TEXCOORD_" + std::to_string(level.backTexcoord);
  std::printf("%s: light-map coordinates in TEXCOORD_%d%s; %u parts, %llu vertices and %llu where charts end\n",
              printable(arguments.output).c_str(), level.texcoord, backs.c_str(), level.instances,
              static_cast<unsigned long long>(level.vertices), static_cast<unsigned long long>(level.verticesAdded));
}

// A bake of another state is of no use here, whatever `relume render` could make of it.
Error withoutAllowStale(Error error) {
  const std::string offer = ", or give --allow-stale";
  if (const std::size_t at = error.message.rfind(offer); at != std::string::npos) error.message.erase(at, offer.size());
  return error;
}

int runExport(const ExportArguments& arguments) {
  Terminal terminal(arguments.terminal);
  Context& context = terminal.context();
  CommandFiles files;
  files.read("the scene", arguments.scene);
  files.read("the bake", arguments.bake);
  files.write("-o", arguments.output, FileKind::exportedLevel);
  files.force = arguments.force;
  if (const Status status = checkOutputs(files, context); !status) return fail(status.error());

  const auto scene = loadScene(arguments.scene, context, toImportOptions(arguments.sceneOptions));
  if (!scene) return terminal.finish(), fail(scene.error());
  const auto bake = readBakeOf(*scene, arguments.bake, arguments.scene, /*allowStale=*/false, context);
  if (!bake) return terminal.finish(), fail(withoutAllowStale(bake.error()));
  const auto hash = identifyBakeFile(arguments.bake);
  if (!hash) return terminal.finish(), fail(hash.error());
  const auto level = exportLevel(arguments.scene, *scene, *bake, *hash, context);
  terminal.finish();
  if (!level) return fail(level.error());
  // Images that the baker has no use for are read here first.
  files.read("a file of the scene", scene->files);
  files.read("a file of the scene", level->document.files());
  if (const Status status = checkApart(files); !status) return fail(status.error());
  if (const Status status = level->document.write(arguments.output); !status) return fail(status.error());
  printReport(*level, arguments);
  return 0;
}

}  // namespace

void addExportCommand(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("export", "Write a level with its light-map coordinates as a further TEXCOORD set");
  auto arguments = std::make_shared<ExportArguments>();
  command->add_option("SCENE", arguments->scene, "Level, glTF 2.0 (.glb, .gltf)")->type_name("FILE")->required();
  command->add_option("BAKE", arguments->bake, "Bake of it (.relume)")->type_name("FILE")->required();
  command->add_option("-o,--output", arguments->output, "Level to write (.glb)")
      ->option_text("FILE REQUIRED")
      ->required();
  command->add_flag("--json", arguments->json, "Print JSON");
  command->add_flag("--force", arguments->force,
                    "Write over files that are something else than an exported level, or read-only");
  addSceneOptions(*command, arguments->sceneOptions);
  addTerminalOptions(*command, arguments->terminal);
  command->callback([arguments, &action] { action = [arguments] { return runExport(*arguments); }; });
}

}  // namespace relume
