// SPDX-License-Identifier: MIT
// See decimal.h.
#include "formats/decimal.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <system_error>

namespace relume {
namespace {

// Room for the largest double in fixed notation, 309 digits, with 20 more behind the point.
using Text = std::array<char, 352>;

template <class... Arguments>
std::string convert(Arguments... arguments) {
  Text text;
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), arguments...);
  return error == std::errc() ? std::string(text.data(), end) : std::string();
}

}  // namespace

std::string decimal(double value) { return convert(value); }
std::string decimal(float value) { return convert(value); }

std::string decimalFixed(double value, int digits) {
  return convert(value, std::chars_format::fixed, std::clamp(digits, 0, 20));
}

std::string decimalGeneral(double value, int digits) {
  return convert(value, std::chars_format::general, std::clamp(digits, 1, 17));
}

std::string decimalGlsl(float value) {
  const std::string text = decimal(value);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::optional<double> parseDecimal(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace relume
