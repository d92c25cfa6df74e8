// SPDX-License-Identifier: MIT
// See usage_message.h.
#include "tools/base/usage_message.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <limits>
#include <system_error>

namespace relume {
namespace {

// Edits between two words; neighbours that changed places count once (optimal string alignment).
std::size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before = last;
    last = row;
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

// The command that was chosen, or the program itself.
const CLI::App& chosen(const CLI::App& app) {
  const std::vector<CLI::App*> commands = app.get_subcommands();
  return commands.empty() ? app : *commands.front();
}

std::string fullName(const CLI::App& app, const CLI::App& command) {
  return &command == &app ? app.get_name() : app.get_name() + " " + command.get_name();
}

std::string helpOf(const CLI::App& app, const CLI::App& command) {
  return " (see " + fullName(app, command) + " --help)";
}

// Every way to write an option: "--output", "-o"; of a positional argument its name.
std::vector<std::string> spellings(const CLI::Option& option) {
  std::vector<std::string> list;
  for (const std::string& name : option.get_lnames()) list.push_back("--" + name);
  for (const std::string& name : option.get_snames()) list.push_back("-" + name);
  if (list.empty()) list.push_back(option.get_name(true));
  return list;
}

std::string meant(const std::string& closest) { return closest.empty() ? "" : "; did you mean \"" + closest + "\"?"; }

std::string unknownWord(const CLI::App& app, const CLI::App& command) {
  const std::vector<std::string> words = app.remaining(true);
  const std::string word = words.empty() ? "" : words.front();
  std::vector<std::string> known;
  if (word.starts_with('-') && word.size() > 1) {
    for (const CLI::Option* option : command.get_options()) {
      for (const std::string& spelling : spellings(*option)) {
        if (spelling.starts_with('-')) known.push_back(spelling);
      }
    }
    const std::string flag = word.substr(0, word.find('='));
    return fullName(app, command) + ": unknown option \"" + flag + "\"" + meant(closestWord(flag, known));
  }
  if (&command != &app) return fullName(app, command) + ": argument \"" + word + "\" is one too many";
  for (const CLI::App* one : app.get_subcommands([](const CLI::App*) { return true; }))
    known.push_back(one->get_name());
  if (known.empty()) return app.get_name() + ": argument \"" + word + "\" is one too many";
  return "unknown command \"" + word + "\"" + meant(closestWord(word, known));
}

// How the command is called at the least: "relume bake SCENE -o FILE".
std::string shortestCall(const CLI::App& app, const CLI::App& command) {
  std::string call = fullName(app, command);
  for (const bool positional : {true, false}) {
    for (const CLI::Option* option : command.get_options()) {
      if (!option->get_required() || option->get_positional() != positional) continue;
      call += " " + spellings(*option).back() + (positional ? "" : " FILE");
    }
  }
  return call;
}

std::string missing(const CLI::App& app, const CLI::App& command, const std::string& what) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_required() && what == option->get_name() + " is required")
      return spellings(*option).back() + " is missing; expected: " + shortestCall(app, command);
  }
  return what;
}

// The option that a message is about: the longest of whose spellings stands in it as a word.
const CLI::Option* optionIn(const std::string& what, const CLI::App& command) {
  const CLI::Option* found = nullptr;
  std::size_t longest = 0;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : spellings(*option)) {
      const std::size_t at = what.find(name);
      if (at == std::string::npos || name.size() <= longest) continue;
      const char next = at + name.size() < what.size() ? what[at + name.size()] : ' ';
      if (std::isalnum(static_cast<unsigned char>(next)) || next == '-') continue;
      found = option;
      longest = name.size();
    }
  }
  return found;
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

// The values that are allowed, as help has them: " of 1..16", " of cpu, gl"; empty when all of the type are.
std::string allowedValues(const CLI::Option& option) {
  const std::string help = option.get_description(), type = option.get_type_name();
  const std::size_t open = help.rfind('[');
  if (open != std::string::npos && help.ends_with(']')) {
    const std::string range = help.substr(open + 1, help.size() - open - 2);
    if (range.find("..") != std::string::npos) return " of " + range;
    if (range.find('|') != std::string::npos) return " of " + replaced(range, "|", ", ");
  }
  if (const std::size_t list = type.find(":{"); list != std::string::npos && type.ends_with('}'))
    return " of " + replaced(type.substr(list + 2, type.size() - list - 3), ",", ", ");
  const std::size_t begin = type.find(" in ["), dash = type.rfind(" - ");
  if (begin != std::string::npos && dash != std::string::npos && type.ends_with(']'))
    return " of " + type.substr(begin + 5, dash - begin - 5) + ".." + type.substr(dash + 3, type.size() - dash - 4);
  const std::size_t least = type.find(">= ");
  return least != std::string::npos ? " of " + type.substr(least) : "";
}

