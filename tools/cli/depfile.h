// SPDX-License-Identifier: MIT
// Dependency files as Make and Ninja read them.
#pragma once

#include "relume/result.h"

#include <filesystem>
#include <string>
#include <vector>

namespace relume {

// "target: file file\n", with spaces, '#' and '$' escaped, and an empty rule for each file without a =, so that Make
// does not stop when one is deleted.
std::string makeDepfile(const std::string& target, const std::vector<std::filesystem::path>& files);

// Whether Make and Ninja can read these names at all: usage error where neither has a way to write a character of one.
Status checkDepfileNames(const std::string& target, const std::vector<std::filesystem::path>& files);

// What is to be said of names that one of the two cannot read, each by its name.
std::vector<std::string> depfileWarnings(const std::string& target, const std::vector<std::filesystem::path>& files);

}  // namespace relume
