// SPDX-License-Identifier: MIT
// See packed_chunks.h.
#include "formats/packed_chunks.h"

#include "formats/direction_coding.h"
#include "formats/memory.h"
#include "relume/hierarchy.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

namespace relume {
namespace {

constexpr FieldCoding kPlanes = fieldCoding(32);
constexpr FieldCoding kPlanesOfDifferences = fieldCoding(32 | kDifferences);

// What made bakes of real levels smallest with gzip (docs/notes/packing.md). Directions and what little there is of
// other arrays compress best as they are.
FieldCoding codingOf(std::string_view name, LinkKind kind) {
  constexpr std::pair<std::string_view, FieldCoding> kCodings[] = {
      {"surfel.position", kPlanes},
      {"surfel.albedo", kPlanes},
      {"surfel.instance", kPlanes},
      {"node.child", kCountedChildren},
      {"node.weight", kPlanes},
      {"node.leaf", kCountedLeaves},
      {"cache.position", kPlanes},
      {"grid.cache", kPlanesOfDifferences},
      {"grid.brick", kPlanesOfDifferences},
      {"grid.fine", kPlanesOfDifferences},
      {"map.cache", kPlanesOfDifferences},
      {"link.row", kPlanesOfDifferences},
      {"link.node", kPlanesOfDifferences},
      {"link.sh", fieldCoding(16)},
      {"link.cone", kPlanes},
      // The node, which ascends; the last bits of the transfer's mantissa; the others and its exponent.
      {"link.head", fieldCoding(20 | kDifferences, 2, 10)},
  };
  if (name == "link.shape") return kind == LinkKind::oct6 ? kExpectedDirections : fieldCoding(12, 12, 8);
  for (const auto& [of, coding] : kCodings)
    if (name == of) return coding;
  return kUncoded;
}

std::uint32_t wordAt(std::span<const std::byte> words, std::size_t i) {
  std::uint32_t word;
  std::memcpy(&word, words.data() + 4 * i, sizeof word);
  return word;
}

void setWord(std::span<std::byte> words, std::size_t i, std::uint32_t word) {
  std::memcpy(words.data() + 4 * i, &word, sizeof word);
}

std::vector<std::byte> leaveOutChildren(std::span<const std::byte> child) {
  std::vector<std::byte> coded(child.begin(), child.end());
  for (std::size_t node = 0; node < child.size() / 4; ++node)
    if ((wordAt(coded, node) & kLeafBit) == 0) setWord(coded, node, 0);
  return coded;
}

Error invalidChunk(const Chunk& chunk, const std::string& what) {
  return {ErrorCode::invalidFile, "chunk " + chunk.info.name + ": " + what};
}

// Whether there are as many inner nodes as the number of words allows is for checkStructure() to say.
Status countChildren(const Chunk& stored, std::span<std::byte> child) {
  std::copy(stored.data.begin(), stored.data.end(), child.begin());
  std::uint32_t next = 1;
  for (std::size_t node = 0; node < child.size() / 4; ++node) {
    const std::uint32_t word = wordAt(child, node);
    if ((word & kLeafBit) != 0) continue;
    if (word != 0)
      return invalidChunk(
          stored, "row " + std::to_string(node) + ": expected 0 of an inner node, found " + std::to_string(word));
    setWord(child, node, next);
    next += 2;
  }
  return done();
}

Status countLeaves(const Chunk& stored, std::span<const std::byte> child, std::span<std::byte> leaf) {
  std::fill(leaf.begin(), leaf.end(), std::byte{0});
  for (std::size_t node = 0; node < child.size() / 4; ++node) {
    const std::uint32_t word = wordAt(child, node);
    if ((word & kLeafBit) == 0) continue;
    const std::uint32_t sender = word & ~kLeafBit;
    if (sender >= leaf.size() / 4)
      return invalidChunk(stored, "has " + std::to_string(leaf.size() / 4) + " rows, and a leaf is of sender " +
                                      std::to_string(sender));
    setWord(leaf, sender, static_cast<std::uint32_t>(node));
  }
  return done();
}

// The numbers of a chunk that is not coded; none where there is no such chunk.
template <class T>
std::span<const T> numbersOf(std::span<const Chunk> chunks, std::string_view name, ElementType type) {
  for (const Chunk& chunk : chunks) {
    if (chunk.info.name == name && chunk.info.type == type && chunk.info.coding == kUncoded)
      return {reinterpret_cast<const T*>(chunk.data.data()), chunk.data.size() / sizeof(T)};
  }
  return {};
}

LinkEnds linkEndsOf(std::span<const Chunk> chunks) {
  const auto floats = [&](const char* name) { return numbersOf<float>(chunks, name, ElementType::f32); };
  const auto words = [&](const char* name) { return numbersOf<std::uint32_t>(chunks, name, ElementType::u32); };
  return {floats("surfel.position"), floats("sky.direction"), floats("cache.position"),
          words("node.child"),       words("link.row"),       words("link.head")};
}

Status takeDirections(const Chunk& stored, const LinkEnds& ends, std::span<std::byte> shapes,
                      std::pmr::memory_resource* memory) {
  if (decodeDirections(ends, stored.data, shapes, memory)) return done();
  return invalidChunk(stored, "packed: a direction has more bits than its width");
}

// [byte] of a chunk that is not coded: of a row, and of all. They are no more than the file has, or than leaves need.
std::size_t rowBytes(const ChunkInfo& info) {
  return static_cast<std::size_t>(info.shape[1]) * elementBytes(info.type);
}
std::size_t plainBytes(const ChunkInfo& info) { return static_cast<std::size_t>(info.shape[0]) * rowBytes(info); }

static_assert(alignof(AlignedBlock) == kChunkAlignment && sizeof(AlignedBlock) == kChunkAlignment);

}  // namespace

std::optional<std::uint64_t> storedBytes(ElementType type, std::span<const std::uint64_t, 2> shape,
                                         FieldCoding coding) {
  constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 61;
  const std::uint64_t rows = shape[0], bytesEach = shape[1] * elementBytes(type);
  if (bytesEach == 0 || rows > kMaxBytes / 8 / bytesEach) return {};  // a field of one bit has a byte
  if (coding == kUncoded) return rows * bytesEach;
  if (coding == kCountedChildren || coding == kCountedLeaves || coding == kExpectedDirections) {
    if (type != ElementType::u32 || shape[1] != 1) return {};
    if (coding == kExpectedDirections) return rows * 2 * kCodedShapeBytes;
    return coding == kCountedLeaves ? 0 : rows * bytesEach;
  }
  const std::uint32_t bits = wordBits(coding);
  // Halves are words of their own; archives have no words.
  if (bits == 0 || type == ElementType::archive || (type == ElementType::f16 && bits != 16)) return {};
  return codedBytes(coding, rows, bytesEach);
}

PackedChunks packChunks(std::span<const Chunk> chunks, LinkKind kind) {
  PackedChunks packed;
  packed.chunks.assign(chunks.begin(), chunks.end());
  packed.coded.reserve(chunks.size());
  for (Chunk& chunk : packed.chunks) {
    const FieldCoding coding = chunk.data.empty() ? kUncoded : codingOf(chunk.info.name, kind);
    if (coding == kUncoded) continue;
    chunk.info.coding = coding;
    if (coding == kCountedLeaves)
      packed.coded.emplace_back();
    else if (coding == kCountedChildren)
      packed.coded.push_back(leaveOutChildren(chunk.data));
    else if (coding == kExpectedDirections)
      packed.coded.push_back(encodeDirections(linkEndsOf(chunks), chunk.data));
    else
      packed.coded.push_back(encodeFields(coding, chunk.data, rowBytes(chunk.info)));
    chunk.data = packed.coded.back();
  }
  return packed;
}

Result<UnpackedChunks> unpackChunks(std::span<const Chunk> packed, std::pmr::memory_resource* memory) {
  // Leaves, of which nothing is stored, are as many as their tree has; all others are no smaller in the file.
  std::size_t blockCount = 0;
  std::uint64_t leaves = 0;
  for (const Chunk& chunk : packed) {
    if (chunk.info.coding == kCountedLeaves) {
      if (chunk.info.shape[0] != leaves)
        return invalidChunk(chunk, "has " + std::to_string(chunk.info.shape[0]) + " rows, and the tree before it " +
                                       std::to_string(leaves) + " leaves");
      leaves = 0;  // of one chunk: what takes no room in the file must not be there many times
    }
    if (chunk.info.coding == kCountedChildren) leaves = (chunk.info.shape[0] + 1) / 2;
    blockCount += (plainBytes(chunk.info) + sizeof(AlignedBlock) - 1) / sizeof(AlignedBlock);
  }
  const auto blocks = std::allocate_shared<std::pmr::vector<AlignedBlock>>(
      std::pmr::polymorphic_allocator<AlignedBlock>(memory), blockCount);

  UnpackedChunks unpacked{std::pmr::vector<Chunk>(packed.begin(), packed.end(), memory), blocks};
  AlignedBlock* next = blocks->data();
  std::span<const std::byte> child;
  for (Chunk& chunk : unpacked.chunks) {
    const std::size_t bytes = plainBytes(chunk.info);
    const std::span<std::byte> data(reinterpret_cast<std::byte*>(next), bytes);
    next += (bytes + sizeof(AlignedBlock) - 1) / sizeof(AlignedBlock);
    const FieldCoding coding = chunk.info.coding;
    Status status = done();
    if (coding == kUncoded)
      std::copy(chunk.data.begin(), chunk.data.end(), data.begin());
    else if (coding == kCountedChildren)
      status = countChildren(chunk, data), child = data;
    else if (coding == kCountedLeaves)
      status = countLeaves(chunk, child, data);
    else if (coding == kExpectedDirections)
      status = takeDirections(chunk, linkEndsOf(unpacked.chunks), data, memory);
    else if (!decodeFields(coding, chunk.data, rowBytes(chunk.info), data))
      status = invalidChunk(chunk, "packed: a field has more bits than its width");
    if (!status) return status.error();
    chunk.data = data;
    chunk.info.coding = kUncoded;
  }
  return unpacked;
}

}  // namespace relume
