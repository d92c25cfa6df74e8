// SPDX-License-Identifier: MIT
// Numbers as text, the same in every locale: with a point, without groups. A host may set a locale that
// writes 0,5; GLSL, JSON, options and messages must not follow it, as std::to_string, printf, strtod and streams would.
// Whole numbers are safe in std::to_string.
#pragma once

#include <cstdint>
#include <string>

namespace relume {

// The shortest text that reads back as the same number: "0.1", "1e-06", "inf", "nan".
std::string decimal(double value);
std::string decimal(float value);
// As printf's %.<digits>g: "0.0123", "1.5e+07". [Range digits 1..17]
std::string decimalGeneral(double value, int digits);
// A literal of GLSL's type float: decimal() with a point or an exponent.
std::string decimalGlsl(float value);
// Sixteen hexadecimal digits, as hashes are shown.
std::string hexadecimal(std::uint64_t value);

}  // namespace relume
