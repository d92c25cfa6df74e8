// SPDX-License-Identifier: MIT
// Types and ranges of the JSON members the importer reads, checked before tinygltf sees them: it drops what it does
// not understand without a word.
#pragma once

#include "relume/result.h"

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace relume {

// invalidFile: names the JSON path, what was expected and what was found. Whole numbers written as 3.0 become 3.
Status checkGltfSchema(nlohmann::json& root, const std::string& file);

}  // namespace relume
