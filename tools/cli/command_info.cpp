// SPDX-License-Identifier: MIT
// relume info FILE [--json]: what is in a bake (sizes, table of chunks, options, statistics) or in a scene (summary and
// mesh report).
#include "bake/base/printed.h"
#include "formats/chunks.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"
#include "tools/base/printable.h"
#include "tools/base/scene_options.h"
#include "tools/cli/commands.h"
#include "tools/cli/describe.h"
#include "tools/cli/reserve_bake.h"
#include "tools/cli/terminal.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

namespace relume {
namespace {

using Json = nlohmann::json;

struct InfoArguments {
  std::string file;
  std::uint64_t maxMemory = 0;
  bool json = false;
  SceneOptions sceneOptions;
};

std::string plain(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// "  name            value", groups indented; lists of objects are left to the callers.
void printFields(const Json& object, int indent) {
  for (const auto& [key, value] : object.items()) {
    const bool table = value.is_array() && !value.empty() && value.front().is_object();
    if (table) continue;
    if (value.is_object()) {
      std::printf("%*s%s\n", indent, "", key.c_str());
      printFields(value, indent + 2);
      continue;
    }
    std::printf("%*s%-*s %s\n", indent, "", std::max(1, 24 - indent), key.c_str(), plain(value).c_str());
  }
}

void printChunks(const Json& chunks) {
  std::printf("%-16s %-12s %12s %4s %12s %12s  %s\n", "chunk", "type", "rows", "col", "offset", "bytes", "xxh3");
  for (const Json& c : chunks)
    std::printf("%-16s %-12s %12s %4s %12s %12s  %s\n", plain(c["name"]).c_str(), plain(c["type"]).c_str(),
                plain(c["shape"][0]).c_str(), plain(c["shape"][1]).c_str(), plain(c["offset"]).c_str(),
                plain(c["bytes"]).c_str(), plain(c["xxh3"]).c_str());
}

// The error under each light, and the parts that add most to the mean of their squares.
void printCertificate(const Json& certificate) {
  constexpr std::size_t kParts = 8;
  std::printf("certified error          %.1f %%\n", 100.0 * certificate["error"].get<double>());
  for (const Json& light : certificate["lights"]) {
    const double squared = light["squaredError"], deviation = light["standardError"];
    std::printf("  under a %-14s %.1f %%, squared %.4f, standard error %.4f\n", plain(light["kind"]).c_str(),
                100.0 * std::sqrt(std::max(squared, 0.0)), squared, deviation);
  }
  for (std::size_t i = 0; i < std::min(kParts, certificate["parts"].size()); ++i) {
    const Json& part = certificate["parts"][i];
    if (!(part["share"].get<double>() > 0.0)) break;  // the others are less than the estimate's noise
    if (i == 0) std::printf("  of the mean squared error under all lights, where it is above 0:\n");
    std::printf("    %5.1f %% on node \"%s\", %s receivers\n", 100.0 * part["share"].get<double>(),
                plain(part["node"]).c_str(), plain(part["receivers"]).c_str());
  }
}

void printMeshReport(const Json& report) {
  std::printf("mesh report: %zu finding%s\n", report.size(), report.size() == 1 ? "" : "s");
  for (const Json& f : report)
    std::printf("  node \"%s\", mesh \"%s\": %s, %s of them, the first is triangle %s\n", plain(f["node"]).c_str(),
                plain(f["mesh"]).c_str(), plain(f["what"]).c_str(), plain(f["count"]).c_str(),
                plain(f["firstTriangle"]).c_str());
}

// "  point "lamp": 12 11 9 W/sr (8196 7513 6147 cd in the file)"
void printLights(const Json& lights) {
  if (lights.empty()) return;
  const auto triple = [](const Json& v) {
    return printed("%.5g %.5g %.5g", v[0].get<double>(), v[1].get<double>(), v[2].get<double>());
  };
  std::printf("lights: %zu\n", lights.size());
  for (const Json& light : lights) {
    std::printf("  %s \"%s\": %s %s", plain(light["type"]).c_str(), plain(light["name"]).c_str(),
                triple(light["intensity"]).c_str(), plain(light["unit"]).c_str());
    if (light.contains("unitInFile"))
      std::printf(" (%s %s in the file)", triple(light["intensityInFile"]).c_str(), plain(light["unitInFile"]).c_str());
    if (light.contains("positionM")) std::printf(", at %s m", triple(light["positionM"]).c_str());
    std::printf("\n");
  }
}

Result<Json> describeFile(const std::string& file, const SceneOptions& options, Context& context) {
  std::string extension = std::filesystem::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  if (extension == ".glb" || extension == ".gltf") {
    context.onMessage = [](Severity severity, std::string_view text) { logMessage(severity, std::string(text)); };
    const Result<Scene> scene = importGltf(file, context, toImportOptions(options));
    if (!scene) return scene.error();
    return describeScene(*scene, context);
  }
  if (Status ok = reserveBake(context, "info", file); !ok) return ok.error();
  const Result<Bake> bake = mapBake(file);
  if (!bake && bake.error().code == ErrorCode::invalidFile && extension != ".relume" && extension != ".gz") {
    return Error{ErrorCode::invalidFile,
                 bake.error().message + "; levels are read as .glb or .gltf, which editors export"};
  }
  if (!bake) return bake.error();
  const Result<std::vector<ChunkInfo>> chunks = listChunks(file);
  if (!chunks) return chunks.error();
  const Result<std::uint64_t> hash = identifyBakeFile(file);
  if (!hash) return hash.error();
  const Result<bool> packed = isPackedFile(file);
  if (!packed) return packed.error();
  return describeBake(*bake, *chunks, *hash, *packed);
}

int runInfo(const InfoArguments& arguments) {
  Terminal terminal(arguments.maxMemory);
  Result<Json> info = describeFile(arguments.file, arguments.sceneOptions, terminal.context());
  if (!info) return fail(info.error());
  (*info)["file"] = arguments.file;
  if (arguments.json) {
    std::printf("%s\n", jsonText(*info).c_str());
    return 0;
  }
  const Json text = printableStrings(*info);
  Json fields = text;
  fields.erase("certificate");
  printFields(fields, 0);
  if (text.contains("instances") && text["instances"].is_array())
    std::printf("%-24s %zu\n", "instances", text["instances"].size());
  if (text.contains("lights") && !text["lights"].empty()) printLights(text["lights"]);
  if (text.contains("certificate") && text["certificate"].is_object()) printCertificate(text["certificate"]);
  if (text.contains("chunks")) printChunks(text["chunks"]);
  if (text.contains("meshReport")) printMeshReport(text["meshReport"]);
  return 0;
}

}  // namespace

void addInfoCommand(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("info", "Say what is in a bake (.relume) or a scene (.glb, .gltf)");
  auto arguments = std::make_shared<InfoArguments>();
  command->add_option("FILE", arguments->file, "Bake (.relume) or scene (.glb, .gltf)")
      ->option_text("FILE REQUIRED")
      ->required();
  command->add_flag("--json", arguments->json, "Print JSON");
  addSceneOptions(*command, arguments->sceneOptions);
  addMemoryOption(*command, arguments->maxMemory);
  command->callback([arguments, &action] { action = [arguments] { return runInfo(*arguments); }; });
}

}  // namespace relume
