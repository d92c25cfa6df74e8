// SPDX-License-Identifier: MIT
// What holds for every option of every command, whoever has added it.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace relume {

// What was given to each option as it was typed, in its order; checks replace texts by what they stand for.
using GivenTexts = std::map<const CLI::Option*, std::vector<std::string>>;

// Of `app` and its subcommands, before parsing: an option that takes one value counts as it is given last, and the name
// of a file or folder is not empty, as a script's unset variable would make it. `given` is filled while parsing and
// must outlive it.
void applyOptionRules(CLI::App& app, GivenTexts& given);

// "file" or "folder" where the option's value is the name of one, as its placeholder in help says (FILE, FOLDER, DIR);
// empty otherwise.
std::string namedThing(const CLI::Option& option);

}  // namespace relume
