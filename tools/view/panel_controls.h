// SPDX-License-Identifier: MIT
// Controls that several parts of the panel have: of names, which files may give, and of lengths in a level. Within a
// window of Dear ImGui.
#pragma once

#include <glm/vec3.hpp>

#include <string>

namespace relume {

// Edits a text of any length.
bool inputText(const char* label, std::string& text);

// Controls with a name beside or in them, whatever it holds: a label of Dear ImGui would end at "##". They are told
// apart by PushID() alone.
bool namedCheckbox(const std::string& name, bool& value);
bool namedSelectable(const std::string& name, bool isSelected);
bool namedPlace(const std::string& name, glm::vec3& positionWorld, float levelSize);

// Drags of a place, and of a length that 0 does not limit [m]: slower in levels that are less than rooms. levelSize:
// the level's diagonal [m].
bool dragPlace(const char* label, glm::vec3& positionWorld, float levelSize);
bool dragRange(const char* label, float& range, float levelSize);

}  // namespace relume
