// SPDX-License-Identifier: MIT
// The command line as plain data, read off the tree of CLI::App: what shell completion, manual pages and
// docs/reference are written from, so that they say what --help says.
//
// Two habits of help texts are read as well: `[draft|medium|high]` lists the values of an option, and `(.glb, .gltf)`,
// or any other mention of an extension, says what files of an option or argument end in. A value is a file where its
// type is called FILE or FOLDER; every positional argument is one.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace relume {

struct OptionText {
  std::vector<std::string> names;  // "-o", "--output"; of a positional argument its one name
  std::string value;               // as --help has it: "FILE REQUIRED", "NAME [high]"; empty for a flag
  std::string help;
  std::string group;                    // heading of --help
  std::vector<std::string> choices;     // values, where there is a list of them
  std::vector<std::string> extensions;  // ".glb", ".gltf"
  bool positional = false, required = false;
  bool takesValue = false;
  bool takesFile = false;
  bool takesList = false;  // values separated by commas
};

struct CommandText {
  std::string name;    // "bake"; of the program itself "relume", "relume-view"
  std::string called;  // as it is typed: "relume bake"
  std::string help;
  bool commands = false;            // it is the program, and a command follows
  std::vector<OptionText> options;  // in the order of --help

  // "relume bake [OPTIONS] SCENE -o FILE"
  std::string synopsis() const;
};

struct CommandLine {
  CommandText program;
  std::vector<CommandText> commands;  // hidden ones left out
  std::string footer;
};

// `app` is the program, with all its commands.
CommandLine describeCommandLine(const CLI::App& app);

// The first clause of a help text, for lists where a line is short.
std::string firstClause(const std::string& help);

}  // namespace relume
