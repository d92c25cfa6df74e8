// SPDX-License-Identifier: MIT
// See read_json.h.
#include "bake/base/read_json.h"

#include <nlohmann/json.hpp>

#include <optional>
#include <set>
#include <string>
#include <vector>

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

// What is quoted of a text may be long.
std::string shortened(const std::string& text) {
  constexpr std::size_t kMaxText = 300;
  return text.size() > kMaxText ? text.substr(0, kMaxText) + "..." : text;
}

// Looks for a name that stands twice in one object: the parser takes the last and drops the rest.
class RepeatedName final : public nlohmann::json_sax<json> {
 public:
  const std::optional<std::string>& found() const { return found_; }

  bool null() override { return true; }
  bool boolean(bool /*value*/) override { return true; }
  bool number_integer(number_integer_t /*value*/) override { return true; }
  bool number_unsigned(number_unsigned_t /*value*/) override { return true; }
  bool number_float(number_float_t /*value*/, const string_t& /*text*/) override { return true; }
  bool string(string_t& /*value*/) override { return true; }
  bool binary(binary_t& /*value*/) override { return true; }
  bool start_array(std::size_t /*size*/) override { return true; }
  bool end_array() override { return true; }
  bool start_object(std::size_t /*size*/) override {
    names_.emplace_back();
    return true;
  }
  bool end_object() override {
    names_.pop_back();
    return true;
  }
  bool key(string_t& name) override {
    if (names_.back().insert(name).second) return true;
    found_ = name;
    return false;
  }
  bool parse_error(std::size_t /*at*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*e*/) override {
    return false;  // told by the parse that makes values
  }

 private:
  std::vector<std::set<std::string>> names_;  // of the objects that are open
  std::optional<std::string> found_;
};

}  // namespace

Result<json> readJson(std::string_view text, JsonComments comments) {
  if (nestsDeeperThan(text, kMaxJsonDepth, comments))
    return Error{ErrorCode::invalidFile, "JSON nested more than " + std::to_string(kMaxJsonDepth) + " deep"};
  try {
    if (comments == JsonComments::skip) {
      RepeatedName repeated;
      json::sax_parse(text.begin(), text.end(), &repeated, json::input_format_t::json, /*strict=*/true,
                      /*ignore_comments=*/true);
      if (repeated.found())
        return Error{ErrorCode::invalidFile,
                     "\"" + shortened(*repeated.found()) + "\" stands twice in one object; keep one of them"};
    }
    return json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/true, comments == JsonComments::skip);
  } catch (const json::exception& e) {
    return Error{ErrorCode::invalidFile, shortened(std::string("not JSON: ") + e.what())};
  }
}

}  // namespace relume
