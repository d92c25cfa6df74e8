// SPDX-License-Identifier: MIT
// Levels that the tests of the export share: the sample level, exported once, and one with something of everything.
#pragma once

#include "tests/export/exported.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace relume::test {

inline const std::filesystem::path kLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";

BakeOptions someOptions();
const Exported& twoRooms();

// A closed box of eight welded vertices, from within or from outside.
struct Box {
  std::vector<float> position;
  std::vector<std::uint16_t> index;
};
Box weldedBox(float size, bool inward);

// A room with one of everything that an export has to carry.
testing::GltfBuilder madeLevel();

const nlohmann::json& nodeNamed(const nlohmann::json& root, const std::string& name);

// What pruning leaves of an accessor or a view.
bool isHusk(const nlohmann::json& element);

}  // namespace relume::test
