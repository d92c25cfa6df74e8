// SPDX-License-Identifier: MIT
// JSON from files and bakes, none of which is trusted: whatever walks a value (dump, flatten, tinygltf) recurses, so
// that nesting is bounded here, the one place where JSON is read.
#pragma once

#include "relume/result.h"

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <string_view>

namespace relume {

// [max] levels of arrays and objects.
inline constexpr std::size_t kMaxJsonDepth = 128;

// skip: for files that people write, in which a name that stands twice in one object is refused as well.
enum class JsonComments { refuse, skip };

// invalidFile: not JSON, with the position in the text; or nested deeper than kMaxJsonDepth. The message does not name
// the file.
Result<nlohmann::json> readJson(std::string_view text, JsonComments comments = JsonComments::refuse);

}  // namespace relume
