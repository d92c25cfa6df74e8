// SPDX-License-Identifier: MIT
// See depfile.h.
#include "tools/cli/depfile.h"

namespace relume {
namespace {

std::string escaped(const std::string& path) {
  std::string out;
  for (const char c : path) {
    if (c == ' ' || c == '#') out += '\\';
    if (c == '$') out += '$';
    out += c;
  }
  return out;
}

}  // namespace

std::string makeDepfile(const std::string& target, const std::vector<std::filesystem::path>& files) {
  std::string text = escaped(target) + ":", rules;
  for (const std::filesystem::path& file : files) {
    text += " \\\n  " + escaped(file.string());
    rules += "\n" + escaped(file.string()) + ":\n";
  }
  return text + "\n" + rules;
}

}  // namespace relume
