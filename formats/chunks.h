// SPDX-License-Identifier: MIT
// The container of a bake, and of a plan and the shards of one: a fixed header, a table of chunks, and 64-byte aligned
// raw arrays. Knows bytes, types and shapes, not what they mean (bake_file.cpp does). formats/README.md documents it
// byte by byte.
#pragma once

#include "formats/field_coding.h"
#include "formats/file_io.h"
#include "relume/result.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory_resource>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relume {

// Files say the least version that has what is in them: 3, 4 with emitters, 6 with a certificate, 8 where the light map
// has sight, each with or without what the ones before have; and where their chunks are packed (packed_chunks.h) 5 in
// place of 3 and 4, 7 in place of 6, and 9 in place of 8.
inline constexpr std::uint32_t kOldestBakeFormatVersion = 3, kEmitterFormatVersion = 4, kCertificateFormatVersion = 6,
                               kBakeFormatVersion = 8;
inline constexpr std::uint32_t kOldestPackedFormatVersion = 5, kPackedCertificateFormatVersion = 7,
                               kPackedFormatVersion = 9;
inline constexpr std::size_t kChunkAlignment = 64;
inline constexpr std::array<unsigned char, 8> kBakeMagic = {0x89, 'R', 'L', 'M', '\r', '\n', 0x1A, '\n'};

// The files that are made of chunks. They differ in their magic, and count versions of their own.
struct ChunkFileType {
  std::array<unsigned char, 8> magic;
  std::uint32_t oldestVersion, version;
  const char* name;                                      // as messages have it
  std::array<std::uint32_t, 3> packedVersions{0, 0, 0};  // whose chunks are coded; 0 = none

  bool isPacked(std::uint32_t itsVersion) const {
    return itsVersion != 0 &&
           std::find(packedVersions.begin(), packedVersions.end(), itsVersion) != packedVersions.end();
  }
};
inline constexpr ChunkFileType kBakeFileType{
    kBakeMagic,
    kOldestBakeFormatVersion,
    kPackedFormatVersion,
    "a Relume bake",
    {kOldestPackedFormatVersion, kPackedCertificateFormatVersion, kPackedFormatVersion}};
inline constexpr ChunkFileType kPlanFileType{
    {0x89, 'R', 'L', 'P', '\r', '\n', 0x1A, '\n'}, 4, 4, "the plan of a bake (relume bake --plan)"};
inline constexpr ChunkFileType kShardFileType{
    {0x89, 'R', 'L', 'S', '\r', '\n', 0x1A, '\n'}, 1, 1, "a shard of a bake (relume bake --shard)"};

// What the elements of a chunk are. The numbers stand in the file.
enum class ElementType : std::uint32_t {
  u32 = 1,
  f32 = 2,
  f16 = 3,
  coneLink = 4,      // ConeLink, 12 bytes
  lightmapPart = 5,  // LightmapPart, 24 bytes
  archive = 6,       // bytes of archive.h
};
const char* toString(ElementType type);
std::size_t elementBytes(ElementType type);

// A row of the table. bytes = shape[0] * shape[1] * elementBytes(type), but for chunks that are coded.
struct ChunkInfo {
  std::string name;  // [1..16 characters of a-z and '.']
  ElementType type = ElementType::u32;
  FieldCoding coding = kUncoded;             // of packed bakes alone
  std::array<std::uint64_t, 2> shape{0, 1};  // rows, columns
  std::uint64_t offset = 0;                  // [byte] from the start of the file, a multiple of 64
  std::uint64_t bytes = 0;
  std::uint64_t hash = 0;  // XXH3-64 of the bytes
};

// A chunk to be written, or one that was found.
struct Chunk {
  ChunkInfo info;
  std::span<const std::byte> data;
};

// Lay out the chunks (offset, bytes and hash are filled in) and hand header, table, padding and data to the sink, in
// the order of the file. False when the sink refuses. version: what the header says. packedFrom: of packed bakes.
bool writeChunks(std::span<const Chunk> chunks, const ByteSink& sink, std::uint32_t version = kBakeFormatVersion,
                 const ChunkFileType& type = kBakeFileType, std::uint64_t packedFrom = 0);

// What writeChunks() hands to its sink, as one array; throws std::bad_alloc.
std::vector<std::byte> joinChunks(std::span<const Chunk> chunks, std::uint32_t version = kBakeFormatVersion,
                                  const ChunkFileType& type = kBakeFileType, std::uint64_t packedFrom = 0);

// Header and table of a file, every field checked: names unique, types known, sizes equal to shape, offsets aligned,
// in order, inside the file, without holes; padding zero. The spans point into `file`.
// invalidFile: names header field or chunk, what was expected and found; unsupported: another version or byte order.
// Allocates nothing but the table, which the file's own size bounds, from `memory` [not null]; throws std::bad_alloc.
Result<std::pmr::vector<Chunk>> readChunks(std::span<const std::byte> file,
                                           std::pmr::memory_resource* memory = std::pmr::new_delete_resource(),
                                           const ChunkFileType& type = kBakeFileType);

// What the header of a file says that readChunks() has taken: its version; what tells it from others, the hash of
// header and table, which have the hashes of all chunks, or that of the bake that a packed one was made from.
std::uint32_t versionOf(std::span<const std::byte> file);
std::uint64_t identityOf(std::span<const std::byte> file);
// Whether it is a packed bake (writePackedBake()).
bool isPacked(std::span<const std::byte> file);

// invalidFile: names the first chunk whose data does not have the table's hash.
Status verifyChunks(std::span<const Chunk> chunks);

// The table of chunks of a bake's file, for `relume info`, and isPacked() of the file. Errors as readBake().
Result<std::vector<ChunkInfo>> listChunks(const std::filesystem::path& path);
Result<bool> isPackedFile(const std::filesystem::path& path);

}  // namespace relume
