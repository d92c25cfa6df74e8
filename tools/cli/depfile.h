// SPDX-License-Identifier: MIT
// Dependency files as Make and Ninja read them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace relume {

// "target: file file\n", with spaces, '#' and '$' escaped, and an empty rule for each file, so that Make does not stop
// when one is deleted.
std::string makeDepfile(const std::string& target, const std::vector<std::filesystem::path>& files);

}  // namespace relume
