// SPDX-License-Identifier: MIT
// Single-precision numbers in JSON, whose numbers are doubles: 2.6 in place of 2.5999999046325684.
#pragma once

#include "formats/decimal.h"

#include <charconv>
#include <string>

namespace relume {

// The double whose shortest text is that of `value`, and so reads back as the same float. What is not finite stays.
inline double shownFloat(float value) {
  const std::string text = decimal(value);
  double shown = static_cast<double>(value);
  std::from_chars(text.data(), text.data() + text.size(), shown);
  return shown;
}

}  // namespace relume