// "a whole number of 1..16", "three numbers separated by commas".
std::string expectedValue(const CLI::Option& option) {
  const std::string type = option.get_type_name(), allowed = allowedValues(option);
  const bool real = type.starts_with("FLOAT"), whole = type.starts_with("INT") || type.starts_with("UINT");
  const std::string one = whole ? "whole number" : real ? "number" : "value";
  const int count = option.get_items_expected_max();
  if (count == 1) return "a " + one + allowed;
  const char* const names[] = {"", "", "two ", "three ", "four "};
  const std::string many = count < 5 ? names[count] : count < (1 << 20) ? std::to_string(count) + " " : "";
  return many + one + "s" + allowed + " separated by commas";
}

// The words of a value that is wrong, as they were typed. Of an option with one value, checking stops at the wrong one.
std::vector<std::string> wrongTexts(const CLI::Option& option, const GivenTexts& given) {
  const auto texts = given.find(&option);
  if (texts == given.end()) return option.results();
  return option.get_items_expected_max() == 1 ? std::vector{texts->second.back()} : texts->second;
}

// Whether a text is written as numbers are, or as a size (8G), and says one that no variable holds: 1e999, 1e-400,
// 99999999999G.
bool isBeyondNumbers(std::string_view text) {
  double real = 0.0;
  const char* const end = text.data() + text.size();
  const auto asReal = std::from_chars(text.data(), end, real);
  if (asReal.ec == std::errc::result_out_of_range) return asReal.ptr == end;
  std::uint64_t whole = 0;
  const auto asWhole = std::from_chars(text.data(), end, whole);
  if (asWhole.ec == std::errc::invalid_argument) return false;
  // Bytes with a unit, as CLI11 takes them: K, KB and KiB are 2^10, M 2^20, ..., E 2^60.
  const std::string_view unit(asWhole.ptr, static_cast<std::size_t>(end - asWhole.ptr));
  std::size_t power = 0;
  if (!unit.empty()) {
    power = std::string_view("KMGTPE").find(static_cast<char>(std::toupper(static_cast<unsigned char>(unit[0])))) + 1;
    if (power == 0 || unit.find_first_not_of("bBiI", 1) != std::string_view::npos) return false;
  }
  return asWhole.ec != std::errc() || whole > std::numeric_limits<std::uint64_t>::max() >> (10 * power);
}

std::string wrongValue(const CLI::Option& option, const GivenTexts& given) {
  const std::string name = spellings(option).front();
  if (option.get_items_expected_max() == 0) return name + " takes no value";
  const std::vector<std::string> texts = wrongTexts(option, given);
  if (const std::string thing = namedThing(option); !thing.empty() && !texts.empty() && texts.back().empty())
    return spellings(option).back() + ": a " + thing + "'s name expected, \"\" found";
  std::string found;
  for (const std::string& text : texts) found += (found.empty() ? "" : ",") + text;
  return name + ": " + expectedValue(option) + " expected, " + (found.empty() ? "none" : "\"" + found + "\"") +
         " found" + (std::ranges::any_of(texts, isBeyondNumbers) ? ", a number out of range" : "");
}

}  // namespace

std::string closestWord(std::string_view word, const std::vector<std::string>& known) {
  const std::size_t letters = word.size() - std::min(word.find_first_not_of('-'), word.size());
  std::string closest;
  std::size_t min = std::max<std::size_t>(1, letters / 3) + 1;
  for (const std::string& candidate : known) {
    const bool begins = letters >= 3 && candidate.starts_with(word);
    const std::size_t distance = begins ? 1 : editDistance(word, candidate);
    if (distance >= min || distance >= letters) continue;  // not where all letters would have to change
    min = distance;
    closest = candidate;
  }
  return closest;
}

std::string usageMessage(const CLI::App& app, const CLI::ParseError& error, const GivenTexts& given) {
  const CLI::App& command = chosen(app);
  const std::string what = error.what(), help = helpOf(app, command);
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) return unknownWord(app, command) + help;
  if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) return missing(app, command, what) + help;
  if (dynamic_cast<const CLI::RequiresError*>(&error) != nullptr) return replaced(what, " requires ", " needs ") + help;
  const CLI::Option* option = optionIn(what, command);
  return (option != nullptr ? wrongValue(*option, given) : what) + help;
}

}  // namespace relume
