// SPDX-License-Identifier: MIT
// relume status SCENE BAKE: is the bake up to date, and what changed if not? Exit status 7 when something did.
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"
#include "tools/base/printable.h"
#include "tools/base/scene_options.h"
#include "tools/cli/commands.h"
#include "tools/cli/reserve_bake.h"
#include "tools/cli/terminal.h"
#include "tools/compare/staleness.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <memory>
#include <string>

namespace relume {
namespace {

struct StatusArguments {
  std::string scene, bake;
  std::uint64_t maxMemory = 0;
  bool json = false;
  SceneOptions sceneOptions;
};

int runStatus(const StatusArguments& arguments) {
  Terminal terminal(arguments.maxMemory);
  Context& context = terminal.context();
  if (const Status ok = reserveBake(context, "status", arguments.bake); !ok) return fail(ok.error());
  const Result<Bake> bake = mapBake(arguments.bake);
  if (!bake) return fail(bake.error());
  const Result<Scene> scene = loadScene(arguments.scene, context, toImportOptions(arguments.sceneOptions));
  if (!scene) return fail(scene.error());
  Staleness stale = findStaleness(*scene, nullptr, *bake);
  if (!stale.upToDate() && scene->exportedWith) {
    const Result<std::uint64_t> hash = identifyBakeFile(arguments.bake);
    if (!hash) return fail(hash.error());
    stale = findExportStaleness(*scene, *bake, *hash);
  }

  if (arguments.json) {
    using Json = nlohmann::json;
    Json changes = Json::array();
    for (const PartChange& c : stale.parts)
      changes.push_back({{"node", c.node}, {"mesh", c.mesh}, {"change", toString(c.kind)}, {"text", toString(c)}});
    for (const std::string& text : stale.others) changes.push_back({{"text", text}});
    const Json report = {
        {"scene", arguments.scene},     {"bake", arguments.bake}, {"exportedLevel", scene->exportedWith.has_value()},
        {"upToDate", stale.upToDate()}, {"changes", changes},     {"notes", stale.notes}};
    std::printf("%s\n", jsonText(report).c_str());
  } else if (stale.upToDate()) {
    std::printf("%s: up to date\n", printable(arguments.bake).c_str());
    for (const std::string& note : stale.notes) std::printf("  %s\n", printable(note).c_str());
  } else {
    std::printf("%s: out of date\n", printable(arguments.bake).c_str());
    for (const std::string& sentence : stale.sentences()) std::printf("  %s\n", printable(sentence).c_str());
  }
  return stale.upToDate() ? 0 : kDifferenceFound;
}

}  // namespace

void addStatusCommand(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "status", "Say whether a bake is up to date with its scene, or what changed; exit status 7 then");
  auto arguments = std::make_shared<StatusArguments>();
  command->add_option("SCENE", arguments->scene, "Level, glTF 2.0 (.glb, .gltf)")->type_name("FILE")->required();
  command->add_option("BAKE", arguments->bake, "Bake of it (.relume)")->type_name("FILE")->required();
  command->add_flag("--json", arguments->json, "Print JSON");
  addSceneOptions(*command, arguments->sceneOptions);
  addMemoryOption(*command, arguments->maxMemory);
  command->callback([arguments, &action] { action = [arguments] { return runStatus(*arguments); }; });
}

}  // namespace relume
