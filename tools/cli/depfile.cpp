// SPDX-License-Identifier: MIT
// See depfile.h. Names are written as g++ writes them, which both programs read: a backslash before what would end a
// name, before the colon that would end a target and the # that would begin a comment; backslashes that stand before
// white space are doubled.
#include "tools/cli/depfile.h"

#include <cstddef>

namespace relume {
namespace {

std::string escaped(const std::string& path) {
  std::string out;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const char c = path[i];
    const bool isBlank = c == ' ' || c == '\t';
    for (std::size_t k = i; isBlank && k > 0 && path[k - 1] == '\\'; --k) out += '\\';
    if (isBlank || c == '#' || c == ':') out += '\\';
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

Status checkDepfileNames(const std::string& target, const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> names{target};
  for (const std::filesystem::path& file : files) names.push_back(file.string());
  for (const std::string& name : names) {
    const std::size_t at = name.find_first_of(";|\n");
    if (at == std::string::npos) continue;
    const std::string found = name[at] == '\n' ? "an end of line" : std::string("a \"") + name[at] + "\"";
    return Error{ErrorCode::usage, "--depfile: " + name + ": there is " + found +
                                       " in the name, which Make and Ninja cannot read; expected a name without one"};
  }
  return done();
}

}  // namespace relume
