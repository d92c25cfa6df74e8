// SPDX-License-Identifier: MIT
// Ranges of numbers on the command line. CLI11's own let NaN through: no comparison with it is true.
#pragma once

#include <CLI/CLI.hpp>

#include <cmath>
#include <limits>
#include <string>

namespace relume {

// Finite and of [low, high]; the message names the range and what was found.
inline CLI::Validator numberFrom(double low, double high = std::numeric_limits<double>::infinity()) {
  const auto text = [](double value) {
    std::string digits = std::to_string(value);
    digits.erase(digits.find_last_not_of('0') + 1);
    if (digits.ends_with('.')) digits.pop_back();
    return digits;
  };
  const std::string range = std::isfinite(high) ? text(low) + " to " + text(high) : text(low) + " or more";
  return CLI::Validator(
      [low, high, range](const std::string& input) {
        double value = 0.0;
        const bool number = CLI::detail::lexical_cast(input, value);
        return number && std::isfinite(value) && value >= low && value <= high
                   ? std::string()
                   : "a number, " + range + ", expected; \"" + input + "\" found";
      },
      "");
}

}  // namespace relume
