// SPDX-License-Identifier: MIT
// See read_json.h.
#include "bake/base/read_json.h"

#include <nlohmann/json.hpp>

#include <string>

namespace relume {
namespace {

using nlohmann::json;

// Whether arrays and objects of `text` nest deeper than `limit`, in one pass before the parser makes anything of it. (A
// callback of the parser would tell as well, but with one the parser looks through all of an array after each of its
// objects: 100,000 nodes cost minutes in a checked build.) Exact for text that the parser accepts.
bool nestsDeeperThan(std::string_view text, std::size_t limit, JsonComments comments) {
  std::size_t depth = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    switch (text[i]) {
      case '"':
        for (++i; i < text.size() && text[i] != '"'; ++i) {
          if (text[i] == '\\') ++i;
        }
        break;
      case '/':
        if (comments == JsonComments::skip) {
          const bool block = text.substr(i, 2) == "/*";
          const std::size_t end = block ? text.find("*/", i + 2) : text.find('\n', i);
          if (end == std::string_view::npos) return false;
          i = block ? end + 1 : end;
        }
        break;
      case '[':
      case '{':
        if (++depth > limit) return true;
        break;
      case ']':
      case '}':
        if (depth > 0) --depth;
        break;
      default:
        break;
    }
  }
  return false;
}

}  // namespace

Result<json> readJson(std::string_view text, JsonComments comments) {
  if (nestsDeeperThan(text, kMaxJsonDepth, comments))
    return Error{ErrorCode::invalidFile, "JSON nested more than " + std::to_string(kMaxJsonDepth) + " deep"};
  try {
    return json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/true, comments == JsonComments::skip);
  } catch (const json::exception& e) {
    constexpr std::size_t kMaxText = 300;  // the parser quotes what it read last, however long
    std::string what = std::string("not JSON: ") + e.what();
    if (what.size() > kMaxText) what = what.substr(0, kMaxText) + "...";
    return Error{ErrorCode::invalidFile, what};
  }
}

}  // namespace relume
