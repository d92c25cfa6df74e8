// SPDX-License-Identifier: MIT
// The pages of a program as files, where the build installs and the tests find them.
#pragma once

#include "relume/result.h"
#include "tools/pages/command_line.h"

#include <filesystem>

namespace relume {

// Completion, manual pages and Markdown of the program: FOLDER/completion/{bash,zsh,fish}/, FOLDER/man/man1/ and
// FOLDER/reference/. io: a file cannot be written.
Status writePages(const CommandLine& line, const std::filesystem::path& folder);

}  // namespace relume
