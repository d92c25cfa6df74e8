// SPDX-License-Identifier: MIT
// The store of relume bake --store: opened, used, and told about.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"

#include <cstdint>
#include <string>

namespace CLI {
class App;
}

namespace relume {

inline constexpr std::uint64_t kDefaultStoreLimit = 16ull << 30;

struct StoreArguments {
  std::string where;                         // folder or URL; empty = none
  std::uint64_t limit = kDefaultStoreLimit;  // [byte]
  bool stats = false;
};
void addStoreOptions(CLI::App& command, StoreArguments& arguments);

// As bake(), by way of the store where there is one. A store that cannot be opened is a warning. usage: a URL that is
// none. stats: becomes what was found and made, where it was asked for.
Result<Bake> bakeByStore(const Scene& scene, const BakeOptions& options, const StoreArguments& arguments,
                         Context& context, std::string& stats);

}  // namespace relume
