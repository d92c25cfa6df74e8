// SPDX-License-Identifier: MIT
// See read_json.h.
#include "bake/base/read_json.h"

#include <nlohmann/json.hpp>

#include <string>

namespace relume {
namespace {

using nlohmann::json;

struct TooDeep {};

}  // namespace

Result<json> readJson(std::string_view text, JsonComments comments) {
  // The parser tells the depth of what begins before it makes anything of it.
  const auto bounded = [](int depth, json::parse_event_t event, json&) {
    const bool begins = event == json::parse_event_t::object_start || event == json::parse_event_t::array_start;
    if (begins && depth >= static_cast<int>(kMaxJsonDepth)) throw TooDeep{};
    return true;
  };
  try {
    return json::parse(text.begin(), text.end(), bounded, /*allow_exceptions=*/true, comments == JsonComments::skip);
  } catch (const TooDeep&) {
    return Error{ErrorCode::invalidFile, "JSON nested more than " + std::to_string(kMaxJsonDepth) + " deep"};
  } catch (const json::exception& e) {
    constexpr std::size_t kMostText = 300;  // the parser quotes what it read last, however long
    std::string what = std::string("not JSON: ") + e.what();
    if (what.size() > kMostText) what = what.substr(0, kMostText) + "...";
    return Error{ErrorCode::invalidFile, what};
  }
}

}  // namespace relume
