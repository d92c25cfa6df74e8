// SPDX-License-Identifier: MIT
// See option_rules.h.
#include "tools/base/option_rules.h"

#include <CLI/CLI.hpp>

namespace relume {
namespace {

void applyTo(CLI::Option& option, GivenTexts& given) {
  const int values = option.get_items_expected_max();
  if (values == 0) return;  // a flag
  if (values == 1) option.take_last();
  const std::string thing = namedThing(option);
  if (!thing.empty()) {
    option.check(CLI::Validator(
        [thing](const std::string& name) { return name.empty() ? "a " + thing + "'s name expected" : std::string(); },
        ""));
  }
  // What is added last by transform() is asked first.
  option.transform(CLI::Validator(
      [&given, &option](std::string& text) {
        given[&option].push_back(text);
        return std::string();
      },
      ""));
}

}  // namespace

std::string namedThing(const CLI::Option& option) {
  const std::string text = option.get_option_text().empty() ? option.get_type_name() : option.get_option_text();
  if (text.starts_with("FILE")) return "file";
  return text.starts_with("FOLDER") || text.starts_with("DIR") ? "folder" : "";
}

void applyOptionRules(CLI::App& app, GivenTexts& given) {
  for (CLI::Option* option : app.get_options()) applyTo(*option, given);
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) applyOptionRules(*command, given);
}

}  // namespace relume
