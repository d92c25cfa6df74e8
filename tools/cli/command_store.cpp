// SPDX-License-Identifier: MIT
// relume store gc DIR --limit SIZE: holds the folder of a store to a size.
#include "bake/store/store.h"
#include "tools/base/number_check.h"
#include "tools/base/printable.h"
#include "tools/cli/bake_store.h"
#include "tools/cli/commands.h"

#include <CLI/CLI.hpp>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

namespace relume {
namespace {

struct GarbageArguments {
  std::string action, folder;
  std::uint64_t limit = kDefaultStoreLimit;
};

int runStore(const GarbageArguments& arguments) {
  if (isUrl(arguments.folder))
    return fail({ErrorCode::usage,
                 "relume store gc: a folder expected, a URL found; run it on the server, on the folder that "
                 "it keeps files in"});
  const Result<GarbageReport> report = collectGarbage(arguments.folder, arguments.limit);
  if (!report) return fail(report.error());
  const auto mib = [](std::uint64_t bytes) { return static_cast<double>(bytes) / 1048576.0; };
  const auto count = [](std::uint64_t entries) { return static_cast<unsigned long long>(entries); };
  std::printf("%s: %llu entries (%.1f MiB), %llu removed (%.1f MiB)", printable(arguments.folder).c_str(),
              count(report->entries), mib(report->bytes), count(report->removedEntries), mib(report->removedBytes));
  if (report->temporaries > 0) std::printf(", %llu half-written files removed", count(report->temporaries));
  if (report->keptEntries > 0) std::printf(", %llu may not be removed", count(report->keptEntries));
  std::printf("\n");
  const Status held = checkHeld(*report, arguments.folder, arguments.limit);
  return held ? 0 : fail(held.error());
}

}  // namespace

void addStoreCommand(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("store", "Look after a folder that bakes keep entries in (relume bake --store)");
  auto arguments = std::make_shared<GarbageArguments>();
  command->add_option("ACTION", arguments->action, "gc: remove what was used longest ago until the limit is held")
      ->option_text("gc REQUIRED")
      ->required()
      ->check(CLI::IsMember({"gc"}));
  command->add_option("DIR", arguments->folder, "Folder of the store")->option_text("DIR REQUIRED")->required();
  takeBytes(command
                ->add_option("--limit", arguments->limit,
                             "What the folder may hold: bytes, or with a unit (512M, 8G); 0 removes all")
                ->option_text("SIZE [16G]"));
  command->callback([arguments, &action] { action = [arguments] { return runStore(*arguments); }; });
}

}  // namespace relume
