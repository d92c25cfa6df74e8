// SPDX-License-Identifier: MIT
// Plain values and arrays as bytes, one after another, and back. Every array is preceded by its size, so that different
// values never give the same bytes. Reading stops at the first thing that does not fit, and allocates no more than
// there are bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace relume {

class ByteWriter {
 public:
  // No types with padding: its bytes are undefined.
  template <class T>
  requires(std::is_trivially_copyable_v<T>) void value(const T& v) { append(&v, sizeof(v)); }
  template <class T>
  requires(std::is_trivially_copyable_v<T>) void array(std::span<const T> values) {
    value(static_cast<std::uint64_t>(values.size()));
    append(values.data(), values.size_bytes());
  }
  void text(const std::string& text) { array(std::span<const char>(text)); }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  void append(const void* data, std::size_t size) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + size);
    if (size > 0) std::memcpy(bytes_.data() + at, data, size);
  }
  std::vector<std::byte> bytes_;
};

class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : left_(bytes) {}

  template <class T>
  requires(std::is_trivially_copyable_v<T>) void value(T& v) {
    if (!take(sizeof(T))) return;
    std::memcpy(&v, left_.data(), sizeof(T));
    left_ = left_.subspan(sizeof(T));
  }
  template <class T>
  requires(std::is_trivially_copyable_v<T>) void array(std::vector<T>& values) {
    std::uint64_t size = 0;
    value(size);
    if (size > left_.size() / sizeof(T)) failed_ = true;
    if (failed_) return;
    values.resize(size);
    if (size > 0) std::memcpy(values.data(), left_.data(), size * sizeof(T));
    left_ = left_.subspan(size * sizeof(T));
  }
  void text(std::string& text) {
    std::vector<char> characters;
    array(characters);
    text.assign(characters.begin(), characters.end());
  }
  // What has not been read.
  std::span<const std::byte> left() const { return left_; }
  // Whether all has been read, and fitted.
  bool isAll() const { return !failed_ && left_.empty(); }
  bool failed() const { return failed_; }

 private:
  bool take(std::size_t size) {
    failed_ = failed_ || size > left_.size();
    return !failed_;
  }
  std::span<const std::byte> left_;
  bool failed_ = false;
};

}  // namespace relume
