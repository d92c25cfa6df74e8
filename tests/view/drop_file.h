// SPDX-License-Identifier: MIT
// Drops a file on a window, as a file manager does: version 5 of the XDND protocol.
#pragma once

#include <filesystem>
#include <string>

namespace relume {

// On the window that takes drops at the middle of the screen of `display` (":7"). Empty when the window has taken it
// within a minute, else what went wrong.
std::string dropFile(const std::string& display, const std::filesystem::path& file);

}  // namespace relume
