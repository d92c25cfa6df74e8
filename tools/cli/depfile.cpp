// SPDX-License-Identifier: MIT
// See depfile.h. Names are written as g++ writes them, which both programs read: a backslash before what would end a
// name, before the colon that would end a target and the # that would begin a comment; backslashes that stand before
// white space are doubled.
#include "tools/cli/depfile.h"

#include <algorithm>
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

std::string quotedCharacter(char c) { return c == '\n' ? "an end of line" : std::string("a \"") + c + "\""; }

// What in a name ends it for both, whatever stands before it; empty: nothing.
std::string unreadByBoth(const std::string& name) {
  const std::size_t at = name.find_first_of(";|\n");
  if (at != std::string::npos) return quotedCharacter(name[at]);
  if (name.ends_with('\\')) return "a \"\\\" at the end";
  if (name.ends_with('&')) return "a \"&\" at the end";
  return "";
}

bool hasEquals(const std::filesystem::path& file) { return file.string().find('=') != std::string::npos; }

// Make takes a rule for a variable where its target, or what stands first behind the colon, has a =, and lib(member)
// for a part of an archive; it ends a name before white space.
std::string unreadByMake(const std::string& name, bool isFirst) {
  if (std::string both = unreadByBoth(name); !both.empty()) return both;
  if (isFirst && hasEquals(name)) return quotedCharacter('=');
  if (name.ends_with(')') && name.find('(') != std::string::npos) return "a \"(\" with a \")\" at the end";
  if (name.ends_with(' ') || name.ends_with('\t')) return "white space at the end";
  return "";
}

// Ninja ends a name before these, and reads a backslash before them as a part of it.
std::string unreadByNinja(const std::string& name) {
  if (std::string both = unreadByBoth(name); !both.empty()) return both;
  const std::size_t at = name.find_first_of("*?&'\"<>^`");
  return at == std::string::npos ? "" : quotedCharacter(name[at]);
}

// A name, and what in it Make and Ninja cannot read.
struct DepfileName {
  std::string name, byMake, byNinja;
};

// Names with a = come behind those without, where there are any.
std::vector<DepfileName> allNames(const std::string& target, const std::vector<std::filesystem::path>& files) {
  const bool isFirst = std::all_of(files.begin(), files.end(), hasEquals);
  std::vector<DepfileName> names{{target, unreadByMake(target, true), unreadByNinja(target)}};
  for (const std::filesystem::path& file : files)
    names.push_back({file.string(), unreadByMake(file.string(), isFirst), unreadByNinja(file.string())});
  return names;
}

}  // namespace

std::string makeDepfile(const std::string& target, const std::vector<std::filesystem::path>& files) {
  std::string text = escaped(target) + ":", rules;
  std::vector<std::filesystem::path> ordered = files;
  std::stable_partition(ordered.begin(), ordered.end(), [](const auto& file) { return !hasEquals(file); });
  for (const std::filesystem::path& file : ordered) {
    text += " \\\n  " + escaped(file.string());
    if (!hasEquals(file)) rules += "\n" + escaped(file.string()) + ":\n";  // else it would set a variable
  }
  return text + "\n" + rules;
}

Status checkDepfileNames(const std::string& target, const std::vector<std::filesystem::path>& files) {
  for (const auto& [name, byMake, byNinja] : allNames(target, files)) {
    if (byMake.empty() || byNinja.empty()) continue;
    const std::string found = byMake == byNinja ? byMake : byMake + " and " + byNinja;
    return Error{ErrorCode::usage, "--depfile: " + name + ": there is " + found +
                                       " in the name, which Make and Ninja cannot read; expected a name without one"};
  }
  return done();
}

std::vector<std::string> depfileWarnings(const std::string& target, const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> warnings;
  for (const auto& [name, byMake, byNinja] : allNames(target, files)) {
    const char* const blind = byMake.empty() ? "Ninja" : "Make";
    const char* const sees = byMake.empty() ? "Make" : "Ninja";
    const std::string& found = byMake.empty() ? byNinja : byMake;
    if (!found.empty() && (byMake.empty() || byNinja.empty()))
      warnings.push_back("--depfile: " + name + ": there is " + found + " in the name, which " + blind +
                         " cannot read from a depfile, though " + sees + " can: by " + blind +
                         " a change of that file may go unseen");
  }
  return warnings;
}

}  // namespace relume
