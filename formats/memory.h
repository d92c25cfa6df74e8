// SPDX-License-Identifier: MIT
// Memory of the host's: which resource serves a request, and what is said when there is none left. The resource is
// handed down by whoever allocates. Neither std::pmr's default resource nor any other global one is used.
#pragma once

#include "relume/result.h"

#include <array>
#include <cstddef>
#include <cstdio>
#include <memory_resource>
#include <new>

namespace relume {

// The host's resource, or the global operators new and delete.
inline std::pmr::memory_resource* memoryOr(std::pmr::memory_resource* host) {
  return host != nullptr ? host : std::pmr::new_delete_resource();
}

// A request that the host refused. Its text names the size, and takes no memory.
class RefusedMemory : public std::bad_alloc {
 public:
  RefusedMemory(std::size_t bytes, std::size_t alignment) noexcept {
    std::snprintf(text_.data(), text_.size(), "out of memory: %zu bytes aligned to %zu were refused", bytes, alignment);
  }
  const char* what() const noexcept override { return text_.data(); }

 private:
  std::array<char, 112> text_{};
};

inline Error outOfMemory(const std::bad_alloc& refused) noexcept {
  try {
    const auto* named = dynamic_cast<const RefusedMemory*>(&refused);
    if (named != nullptr) return {ErrorCode::memory, named->what()};
  } catch (const std::bad_alloc&) {  // not even for the text
  }
  return {ErrorCode::memory, "out of memory"};  // short enough to be kept without an allocation
}

}  // namespace relume
