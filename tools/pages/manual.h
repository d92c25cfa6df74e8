// SPDX-License-Identifier: MIT
// Manual pages (roff) and docs/reference (Markdown), written from the command line and the bake's table of options.
#pragma once

#include "tools/pages/command_line.h"

#include <string>

namespace relume {

// relume(1), or the page of a program without commands.
std::string programManual(const CommandLine& line);

// relume-NAME(1) of one command.
std::string commandManual(const CommandLine& line, const CommandText& command);

// docs/reference/commands.md: every command with its options.
std::string commandsMarkdown(const CommandLine& line);

// docs/reference/relume-view.md: a program without commands.
std::string programMarkdown(const CommandLine& line);

// docs/reference/options.md: every option of a bake, with what each preset has.
std::string optionsMarkdown();

}  // namespace relume
