// SPDX-License-Identifier: MIT
// See allocations.h. Aligned forms included: malloc's alignment is not enough for them.
#include "tests/runtime/allocations.h"

#include <atomic>
#include <cstdlib>
#include <new>

#if defined(RELUME_SANITIZED)

namespace relume::test {

std::size_t allocations() { return 0; }
bool countsAllocations() { return false; }
bool refuseAllocation(std::size_t) { return false; }
std::size_t largestAllocation() { return 0; }
void forgetLargest() {}
void refuseAllocationsFrom(std::size_t) {}

}  // namespace relume::test

#else

namespace {

std::atomic<std::size_t> count{0}, largest{0}, refusedFrom{0};  // refusedFrom: [bytes] 0 = none
std::atomic<std::size_t> refused{0};                            // that number of `count`; 0 = none

void* counted(std::size_t size, std::size_t alignment) {
  if (++count == refused) throw std::bad_alloc();
  if (const std::size_t least = refusedFrom; least > 0 && size >= least) throw std::bad_alloc();
  for (std::size_t before = largest; size > before && !largest.compare_exchange_weak(before, size);) {
  }
  void* memory = alignment <= alignof(std::max_align_t)
                     ? std::malloc(size == 0 ? 1 : size)
                     : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return counted(size, 1); }
void* operator new[](std::size_t size) { return counted(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace relume::test {

std::size_t allocations() { return count; }
bool countsAllocations() { return true; }
bool refuseAllocation(std::size_t n) {
  const std::size_t last = refused.exchange(n == 0 ? 0 : count + n);
  return last != 0 && count >= last;
}
std::size_t largestAllocation() { return largest; }
void forgetLargest() { largest = 0; }
void refuseAllocationsFrom(std::size_t bytes) { refusedFrom = bytes; }

}  // namespace relume::test

#endif
