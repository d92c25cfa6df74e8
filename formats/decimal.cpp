// SPDX-License-Identifier: MIT
// See decimal.h.
#include "formats/decimal.h"

#if defined(__EMSCRIPTEN__)
#include <emscripten.h>
#endif

#include <algorithm>
#include <array>
#include <charconv>
#include <system_error>

namespace relume {
namespace {

// Room for 17 digits with sign, point and exponent.
using Text = std::array<char, 32>;

#if defined(__EMSCRIPTEN__)
// The C++ library converts no floating-point numbers; JavaScript does, and needs no strtod to find the fewest digits.
// digits: at most, or 0 for as few as read back as the same double, or as the same float.
// clang-format off
EM_JS(void, writeNumber, (double value, int digits, int isFloat, char* text, int capacity), {
  let shown = value;
  if (digits > 0) shown = Number(value.toPrecision(digits));
  for (let d = 1; isFloat && d < 10; ++d) {
    shown = Number(value.toPrecision(d));
    if (Math.fround(shown) === value) break;
  }
  const name = Number.isNaN(shown) ? "nan" : String(shown).replace("Infinity", "inf");
  stringToUTF8(name, text, capacity);
});
// clang-format on

std::string convert(double value, std::chars_format, int digits) {
  Text text;
  writeNumber(value, digits, 0, text.data(), text.size());
  return text.data();
}

template <class Number>
std::string convert(Number value) {
  Text text;
  writeNumber(value, 0, sizeof(Number) == 4, text.data(), text.size());
  return text.data();
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

std::string hexadecimal(std::uint64_t value) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text(16, '0');
  for (std::size_t i = text.size(); value != 0; value >>= 4) text[--i] = kDigits[value & 15];
  return text;
}

}  // namespace relume
