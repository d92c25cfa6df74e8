// SPDX-License-Identifier: MIT
// The options of a bake on a command line: one flag for each row of the table of options (bake/option_table.h) that has
// one.
#pragma once

#include "relume/bake/options.h"

#include <array>
#include <map>
#include <string>

namespace CLI {
class App;
}

namespace relume {

// The presets by their names on a command line, and those names as a help text lists them: "[draft|medium|...]".
std::map<std::string, Preset> presetsByName();
std::string presetNames();

// What the command line said. Presets are the command's own affair.
struct BakeFlags {
  std::string bands;                           // sets links.bands, lumaBands and chromaBands together
  std::map<std::string, std::string> flagged;  // name of an option -> text of its flag
  bool any() const { return !bands.empty() || !flagged.empty(); }
};

// `flags` must outlive the parsing.
void addBakeFlags(CLI::App& command, BakeFlags& flags);

// The counts that a budget chooses, by their options' names.
inline constexpr std::array kBudgetCounts = {"surfels.count", "caches.gridCaches", "caches.lightmapCaches",
                                             "links.linksPerCache", "links.maxLinksPerCache"};

// Says which such count was stated, in these words, where the options have a budget; empty: none. 0 is no count: it
// switches a grid or a light map off.
std::string countBesideBudget(const BakeOptions& options, const std::map<std::string, std::string>& stated);

// What the flags start from, --bands, then the other flags. usage: text of the wrong type, a value out of range, a
// count beside a budget that chooses it.
Result<BakeOptions> chooseBakeOptions(const BakeOptions& base, const BakeFlags& flags);

}  // namespace relume
