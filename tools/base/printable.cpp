// SPDX-License-Identifier: MIT
// See printable.h.
#include "tools/base/printable.h"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>

namespace relume {
namespace {

// A code point and the bytes it takes; none where the bytes are not UTF-8 (overlong forms and surrogates are not).
struct Decoded {
  std::uint32_t point = 0;
  std::size_t bytes = 0;
};

Decoded decode(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t first = byte(0);
  if (first < 0x80) return {first, 1};
  const std::size_t bytes = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < bytes) return {};
  std::uint32_t point = first & (0x7Fu >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return {};
    point = point << 6 | (byte(i) & 0x3F);
  }
  constexpr std::uint32_t kMin[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = point >= 0xD800 && point <= 0xDFFF;
  if (point < kMin[bytes] || point > 0x10FFFF || surrogate) return {};
  return {point, bytes};
}

bool isControl(std::uint32_t point) {
  const bool c0OrDel = point < 0x20 || point == 0x7F, c1 = point >= 0x80 && point <= 0x9F;
  const bool separator = point == 0x2028 || point == 0x2029;
  const bool direction = point == 0x061C || point == 0x200E || point == 0x200F ||
                         (point >= 0x202A && point <= 0x202E) || (point >= 0x2066 && point <= 0x2069);
  return c0OrDel || c1 || separator || direction;
}

std::string nameOf(std::uint32_t point) {
  if (point == '\n') return "\\n";
  if (point == '\r') return "\\r";
  if (point == '\t') return "\\t";
  char name[16];
  std::snprintf(name, sizeof(name), point < 0x80 ? "\\x%02x" : "\\u%04x", static_cast<unsigned>(point));
  return name;
}

}  // namespace

std::string printable(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Decoded next = decode(text);
    if (next.bytes == 0) {
      char name[8];
      std::snprintf(name, sizeof(name), "\\x%02x", static_cast<unsigned>(static_cast<std::uint8_t>(text[0])));
      out += name;
    } else if (isControl(next.point)) {
      out += nameOf(next.point);
    } else {
      out += text.substr(0, next.bytes);
    }
    text.remove_prefix(next.bytes == 0 ? 1 : next.bytes);
  }
  return out;
}

std::string printableLines(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t end = text.find_first_of("\n\t");
    out += printable(text.substr(0, end));
    if (end == std::string_view::npos) break;
    const bool more = end + 1 < text.size();
    if (text[end] == '\t') out += '\t';
    if (text[end] == '\n' && more) out += "\n  ";
    text.remove_prefix(end + 1);
  }
  return out;
}

nlohmann::json printableStrings(const nlohmann::json& value) {
  if (value.is_string()) return printable(value.get_ref<const std::string&>());
  nlohmann::json out = value;
  if (value.is_object()) {
    out.clear();
    for (const auto& [key, member] : value.items()) out[printable(key)] = printableStrings(member);
  } else if (value.is_array()) {
    for (nlohmann::json& element : out) element = printableStrings(element);
  }
  return out;
}

std::string jsonText(const nlohmann::json& value, int indent) {
  return value.dump(indent, ' ', /*ensure_ascii=*/true, nlohmann::json::error_handler_t::replace);
}

}  // namespace relume
