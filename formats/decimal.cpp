// SPDX-License-Identifier: MIT
// See decimal.h.
#include "formats/decimal.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <system_error>

namespace relume {
namespace {

// Room for 17 digits with sign, point and exponent.
using Text = std::array<char, 32>;

template <class... Arguments>
std::string convert(Arguments... arguments) {
  Text text;
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), arguments...);
  return error == std::errc() ? std::string(text.data(), end) : std::string();
}

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
