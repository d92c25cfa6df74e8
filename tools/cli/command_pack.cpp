// SPDX-License-Identifier: MIT
// relume pack BAKE -o OUT: a bake for hosts that download it, as small as a compressor can make it.
#include "formats/chunks.h"
#include "formats/file_io.h"
#include "relume/bake/simplify.h"
#include "relume/bake_file.h"
#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/cli/commands.h"
#include "tools/cli/gzip.h"
#include "tools/cli/reserve_bake.h"
#include "tools/cli/terminal.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

namespace relume {
namespace {

enum class PackProfile { lossless, web, plain };

struct PackArguments {
  std::string bake, output;
  PackProfile profile = PackProfile::lossless;
  SimplifyOptions simplify;
  std::uint64_t maxMemory = 0;
  bool force = false, json = false;
};

// The bake as it was read, simplified, coded, and as a file: up to 3.4 were measured (docs/notes/packing.md).
constexpr double kCopies = 4.0;

bool isGzipName(const std::string& path) { return lowerExtension(path) == ".gz"; }

// The file that a bake was packed from. One that was simplified meanwhile is another bake.
Result<std::vector<std::byte>> unpack(const Bake& bake, std::uint64_t packedFrom, const std::string& path) {
  Result<std::vector<std::byte>> file = serializeBake(bake);
  if (!file || identityOf(*file) == packedFrom) return file;
  return Error{ErrorCode::usage, "--profile plain: \"" + path +
                                     "\" was simplified (--profile web): the numbers that were rounded and left out "
                                     "are lost; take the bake that it was packed from, or bake the level again"};
}

// The file's bytes, before gzip.
Result<std::vector<std::byte>> pack(const PackArguments& arguments) {
  const Result<Bake> bake = mapBake(arguments.bake);
  if (!bake) return bake.error();
  const Result<std::uint64_t> identity = identifyBakeFile(arguments.bake);
  if (!identity) return identity.error();
  if (arguments.profile == PackProfile::plain) return unpack(*bake, *identity, arguments.bake);
  if (arguments.profile == PackProfile::lossless) return serializePackedBake(*bake, *identity);
  return serializePackedBake(simplifyForWeb(*bake, arguments.simplify), *identity);
}

int runPack(const PackArguments& arguments) {
  if (arguments.simplify.keepCoordinates && arguments.profile != PackProfile::web)
    return fail({ErrorCode::usage, "--keep-coordinates: of --profile web alone; the others keep them"});
  Terminal terminal(arguments.maxMemory);
  Context& context = terminal.context();
  const bool gzipped = isGzipName(arguments.output);
  CommandFiles files;
  files.read("the bake", arguments.bake);
  files.write("-o", arguments.output, gzipped ? FileKind::gzippedBake : FileKind::bake);
  files.force = arguments.force;
  if (const Status status = checkOutputs(files, context); !status) return fail(status.error());
  if (const Status status = reserveBake(context, "pack", arguments.bake, kCopies); !status) return fail(status.error());

  Result<std::vector<std::byte>> file = pack(arguments);
  if (!file) return fail(file.error());
  const Result<std::vector<std::byte>> zipped = gzip(*file);
  if (!zipped) return fail(zipped.error());
  const auto& written = gzipped ? *zipped : *file;
  const Status status = writeFileAtomically(arguments.output, [&](const ByteSink& sink) { return sink(written); });
  if (!status) return fail(status.error());

  std::error_code ignored;
  const auto before = static_cast<std::uint64_t>(std::filesystem::file_size(arguments.bake, ignored));
  if (arguments.json) {
    const nlohmann::json report = {
        {"file", arguments.output}, {"bytes", written.size()}, {"gzipBytes", zipped->size()}, {"bakeBytes", before}};
    std::printf("%s\n", jsonText(report).c_str());
    return 0;
  }
  const bool isNoSmaller = written.size() >= before && !gzipped && arguments.profile != PackProfile::plain;
  std::printf("%s: %.2f MB, %.2f MB through gzip; the bake has %.2f MB%s\n", printable(arguments.output).c_str(),
              static_cast<double>(written.size()) * 1e-6, static_cast<double>(zipped->size()) * 1e-6,
              static_cast<double>(before) * 1e-6,
              isNoSmaller ? ". It is no smaller as it lies: serve it through gzip, or pack it to NAME.relume.gz" : "");
  return 0;
}

}  // namespace

void addPackCommand(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("pack", "Make a bake smaller through gzip, for hosts that download it");
  auto arguments = std::make_shared<PackArguments>();
  command->add_option("BAKE", arguments->bake, "Bake (.relume)")->option_text("FILE REQUIRED")->required();
  command
      ->add_option("-o,--output", arguments->output,
                   "Packed bake to write (.relume), which all commands and hosts read, or the same through gzip "
                   "(.relume.gz), which browsers read")
      ->option_text("FILE REQUIRED")
      ->required();
  static const std::map<std::string, PackProfile> kProfiles = {
      {"lossless", PackProfile::lossless}, {"web", PackProfile::web}, {"plain", PackProfile::plain}};
  command
      ->add_option(
          "--profile", arguments->profile,
          "lossless: the same bake, packed; web: numbers rounded to what light needs as well, and no light-map "
          "coordinates, which the exported level has; plain: what lossless packed, unpacked again [lossless|web|plain]")
      ->option_text("NAME [lossless]")
      ->transform(CLI::CheckedTransformer(kProfiles).description(""));
  command->add_flag("--keep-coordinates", arguments->simplify.keepCoordinates,
                    "--profile web: keep light-map coordinates, for hosts that read them from the bake");
  command->add_flag("--json", arguments->json, "Print JSON");
  command->add_flag("--force", arguments->force, "Write over a file that is something else than a bake, or read-only");
  addMemoryOption(*command, arguments->maxMemory);
  command->callback([arguments, &action] { action = [arguments] { return runPack(*arguments); }; });
}

}  // namespace relume
