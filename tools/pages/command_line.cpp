// SPDX-License-Identifier: MIT
// See command_line.h.
#include "tools/pages/command_line.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>
#include <sstream>

namespace relume {
namespace {

bool isWord(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

std::vector<std::string> split(const std::string& text, char by) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, by);) parts.push_back(part);
  return parts;
}

// What stands between the last pair of these brackets, "" where there is none.
std::string lastBracketed(const std::string& text, char open, char close) {
  const std::size_t end = text.rfind(close), begin = text.rfind(open, end);
  if (end == std::string::npos || begin == std::string::npos) return "";
  return text.substr(begin + 1, end - begin - 1);
}

// "[a|b|c]" of the help, or "{a,b,c}" of CLI::IsMember.
std::vector<std::string> choicesOf(const CLI::Option& option) {
  const std::string listed = lastBracketed(option.get_description(), '[', ']');
  std::vector<std::string> choices = split(listed, '|');
  if (choices.size() < 2) choices = split(lastBracketed(option.get_type_name(), '{', '}'), ',');
  std::erase(choices, "");
  return choices;
}

// Every word that a dot begins: "Level, glTF 2.0 (.glb, .gltf)" has two.
std::vector<std::string> extensionsOf(const std::string& help) {
  std::vector<std::string> extensions;
  for (std::size_t at = 0; at + 1 < help.size(); ++at) {
    if (help[at] != '.' || !isWord(help[at + 1]) || (at > 0 && help[at - 1] != ' ' && help[at - 1] != '(')) continue;
    std::size_t end = at + 1;
    while (end < help.size() && isWord(help[end])) ++end;
    const std::string extension = help.substr(at, end - at);
    if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end()) extensions.push_back(extension);
  }
  return extensions;
}

// As CLI::Formatter has it, without what is required by other options: no command of ours has that.
std::string valueOf(const CLI::Option& option) {
  if (!option.get_option_text().empty()) return option.get_option_text();
  if (option.get_type_size() == 0) return "";
  std::string text = option.get_type_name();
  if (!option.get_default_str().empty()) text += "=" + option.get_default_str();
  return text + (option.get_required() ? " REQUIRED" : "");
}

OptionText describe(const CLI::Option& option) {
  OptionText text;
  text.positional = option.get_positional();
  text.required = option.get_required();
  for (const std::string& name : option.get_snames()) text.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) text.names.push_back("--" + name);
  if (text.positional) text.names = {option.get_name(true)};
  text.help = option.get_description();
  text.group = option.get_group();
  text.takesValue = option.get_items_expected_max() > 0;
  text.takesList = option.get_delimiter() != '\0';
  if (!text.takesValue) return text;
  text.value = valueOf(option);
  text.choices = choicesOf(option);
  text.takesFile = text.positional || text.value.starts_with("FILE") || text.value.starts_with("FOLDER");
  if (text.takesFile) text.extensions = extensionsOf(text.help);
  return text;
}

CommandText describe(const CLI::App& app) {
  CommandText text;
  text.name = text.called = app.get_name();
  text.help = app.get_description();
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_group().empty()) text.options.push_back(describe(*option));
  }
  return text;
}

}  // namespace

std::string CommandText::synopsis() const {
  std::string text = called + " [OPTIONS]" + (commands ? " COMMAND" : "");
  for (const OptionText& option : options) {
    if (option.positional) text += " " + (option.required ? option.names[0] : "[" + option.names[0] + "]");
  }
  for (const OptionText& option : options) {
    if (option.required && !option.positional) text += " " + option.names[0] + " FILE";
  }
  return text;
}

CommandLine describeCommandLine(const CLI::App& app) {
  CommandLine line{describe(app), {}, app.get_footer()};
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (command->get_group().empty()) continue;
    line.commands.push_back(describe(*command));
    line.commands.back().called = line.program.name + " " + command->get_name();
  }
  line.program.commands = !line.commands.empty();
  return line;
}

std::string firstClause(const std::string& help) {
  constexpr std::size_t kMax = 72;
  std::size_t end = help.size();
  for (const char* stop : {"; ", ": ", " (", " ["}) end = std::min(end, help.find(stop));
  if (end <= kMax) return help.substr(0, end);
  return help.substr(0, help.rfind(' ', kMax)) + " ...";
}

}  // namespace relume
