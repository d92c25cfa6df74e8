// SPDX-License-Identifier: MIT
// Completion of the command line for shells, as text of a script.
#pragma once

#include "tools/pages/command_line.h"

#include <string>

namespace relume {

// For `source`, or a file `relume` in bash-completion's folder of completions. Needs no package.
std::string bashCompletion(const CommandLine& line);

// For a file `_relume` in a folder of zsh's fpath.
std::string zshCompletion(const CommandLine& line);

// For a file `relume.fish` in a folder of completions.
std::string fishCompletion(const CommandLine& line);

}  // namespace relume
