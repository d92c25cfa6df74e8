// SPDX-License-Identifier: MIT
// Ranges of numbers on the command line. CLI11's own let NaN through: no comparison with it is true.
#pragma once

#include "formats/decimal.h"
#include "tools/base/parse_numbers.h"

#include <CLI/CLI.hpp>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <system_error>

namespace relume {

// Finite and of [low, high]. Help and usageMessage() name the range as they do CLI::Range's.
inline CLI::Validator numberFrom(double low, double high = std::numeric_limits<double>::infinity()) {
  return CLI::Validator(
      [low, high](const std::string& input) {
        const std::optional<double> value = finiteNumber<double>(input);
        return value && *value >= low && *value <= high ? std::string() : "a number expected; \"" + input + "\" found";
      },
      std::isfinite(high) ? "FLOAT in [" + decimal(low) + " - " + decimal(high) + "]" : "FLOAT >= " + decimal(low));
}

// Whether a text begins with a whole number of 64 bits without a sign. What CLI11 reads makes 2^64 - 1 of -1, and of
// all that is beyond.
inline bool beginsWithCount(const std::string& text, bool isAll) {
  std::uint64_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  return error == std::errc() && (!isAll || end == text.data() + text.size());
}

// Of [0, 2^64 - 1].
inline CLI::Validator count64() {
  return CLI::Validator(
      [](const std::string& input) {
        return beginsWithCount(input, true) ? std::string() : "a whole number expected; \"" + input + "\" found";
      },
      "");
}

// Bytes, or a number with a unit: 512M, 8G.
inline CLI::Option* takeBytes(CLI::Option* option) {
  // What is added last is asked first.
  return option->transform(CLI::AsSizeValue(false))
      ->transform(CLI::Validator(
          [](std::string& input) {
            return beginsWithCount(input, false) ? std::string() : "a size expected; \"" + input + "\" found";
          },
          ""));
}

}  // namespace relume
