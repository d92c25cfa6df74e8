// SPDX-License-Identifier: MIT
// See manual.h.
#include "tools/pages/manual.h"

#include "relume/bake/options.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdio>

namespace relume {
namespace {

constexpr const char* kGenerated = "Written by the program from its own command line; do not edit.";

std::string namesOf(const OptionText& option) {
  std::string text;
  for (const std::string& name : option.names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::vector<std::string> groupsOf(const CommandText& command) {
  std::vector<std::string> groups;
  for (const OptionText& option : command.options) {
    if (!option.positional && std::find(groups.begin(), groups.end(), option.group) == groups.end())
      groups.push_back(option.group);
  }
  return groups;
}

// ---- roff

// The code point that begins at `at`, which is moved behind it. Help texts are valid UTF-8.
std::uint32_t takeCodePoint(const std::string& text, std::size_t& at) {
  const auto byte = [&] { return static_cast<unsigned char>(text[at]); };
  std::uint32_t code = byte();
  const int more = code >= 0xF0 ? 3 : code >= 0xE0 ? 2 : code >= 0xC0 ? 1 : 0;
  if (more > 0) code &= 0x3Fu >> more;
  ++at;
  for (int i = 0; i < more && at < text.size(); ++i, ++at) code = code << 6 | (byte() & 0x3Fu);
  return code;
}

// Text in which roff sees no request and no escape; hyphens stay hyphens, so that options can be copied.
std::string roff(const std::string& text) {
  std::string result;
  if (!text.empty() && (text[0] == '.' || text[0] == '\'')) result += "\\&";
  for (std::size_t at = 0; at < text.size();) {
    const std::uint32_t code = takeCodePoint(text, at);
    if (code == '\\')
      result += "\\e";
    else if (code == '-')
      result += "\\-";
    else if (code == '\'')
      result += "\\(aq";
    else if (code == '`')
      result += "\\(ga";
    else if (code == '^')
      result += "\\(ha";
    else if (code == '~')
      result += "\\(ti";
    else if (code < 128)
      result += static_cast<char>(code);
    else {
      char escape[16];
      std::snprintf(escape, sizeof(escape), "\\[u%04X]", code);
      result += escape;
    }
  }
  return result;
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

std::string manualHead(const std::string& name, const std::string& help, const std::string& synopsis) {
  return ".\\\" " + std::string(kGenerated) + "\n.TH " + upper(roff(name)) +
         " 1 \"\" \"relume " RELUME_VERSION "\" \"Relume\"\n.SH NAME\n" + roff(name) + " \\- " + roff(help) +
         "\n.SH SYNOPSIS\n" + roff(synopsis) + "\n";
}

std::string paragraph(const OptionText& option) {
  return ".TP\n\\fB" + roff(namesOf(option)) + "\\fR" + (option.value.empty() ? "" : " " + roff(option.value)) + "\n" +
         roff(option.help) + "\n";
}

std::string optionSections(const CommandText& command) {
  std::string arguments, text;
  for (const OptionText& option : command.options) {
    if (option.positional) arguments += paragraph(option);
  }
  if (!arguments.empty()) text += ".SH ARGUMENTS\n" + arguments;
  text += ".SH OPTIONS\n";
  for (const std::string& group : groupsOf(command)) {
    if (group != "Options") text += ".SS " + roff(group) + "\n";
    for (const OptionText& option : command.options) {
      if (!option.positional && option.group == group) text += paragraph(option);
    }
  }
  return text;
}

// What a file of --options may say: all options, those without a flag too.
std::string optionsFileSection() {
  std::string text =
      ".SH OPTIONS FILE\nA file of \\fB\\-\\-options\\fR is JSON, in which comments are allowed: "
      "{\"surfels\": {\"count\": 20000}, \"seed\": 2}. What it does not name is as in the preset. "
      "\\fB\\-\\-print\\-options\\fR writes one.\n";
  for (const OptionInfo& option : listOptions(presetOptions(Preset::high))) {
    const std::string unit = option.unit.empty() ? "" : " " + option.unit;
    text += ".TP\n\\fB" + roff(option.name) + "\\fR" + (option.flag.empty() ? "" : " (" + roff(option.flag) + ")") +
            "\n" + roff(option.comment + " [" + option.range + unit + "]; high: " + option.value) + "\n";
  }
  return text;
}

std::string exitSection(const CommandLine& line) {
  constexpr std::string_view kTitle = "Exit status: ";
  const std::size_t begin = line.footer.starts_with(kTitle) ? kTitle.size() : 0;
  return ".SH EXIT STATUS\n" + roff(line.footer.substr(begin)) + "\n";
}

// ---- Markdown

// In a cell of a table.
std::string cell(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '|' || c == '<' || c == '*') result += '\\';
    result += c;
  }
  return result;
}

// A bar ends a cell even in code.
std::string code(const std::string& text) {
  if (text.empty()) return "";
  std::string result = "`";
  for (const char c : text) {
    if (c == '|') result += '\\';
    result += c;
  }
  return result + "`";
}

std::string optionTable(const CommandText& command, const std::string& group, bool positional) {
  std::string rows;
  for (const OptionText& option : command.options) {
    if (option.positional != positional || (!positional && option.group != group)) continue;
    rows += "| " + code(namesOf(option)) + " | " + code(option.value) + " | " + cell(option.help) + " |\n";
  }
  if (rows.empty()) return "";
  const bool titled = !positional && group != "Options";
  return (titled ? "\n" + group + "\n" : "") + "\n| " + (positional ? "argument" : "option") +
         " | value | meaning |\n|---|---|---|\n" + rows;
}

std::string commandMarkdown(const CommandText& command, const std::string& title) {
  std::string text = "\n## " + title + "\n\n" + command.help + ".\n\n```\n" + command.synopsis() + "\n```\n";
  text += optionTable(command, "", true);
  for (const std::string& group : groupsOf(command)) text += optionTable(command, group, false);
  return text;
}

}  // namespace

std::string programManual(const CommandLine& line) {
  if (line.commands.empty())
    return manualHead(line.program.name, line.program.help, line.program.synopsis()) + optionSections(line.program) +
           exitSection(line) + ".SH SEE ALSO\n.BR relume (1)\n";
  std::string text = manualHead("relume", "light-transport baker", line.program.synopsis());
  text += ".SH DESCRIPTION\n" + roff(line.program.help) + "\n.SH COMMANDS\n";
  for (const CommandText& command : line.commands)
    text += ".TP\n\\fB" + roff(command.name) + "\\fR\n" + roff(command.help) + ", see relume\\-" + roff(command.name) +
            "(1)\n";
  text += optionSections(line.program) + exitSection(line) + ".SH SEE ALSO\n";
  for (std::size_t i = 0; i < line.commands.size(); ++i)
    text += ".BR relume\\-" + roff(line.commands[i].name) + " (1)" + (i + 1 < line.commands.size() ? "," : "") + "\n";
  return text;
}

std::string commandManual(const CommandLine& line, const CommandText& command) {
  std::string text = manualHead("relume-" + command.name, command.help, command.synopsis());
  text += optionSections(command);
  if (command.name == "bake") text += optionsFileSection();
  return text + exitSection(line) + ".SH SEE ALSO\n.BR relume (1)\n";
}

std::string commandsMarkdown(const CommandLine& line) {
  std::string text = std::string("<!-- ") + kGenerated + " -->\n# Commands\n\n" + line.program.help + "\n\n" +
                     line.footer + "\n\n| command | job |\n|---|---|\n";
  for (const CommandText& command : line.commands)
    text += "| [" + code(command.name) + "](#relume-" + command.name + ") | " + cell(command.help) + " |\n";
  for (const CommandText& command : line.commands) text += commandMarkdown(command, "relume " + command.name);
  return text;
}

std::string programMarkdown(const CommandLine& line) {
  return std::string("<!-- ") + kGenerated + " -->\n" + commandMarkdown(line.program, line.program.name).substr(2) +
         "\n" + line.footer + "\n";
}

std::string optionsMarkdown() {
  std::string text =
      std::string("<!-- ") + kGenerated +
      " -->\n# Options of a bake\n\n"
      "Set by a file of `--options` under their names, or by flags of `relume bake`; what neither names is as in the\n"
      "preset. The library's `BakeOptions` (`relume/bake/options.h`) has the same names.\n";
  std::vector<std::vector<OptionInfo>> lists;
  std::string head = "\n\n| option | flag |", rule = " |\n|---|---|";
  for (const PresetInfo& info : kPresets) {
    lists.push_back(listOptions(presetOptions(info.preset)));
    head += std::string(" ") + info.name + " |";
    rule += "---|";
  }
  head += " values | meaning" + rule + "---|---|\n";
  std::string group = "-";
  for (std::size_t i = 0; i < lists[0].size(); ++i) {
    const OptionInfo& option = lists[0][i];
    const std::size_t dot = option.name.find('.');
    const std::string itsGroup = dot == std::string::npos ? "" : option.name.substr(0, dot);
    if (itsGroup != group) {
      text += "\n## " + (itsGroup.empty() ? "Of all stages" : "`" + itsGroup + "`") + head;
      group = itsGroup;
    }
    text += "| " + code(option.name) + " | " + code(option.flag);
    for (const std::vector<OptionInfo>& list : lists) {
      std::string value = list[i].value;
      std::erase(value, '"');
      text += " | " + cell(value);
    }
    text += " | " + cell(option.range + (option.unit.empty() ? "" : " " + option.unit)) + " | " + cell(option.comment) +
            " |\n";
  }
  return text;
}

}  // namespace relume
