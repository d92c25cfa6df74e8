// SPDX-License-Identifier: MIT
// Memory of the host's: which resource serves a request, and what is said when there is none left. The resource is
// handed down by whoever allocates. Neither std::pmr's default resource nor any other global one is used.
#pragma once

#include "relume/result.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <memory_resource>
#include <new>
#include <string_view>

namespace relume {

// Memory in units of a cache line, aligned as the chunks of a file are.
struct alignas(64) AlignedBlock {
  std::byte bytes[64];
};

// The host's resource, or the global operators new and delete.
inline std::pmr::memory_resource* memoryOr(std::pmr::memory_resource* host) {
  return host != nullptr ? host : std::pmr::new_delete_resource();
}

// A request that the host refused. Its text names the size, and takes no memory.
class RefusedMemory : public std::bad_alloc {
 public:
  RefusedMemory(std::size_t bytes, std::size_t alignment) noexcept {
    char* end = text_.data();
    const auto add = [&](std::string_view words) { end = std::copy(words.begin(), words.end(), end); };
    const auto addNumber = [&](std::size_t number) {
      end = std::to_chars(end, text_.data() + text_.size(), number).ptr;
    };
    add(kStart);
    addNumber(bytes);
    add(" bytes aligned to ");
    addNumber(alignment);
    add(" were refused");
  }
  // By its text, which no other has: builds without run-time type information catch it as well.
  static bool is(const std::bad_alloc& refused) noexcept {
    return std::string_view(refused.what()).starts_with(kStart);
  }
  const char* what() const noexcept override { return text_.data(); }

 private:
  static constexpr std::string_view kStart = "out of memory: ";
  std::array<char, 112> text_{};
};

inline Error outOfMemory(const std::bad_alloc& refused) noexcept {
  try {
    if (RefusedMemory::is(refused)) return {ErrorCode::memory, refused.what()};
  } catch (const std::bad_alloc&) {  // not even for the text
  }
  return {ErrorCode::memory, "out of memory"};  // short enough to be kept without an allocation
}

}  // namespace relume
