// SPDX-License-Identifier: MIT
// See completion.h. Each script is a table of the commands with a few lines of the shell's own around it.
#include "tools/pages/completion.h"

#include <algorithm>

namespace relume {
namespace {

std::string join(const std::vector<std::string>& words, const std::string& by) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : by) + word;
  return text;
}

// A word that no shell of the three looks into.
std::string shellQuoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'')
      result += "'\\''";
    else
      result += c;
  }
  return result + "'";
}

std::string escaped(const std::string& text, const std::string& characters) {
  std::string result;
  for (const char c : text) {
    if (characters.find(c) != std::string::npos) result += '\\';
    result += c;
  }
  return result;
}

std::vector<std::string> namesOf(const std::vector<CommandText>& commands) {
  std::vector<std::string> names;
  for (const CommandText& command : commands) names.push_back(command.name);
  return names;
}

// "relume_view": the program as a part of a shell function's name.
std::string functionOf(const CommandLine& line) {
  std::string name = line.program.name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

// "# Completion of relume for bash. Written by the program itself."
std::string headOf(const CommandLine& line, const std::string& shell) {
  return "# Completion of " + line.program.name + " for " + shell + ". Written by the program itself.\n";
}

// ---- bash

// What completes the value of an option: a call of one of the functions below, or nothing to say.
std::string bashValue(const OptionText& option) {
  if (!option.choices.empty())
    return std::string(option.takesList ? "_relume_list " : "_relume_words ") + shellQuoted(join(option.choices, " "));
  if (option.takesFile)
    return option.extensions.empty() ? "_relume_files" : "_relume_files " + join(option.extensions, " ");
  return ":";
}

// The cases of one command: values of its options, its flags, its files. `name` is "" for the program itself.
std::string bashCases(const CommandText& command, const std::string& name, const std::string& words) {
  std::string values, flags, files = words;
  for (const OptionText& option : command.options) {
    if (option.positional) {
      if (files.empty()) files = bashValue(option);
      continue;
    }
    flags += (flags.empty() ? "" : " ") + join(option.names, " ");
    if (!option.takesValue) continue;
    std::string patterns;
    for (const std::string& one : option.names)
      patterns += (patterns.empty() ? "" : "|") + shellQuoted(name + " " + one);
    values += "    " + patterns + ") " + bashValue(option) + "; return ;;\n";
  }
  return values + "    " + shellQuoted(name + " ") + "*)\n      if [[ $cur == -* ]]; then _relume_words " +
         shellQuoted(flags) + "; else " + (files.empty() ? ":" : files) + "; fi ;;\n";
}

constexpr const char* kBashHelpers = R"(
_relume_words() {
  local word
  while IFS= read -r word; do COMPREPLY+=("$word"); done < <(compgen -W "$1" -- "$cur")
}

# Values separated by commas: the last one is completed.
_relume_list() {
  local last=${cur##*,} word
  compopt -o nospace 2>/dev/null
  while IFS= read -r word; do COMPREPLY+=("${cur%"$last"}$word"); done < <(compgen -W "$1" -- "$last")
}

# Folders, and files with one of these extensions; all files where no extension is given.
_relume_files() {
  local file extension
  compopt -o filenames 2>/dev/null
  while IFS= read -r file; do
    if [[ $# -eq 0 || -d $file ]]; then COMPREPLY+=("$file"); continue; fi
    for extension in "$@"; do
      if [[ $file == *"$extension" ]]; then COMPREPLY+=("$file"); break; fi
    done
  done < <(compgen -f -- "$cur")
}

)";

constexpr const char* kBashWords = R"(() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} command= i
  COMPREPLY=()
  # Bash splits --flag=value into three words.
  if [[ $cur == "=" ]]; then cur=; elif [[ $prev == "=" ]]; then prev=${COMP_WORDS[COMP_CWORD-2]}; fi
)";

constexpr const char* kBashCommand = R"(  for ((i = 1; i < COMP_CWORD; ++i)); do
    if [[ ${COMP_WORDS[i]} != -* ]]; then command=${COMP_WORDS[i]}; break; fi
  done
)";

// ---- zsh

std::string zshValue(const OptionText& option) {
  if (!option.choices.empty() && option.takesList) return "_sequence compadd - " + join(option.choices, " ");
  if (!option.choices.empty()) return "(" + join(option.choices, " ") + ")";
  if (option.takesFile && !option.extensions.empty()) return "_files -g \"*(" + join(option.extensions, "|") + ")\"";
  return option.takesFile ? "_files" : " ";
}

// One argument of _arguments for each spelling: the spellings exclude each other.
std::string zshSpecs(const CommandText& command) {
  std::string specs;
  int position = 0;
  for (const OptionText& option : command.options) {
    const std::string help = escaped(firstClause(option.help), "[]:\\");
    if (option.positional) {
      specs += " \\\n        " + shellQuoted(std::to_string(++position) + ":" + help + ":" + zshValue(option));
      continue;
    }
    const std::string others = option.names.size() > 1 ? "(" + join(option.names, " ") + ")" : "";
    for (const std::string& name : option.names) {
      const std::string value = option.takesValue ? ":value:" + zshValue(option) : "";
      const bool longName = name.starts_with("--");
      specs += " \\\n        " +
               shellQuoted(others + name + (option.takesValue && longName ? "=" : "") + "[" + help + "]" + value);
    }
  }
  return specs;
}

// ---- fish

// The names of an option as fish has them, and what completes its value.
std::string fishOption(const OptionText& option) {
  std::string text;
  for (const std::string& name : option.names)
    text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
  if (!option.takesValue) return text;
  if (!option.choices.empty()) return text + " -x -a " + shellQuoted(join(option.choices, " "));
  if (!option.takesFile) return text + " -x";
  std::string suffixes;
  for (const std::string& extension : option.extensions)
    suffixes += (suffixes.empty() ? "" : "; ") + ("__fish_complete_suffix " + extension);
  return text + " -r" + (suffixes.empty() ? " -F" : " -k -a " + shellQuoted("(" + suffixes + ")"));
}

std::string fishCommand(const std::string& program, const CommandText& command, const std::string& condition) {
  std::string text;
  for (const OptionText& option : command.options) {
    text += "complete -c " + program + (condition.empty() ? "" : " -n " + shellQuoted(condition));
    if (option.positional) {
      OptionText unnamed = option;
      unnamed.names.clear();
      text += fishOption(unnamed) + "\n";
    } else {
      text += fishOption(option) + " -d " + shellQuoted(firstClause(option.help)) + "\n";
    }
  }
  return text;
}

}  // namespace

