// SPDX-License-Identifier: MIT
// An entry as a store keeps it: a header that says whose it is and what it holds, then one zstd frame. A hash over both
// tells whether it is whole.
//
//   0   u8[8]   magic 89 52 4C 45 0D 0A 1A 0A
//   8   u32     version, 1
//   12  u32     zero
//   16  u64[2]  the entry's name, high and low
//   32  u64     bytes before compression
//   40  u64     zero
//   48  u64[2]  XXH3-128 of the 48 bytes above and of the frame, high and low
//   64  ...     the frame
#pragma once

#include "bake/store/store.h"

#include <memory>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kEntryVersion = 1;
inline constexpr std::uint64_t kMaxEntryBytes = 1ull << 34;  // of a file in a store
inline constexpr std::size_t kEntryHeaderBytes = 64;

// Bytes that were unpacked, aligned as chunks need it.
struct EntryBytes {
  std::shared_ptr<const void> owner;
  std::span<const std::byte> bytes;
};

// Throws std::bad_alloc.
Result<std::vector<std::byte>> sealEntry(const EntryName& name, std::span<const std::byte> bytes);
// Whether a file that begins so is an entry, by its magic alone.
bool beginsAsEntry(std::span<const std::byte> beginning);
// [byte] The most that a file with this header has: asked before the rest is read. invalidFile: no header of an entry.
Result<std::uint64_t> mostEntryBytes(std::span<const std::byte> beginning);
// Of so many bytes that are or will be there, against what the header says and what may be read. invalidFile, memory:
// as Store::get().
Status checkEntrySize(std::uint64_t bytes, std::uint64_t most, std::uint64_t maxBytes);
// [byte] What openEntry() will allocate, once the file is known to be whole. invalidFile: it is damaged, or another's.
Result<std::uint64_t> checkEntry(const EntryName& name, std::span<const std::byte> file);
// Of a file that checkEntry() has taken. invalidFile: the frame does not hold what the header says.
Result<EntryBytes> openEntry(std::span<const std::byte> file);

}  // namespace relume
