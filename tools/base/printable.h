// SPDX-License-Identifier: MIT
// Text on its way to a terminal. Names come from files, and a terminal obeys what they may hold: escape sequences,
// line ends, marks that turn the direction of writing.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <string_view>

namespace relume {

// On one line: control characters (C0, DEL, C1), direction marks, line separators and bytes that are not UTF-8 are
// replaced by what names them: \n, \x1b, \u202e, \xff. All other text stays as it is.
std::string printable(std::string_view text);

// The same line by line, those after the first indented by two spaces, so that none passes for a message of its own;
// tabs stay.
std::string printableLines(std::string_view text);

// The value with every string of it, and every key, as printable() gives it: for reports that are printed as text.
nlohmann::json printableStrings(const nlohmann::json& value);

// JSON in ASCII: all else is escaped, as JSON has it. indent -1: one line. Bytes that are not UTF-8 become U+FFFD.
std::string jsonText(const nlohmann::json& value, int indent = 2);

}  // namespace relume
