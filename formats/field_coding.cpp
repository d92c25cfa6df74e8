// SPDX-License-Identifier: MIT
// See field_coding.h.
#include "formats/field_coding.h"

#include <algorithm>
#include <cstring>

namespace relume {
namespace {

struct Field {
  std::uint32_t shift = 0, width = 0;  // [bit]
  bool differences = false;

  std::uint32_t mask() const { return 0xFFFFFFFFu >> (32 - width); }
  std::uint32_t bytes() const { return (width + 7) / 8; }
};

// The fields of a coding; of width 0 where there is none.
std::array<Field, 4> fieldsOf(FieldCoding coding) {
  std::array<Field, 4> fields;
  std::uint32_t shift = 0;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::uint32_t bits = coding >> (8 * i) & 0xFFu;
    fields[i] = {shift, bits & 0x3Fu, (bits & kDifferences) != 0};
    shift += fields[i].width;
  }
  return fields;
}

template <class Word>
void encodeField(const Field& field, const std::byte* first, std::size_t stride, std::size_t rows, std::byte* planes) {
  std::uint32_t previous = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    Word word;
    std::memcpy(&word, first + row * stride, sizeof word);
    const std::uint32_t value = std::uint32_t{word} >> field.shift & field.mask();
    const std::uint32_t stored = field.differences ? foldSign(value - previous, field.width) : value;
    previous = value;
    for (std::uint32_t plane = 0; plane < field.bytes(); ++plane)
      planes[plane * rows + row] = static_cast<std::byte>(stored >> (8 * plane));
  }
}

// Adds the field to words whose bits of it are zero. False where stored bits are beyond its width.
template <class Word>
bool decodeField(const Field& field, const std::byte* planes, std::size_t stride, std::size_t rows, std::byte* first) {
  std::uint32_t previous = 0, seen = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    std::uint32_t value = 0;
    for (std::uint32_t plane = 0; plane < field.bytes(); ++plane)
      value |= std::to_integer<std::uint32_t>(planes[plane * rows + row]) << (8 * plane);
    seen |= value;
    if (field.differences) previous = value = (previous + unfoldSign(value, field.width)) & field.mask();
    Word word;
    std::memcpy(&word, first + row * stride, sizeof word);
    word = static_cast<Word>(word | value << field.shift);
    std::memcpy(first + row * stride, &word, sizeof word);
  }
  return (seen & ~field.mask()) == 0;
}

}  // namespace

std::uint32_t wordBits(FieldCoding coding) {
  std::uint32_t sum = 0;
  bool ended = false;
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t bits = coding >> (8 * i) & 0xFFu, width = bits & 0x3Fu;
    if (bits > (kDifferences | 32u) || width > 32 || (width == 0 && bits != 0) || (ended && width != 0)) return 0;
    ended = width == 0;
    sum += width;
  }
  return sum == 16 || sum == 32 ? sum : 0;
}

std::uint64_t codedBytes(FieldCoding coding, std::uint64_t rows, std::uint64_t rowBytes) {
  std::uint64_t bytes = 0;
  for (const Field& field : fieldsOf(coding)) bytes += field.bytes();
  return rows * (rowBytes / (wordBits(coding) / 8)) * bytes;
}

std::vector<std::byte> encodeFields(FieldCoding coding, std::span<const std::byte> data, std::size_t rowBytes) {
  const std::size_t rows = data.size() / rowBytes, wordBytes = wordBits(coding) / 8;
  std::vector<std::byte> coded(static_cast<std::size_t>(codedBytes(coding, rows, rowBytes)));
  std::byte* planes = coded.data();
  for (std::size_t column = 0; column < rowBytes; column += wordBytes) {
    for (const Field& field : fieldsOf(coding)) {
      if (field.width == 0) break;
      if (wordBytes == 2)
        encodeField<std::uint16_t>(field, data.data() + column, rowBytes, rows, planes);
      else
        encodeField<std::uint32_t>(field, data.data() + column, rowBytes, rows, planes);
      planes += field.bytes() * rows;
    }
  }
  return coded;
}

bool decodeFields(FieldCoding coding, std::span<const std::byte> coded, std::size_t rowBytes,
                  std::span<std::byte> data) {
  const std::size_t rows = data.size() / rowBytes, wordBytes = wordBits(coding) / 8;
  std::fill(data.begin(), data.end(), std::byte{0});
  const std::byte* planes = coded.data();
  bool good = true;
  for (std::size_t column = 0; column < rowBytes; column += wordBytes) {
    for (const Field& field : fieldsOf(coding)) {
      if (field.width == 0) break;
      if (wordBytes == 2)
        good &= decodeField<std::uint16_t>(field, planes, rowBytes, rows, data.data() + column);
      else
        good &= decodeField<std::uint32_t>(field, planes, rowBytes, rows, data.data() + column);
      planes += field.bytes() * rows;
    }
  }
  return good;
}

}  // namespace relume