std::string bashCompletion(const CommandLine& line) {
  const std::string function = "_" + functionOf(line);
  std::string cases;
  for (const CommandText& command : line.commands) cases += bashCases(command, command.name, "");
  cases += bashCases(line.program, "",
                     line.commands.empty() ? "" : "_relume_words " + shellQuoted(join(namesOf(line.commands), " ")));
  return headOf(line, "bash") + kBashHelpers + function + kBashWords + (line.commands.empty() ? "" : kBashCommand) +
         "  case \"$command $prev\" in\n" + cases + "  esac\n}\n\ncomplete -F " + function + " " + line.program.name +
         "\n";
}

std::string zshCompletion(const CommandLine& line) {
  const std::string program = line.program.name, function = "_" + program;
  const std::string begin = "#compdef " + program + "\n" + headOf(line, "zsh") + "\n" + function + "() {\n";
  const std::string end =
      "}\n\n# Loaded by compinit the file is the function's body; sourced, it registers itself.\n"
      "if [[ $funcstack[1] == " +
      function + " ]]; then " + function + " \"$@\"; else compdef " + function + " " + program + "; fi\n";
  if (line.commands.empty()) return begin + "  _arguments" + zshSpecs(line.program) + "\n" + end;
  std::string commands, cases;
  for (const CommandText& command : line.commands) {
    commands += "        " + shellQuoted(command.name + ":" + escaped(firstClause(command.help), ":\\")) + "\n";
    cases += "      (" + command.name + ") _arguments" + zshSpecs(command) + " ;;\n";
  }
  return begin +
         "  local curcontext=\"$curcontext\" state line\n  local -a commands\n"
         "  _arguments -C" +
         zshSpecs(line.program) +
         " \\\n        '1:command:->command' '*::argument:->argument'\n"
         "  case $state in\n    (command)\n      commands=(\n" +
         commands + "      )\n      _describe command commands ;;\n    (argument)\n      case $words[1] in\n" + cases +
         "      esac ;;\n  esac\n" + end;
}

std::string fishCompletion(const CommandLine& line) {
  const std::string& program = line.program.name;
  if (line.commands.empty()) return headOf(line, "fish") + fishCommand(program, line.program, "");
  const std::string first = "__fish_use_subcommand";
  std::string text = headOf(line, "fish") + "complete -c " + program + " -n " + first + " -f\n" +
                     fishCommand(program, line.program, first);
  for (const CommandText& command : line.commands) {
    text += "complete -c " + program + " -n " + first + " -a " + command.name + " -d " +
            shellQuoted(firstClause(command.help)) + "\n";
  }
  for (const CommandText& command : line.commands)
    text += fishCommand(program, command, "__fish_seen_subcommand_from " + command.name);
  return text;
}

}  // namespace relume
