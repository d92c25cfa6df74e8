// SPDX-License-Identifier: MIT
// Completion of a program's command line for shells, as text of a script. The program may have no commands.
#pragma once

#include "tools/pages/command_line.h"

#include <string>

namespace relume {

// For `source`, or a file of the program's name in bash-completion's folder of completions. Needs no package.
std::string bashCompletion(const CommandLine& line);

// For a file of its name after a `_` in a folder of zsh's fpath.
std::string zshCompletion(const CommandLine& line);

// For a file NAME.fish in a folder of completions.
std::string fishCompletion(const CommandLine& line);

}  // namespace relume
