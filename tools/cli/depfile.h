// SPDX-License-Identifier: MIT
// Dependency files as Make and Ninja read them.
#pragma once

#include "relume/result.h"

#include <filesystem>
#include <string>
#include <vector>

namespace relume {

// "target: file file\n", with spaces, '#' and '$' escaped, and an empty rule for each file, so that Make does not stop
// when one is deleted.
std::string makeDepfile(const std::string& target, const std::vector<std::filesystem::path>& files);

// Whether Make and Ninja can read these names at all: usage error where neither has a way to write a character of one.
Status checkDepfileNames(const std::string& target, const std::vector<std::filesystem::path>& files);

}  // namespace relume
