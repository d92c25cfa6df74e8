// SPDX-License-Identifier: MIT
// See decimal.h.
#include "formats/decimal.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <system_error>

namespace relume {
namespace {

// Room for 17 digits with sign, point and exponent.
using Text = std::array<char, 32>;

#if defined(_LIBCPP_VERSION) && _LIBCPP_VERSION < 14000
// This C++ library converts no floating-point numbers, and the only locale that WebAssembly has is "C".
std::string convert(double value, std::chars_format, int digits) {
  Text text;
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return text.data();
}

template <class Number>
std::string convert(Number value) {
  constexpr int kDigits = sizeof(Number) == 4 ? 9 : 17;
  std::string text;
  for (int digits = 1; digits <= kDigits; ++digits) {
    text = convert(value, std::chars_format::general, digits);
    if (static_cast<Number>(std::strtod(text.c_str(), nullptr)) == value) break;
  }
  return text;
}
#else
template <class... Arguments>
std::string convert(Arguments... arguments) {
  Text text;
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), arguments...);
  return error == std::errc() ? std::string(text.data(), end) : std::string();
}
#endif

}  // namespace

std::string decimal(double value) { return convert(value); }
std::string decimal(float value) { return convert(value); }

std::string decimalGeneral(double value, int digits) {
  return convert(value, std::chars_format::general, std::clamp(digits, 1, 17));
}

std::string decimalGlsl(float value) {
  const std::string text = decimal(value);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

}  // namespace relume
