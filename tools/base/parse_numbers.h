// SPDX-License-Identifier: MIT
// Numbers of the command line, for options that say in words of their own what they expect. Nothing but digits, dots,
// signs and exponents is read, in any locale; no number is infinite or NaN.
#pragma once

#include <glm/vec3.hpp>

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace relume {

// A whole number of [low, high], or nothing.
inline std::optional<int> wholeNumber(std::string_view text, int low, int high) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < low || value > high) return std::nullopt;
  return value;
}

// A finite number, or nothing. Number: float or double.
template <class Number = float>
std::optional<Number> finiteNumber(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  Number value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

// "X,Y,Z", or nothing.
inline std::optional<glm::vec3> threeNumbers(std::string_view text) {
  glm::vec3 values(0.0f);
  for (int i = 0; i < 3; ++i) {
    const std::size_t comma = text.find(',');
    if ((comma == std::string_view::npos) != (i == 2)) return std::nullopt;
    const std::optional<float> value = finiteNumber(text.substr(0, comma));
    if (!value) return std::nullopt;
    values[i] = *value;
    text.remove_prefix(i < 2 ? comma + 1 : 0);
  }
  return values;
}

}  // namespace relume
