// SPDX-License-Identifier: MIT
// See bake_flags.h.
#include "tools/cli/bake_flags.h"

#include <CLI/CLI.hpp>

namespace relume {

std::map<std::string, Preset> presetsByName() {
  std::map<std::string, Preset> presets;
  for (const PresetInfo& info : kPresets) presets[info.name] = info.preset;
  return presets;
}

std::string presetNames() {
  std::string names;
  for (const PresetInfo& info : kPresets) names += (names.empty() ? "[" : "|") + std::string(info.name);
  return names + "]";
}

void addBakeFlags(CLI::App& command, BakeFlags& flags) {
  const char* const group = "Options of the bake (default: of the preset; shown: high)";
  command.add_option("--bands", flags.bands, "Bands of SH links, luma and chroma together [1..8]")
      ->option_text("[4]")
      ->group(group);
  for (const OptionInfo& info : listOptions(presetOptions(Preset::high))) {
    if (info.flag.empty()) continue;
    const std::string unit = info.unit.empty() ? "" : " " + info.unit;
    std::string value = info.value;
    std::erase_if(value, [](char c) { return c == '"' || c == '[' || c == ']'; });
    command
        .add_option_function<std::string>(
            info.flag, [&flags, name = info.name](const std::string& text) { flags.flagged[name] = text; },
            info.comment + " [" + info.range + unit + "]")
        ->option_text("[" + value + "]")
        ->group(group);
  }
}

std::string countBesideBudget(const BakeOptions& options, const std::map<std::string, std::string>& stated) {
  if (!options.budget.any()) return "";
  for (const char* name : kBudgetCounts) {
    const auto found = stated.find(name);
    if (found == stated.end() || found->second == "0") continue;
    return std::string("option ") + name + " is " + found->second.substr(0, 40) +
           ", and a budget chooses it (--budget-mb, --budget-ms, --max-error)";
  }
  return "";
}

Result<BakeOptions> chooseBakeOptions(const BakeOptions& base, const BakeFlags& flags) {
  BakeOptions options = base;
  if (!flags.bands.empty()) {
    for (const char* name : {"links.bands", "lumaBands", "chromaBands"}) {
      if (const Status status = setOption(options, name, flags.bands); !status) return status.error();
    }
  }
  for (const auto& [name, text] : flags.flagged) {
    if (const Status status = setOption(options, name, text); !status) return status.error();
  }
  if (const Status status = checkOptions(options); !status) return status.error();
  if (const std::string count = countBesideBudget(options, flags.flagged); !count.empty())
    return Error{ErrorCode::usage, count + "; leave one out"};
  return options;
}

}  // namespace relume
