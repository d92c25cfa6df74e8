// SPDX-License-Identifier: MIT
// Ranges of numbers on the command line. CLI11's own let NaN through: no comparison with it is true.
#pragma once

#include "formats/decimal.h"
#include "tools/base/parse_numbers.h"

#include <CLI/CLI.hpp>

#include <cmath>
#include <limits>
#include <optional>
#include <string>

namespace relume {

// Finite and of [low, high]; the message names the range and what was found.
inline CLI::Validator numberFrom(double low, double high = std::numeric_limits<double>::infinity()) {
  const std::string range = std::isfinite(high) ? decimal(low) + " to " + decimal(high) : decimal(low) + " or more";
  return CLI::Validator(
      [low, high, range](const std::string& input) {
        const std::optional<float> value = finiteNumber(input);
        return value && *value >= low && *value <= high ? std::string()
                                                        : "a number, " + range + ", expected; \"" + input + "\" found";
      },
      "");
}

}  // namespace relume
