// SPDX-License-Identifier: MIT
// See bake_store.h.
#include "tools/cli/bake_store.h"

#include "bake/shards/stored_bake.h"
#include "relume/bake/bake.h"
#include "tools/base/number_check.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <memory>

namespace relume {
namespace {

std::string sized(std::uint64_t entries, std::uint64_t bytes, const char* what) {
  char text[96];
  std::snprintf(text, sizeof(text), "%llu %s (%.1f MiB)", static_cast<unsigned long long>(entries), what,
                static_cast<double>(bytes) / 1048576.0);
  return text;
}

std::string describe(const EntryCache& store) {
  const EntryCache::Statistics& s = store.statistics();
  char waited[32];
  std::snprintf(waited, sizeof(waited), "%.2f s", s.seconds);
  return "store " + store.name() + ": " + sized(s.found, s.foundBytes, "entries found") + ", " +
         std::to_string(s.missing) + " missing, " + std::to_string(s.damaged) + " damaged, " +
         sized(s.written, s.writtenBytes, "written") + ", " + waited + " waited";
}

}  // namespace

void addStoreOptions(CLI::App& command, StoreArguments& arguments) {
  CLI::Option* const store =
      command
          .add_option("--store", arguments.where,
                      "Folder or URL (a server that takes PUT and GET) where what is computed is kept for later bakes "
                      "and looked for; never changes the result")
          ->option_text("DIR|URL");
  takeBytes(
      command
          .add_option(
              "--store-limit", arguments.limit,
              "What a folder of --store may hold: bytes, or with a unit (512M, 8G); what was used longest ago goes "
              "first; 0 = no limit")
          ->option_text("SIZE [16G]")
          ->needs(store));
  command.add_flag("--store-stats", arguments.stats, "Print what --store had, and what was written to it")
      ->needs(store);
}

Result<Bake> bakeByStore(const Scene& scene, const BakeOptions& options, const StoreArguments& arguments,
                         Context& context, std::string& stats) {
  if (arguments.where.empty()) return bake(scene, options, context);
  Result<std::unique_ptr<Store>> store = openStore(arguments.where, [&context] { return context.cancelled(); });
  if (!store && store.error().code == ErrorCode::usage) return store.error();
  if (!store) {
    context.message(Severity::warning, "--store: done without: " + store.error().message);
    return bake(scene, options, context);
  }
  EntryCache entries(std::move(*store), arguments.limit);
  Result<Bake> baked = bakeWithStore(scene, options, entries, context);
  if (arguments.stats) stats = describe(entries);
  return baked;
}

}  // namespace relume
