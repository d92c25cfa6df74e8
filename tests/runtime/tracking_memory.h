// SPDX-License-Identifier: MIT
// A memory resource that knows what it gave: it holds what comes back against that, and refuses where it is told to. It
// calls malloc and keeps its notes beside each block, so that it leaves no trace among the calls of operator new.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory_resource>
#include <new>

namespace relume::test {

class TrackingMemory final : public std::pmr::memory_resource {
 public:
  static constexpr std::size_t kNever = static_cast<std::size_t>(-1);

  // The request that is refused, counted from here on: the first is 0.
  void refuse(std::size_t request) {
    requests_ = 0;
    refused_ = 0;
    refuseAt_ = request;
  }
  std::size_t requests() const { return requests_; }
  std::size_t refused() const { return refused_; }
  // [byte] that are out, and how many blocks.
  std::size_t bytes() const { return bytes_; }
  std::size_t blocks() const { return blocks_; }
  std::size_t maxBytes() const { return maxBytes_; }
  // Blocks that came back with another size or alignment, or twice; alignments that are no powers of two or too large.
  std::size_t mistakes() const { return mistakes_; }
  std::size_t minAlignment() const { return minAlignment_; }

  // As the callbacks of relume.h have it: null where it is refused.
  void* give(std::size_t size, std::size_t alignment) {
    if (requests_++ == refuseAt_) {
      ++refused_;
      return nullptr;
    }
    if (size == 0 || alignment == 0 || alignment > kMaxAlignment || (alignment & (alignment - 1)) != 0) ++mistakes_;
    minAlignment_ = alignment < minAlignment_ ? alignment : minAlignment_.load();
    // An odd multiple of the alignment, no better than what was asked for.
    auto* const raw = static_cast<std::byte*>(std::malloc(size + sizeof(Note) + 3 * kMaxAlignment));
    if (raw == nullptr) return nullptr;
    std::uintptr_t at = reinterpret_cast<std::uintptr_t>(raw) + sizeof(Note);
    at = (at + 2 * alignment - 1) / (2 * alignment) * (2 * alignment) + alignment;
    auto* const block = reinterpret_cast<std::byte*>(at);
    const Note note{raw, size, alignment, kLive};
    std::memcpy(block - sizeof(Note), &note, sizeof note);
    std::memset(block, 0xA5, size);
    ++blocks_;
    bytes_ += size;
    if (bytes_ > maxBytes_) maxBytes_ = bytes_.load();
    return block;
  }
  void takeBack(void* block, std::size_t size, std::size_t alignment) {
    Note note;
    std::memcpy(&note, static_cast<std::byte*>(block) - sizeof(Note), sizeof note);
    if (note.state != kLive || note.size != size || note.alignment != alignment) {
      ++mistakes_;
      return;
    }
    note.state = 0;
    std::memcpy(static_cast<std::byte*>(block) - sizeof(Note), &note, sizeof note);
    std::memset(block, 0x5A, size);
    --blocks_;
    bytes_ -= size;
    std::free(note.raw);
  }

 private:
  struct Note {
    std::byte* raw;
    std::size_t size, alignment;
    std::uint64_t state;
  };
  static constexpr std::uint64_t kLive = 0x52454C554D45AA55u;
  static constexpr std::size_t kMaxAlignment = 64;

  void* do_allocate(std::size_t size, std::size_t alignment) override {
    void* const block = give(size, alignment);
    if (block == nullptr) throw std::bad_alloc();
    return block;
  }
  void do_deallocate(void* block, std::size_t size, std::size_t alignment) override {
    takeBack(block, size, alignment);
  }
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override { return this == &other; }

  std::atomic<std::size_t> requests_{0}, refused_{0}, refuseAt_{kNever}, blocks_{0}, bytes_{0}, maxBytes_{0},
      mistakes_{0}, minAlignment_{kNever};
};

}  // namespace relume::test
