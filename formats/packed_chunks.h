// SPDX-License-Identifier: MIT
// The chunks of a packed bake: those of any other, each coded so that general compressors find what repeats
// (field_coding.h), and what the others tell left out. For bakes on their way to a browser or a console's package;
// they are unpacked into memory when they are read.
#pragma once

#include "formats/chunks.h"
#include "formats/field_coding.h"
#include "relume/links.h"
#include "relume/result.h"

#include <cstdint>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

namespace relume {

// Codings of single chunks, which no fields have.
// node.child: first children are counted (Hierarchy::child), so the words of inner nodes are 0.
inline constexpr FieldCoding kCountedChildren = 0x80000001u;
// node.leaf: nothing is stored; node.child says which leaf a sender has.
inline constexpr FieldCoding kCountedLeaves = 0x80000002u;
// link.shape of kind oct6: directions are stored as differences from where senders lie (direction_coding.h).
inline constexpr FieldCoding kExpectedDirections = 0x80000003u;

// What a chunk of that type, shape and coding takes in the file [byte]; nothing where the coding does not fit the type,
// or the sizes leave 61 bits.
std::optional<std::uint64_t> storedBytes(ElementType type, std::span<const std::uint64_t, 2> shape, FieldCoding coding);

struct PackedChunks {
  std::vector<Chunk> chunks;
  std::vector<std::vector<std::byte>> coded;  // what they point to, where it is not the data of the chunks given
};

// Chunks of a bake that checkStructure() takes.
PackedChunks packChunks(std::span<const Chunk> chunks, LinkKind kind);

struct UnpackedChunks {
  std::pmr::vector<Chunk> chunks;  // as in a file that is not packed, but for offset, bytes and hash
  std::shared_ptr<const void> owner;
};

// The opposite, for chunks that readChunks() found in a packed bake. invalidFile: names the chunk and what is wrong.
// All memory, at most the file's own size and four bytes a sender, and 16 bytes a node meanwhile, is from `memory` [not
// null]; throws std::bad_alloc.
Result<UnpackedChunks> unpackChunks(std::span<const Chunk> packed, std::pmr::memory_resource* memory);

}  // namespace relume
