// SPDX-License-Identifier: MIT
// The host's memory as the runtime uses it. Classes that keep arrays take a resource and hand it to their members;
// copying one of them would fall back to std::pmr's default resource, and so they cannot be copied.
#pragma once

#include "formats/memory.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <memory_resource>
#include <new>
#include <utility>

namespace relume {

// Asks the host for blocks as aligned as those of operator new, which the kernels read fastest, and says how many bytes
// it was that the host refused.
class AlignedMemory final : public std::pmr::memory_resource {
 public:
  // [host not null] must outlive this.
  explicit AlignedMemory(std::pmr::memory_resource* host) : host_(host) {}
  std::pmr::memory_resource* host() const { return host_; }

 private:
  static constexpr std::size_t kMinAlignment = __STDCPP_DEFAULT_NEW_ALIGNMENT__;

  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    alignment = std::max(alignment, kMinAlignment);
    try {
      return host_->allocate(bytes, alignment);
    } catch (const std::bad_alloc&) {
      throw RefusedMemory(bytes, alignment);
    }
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
    host_->deallocate(block, bytes, std::max(alignment, kMinAlignment));
  }
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override { return this == &other; }

  std::pmr::memory_resource* host_;
};

// Destroys what makeOwned() made, whatever of its bases it is known by, and gives its memory back.
struct GiveBack {
  std::pmr::memory_resource* memory = nullptr;
  void* block = nullptr;
  std::size_t bytes = 0, alignment = 0;

  template <class T>
  void operator()(T* object) const noexcept {
    object->~T();
    memory->deallocate(block, bytes, alignment);
  }
};

// std::unique_ptr of an object in memory of the host's. A base T needs a virtual destructor.
template <class T>
using Owned = std::unique_ptr<T, GiveBack>;

// Throws what the resource and T's constructor throw.
template <class T, class... Arguments>
Owned<T> makeOwned(std::pmr::memory_resource* memory, Arguments&&... arguments) {
  void* const block = memory->allocate(sizeof(T), alignof(T));
  try {
    return Owned<T>(::new (block) T(std::forward<Arguments>(arguments)...),
                    GiveBack{memory, block, sizeof(T), alignof(T)});
  } catch (...) {
    memory->deallocate(block, sizeof(T), alignof(T));
    throw;
  }
}

}  // namespace relume
