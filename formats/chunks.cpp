// SPDX-License-Identifier: MIT
// See chunks.h.
#include "formats/chunks.h"

#include "formats/decimal.h"
#include "formats/packed_chunks.h"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>

namespace relume {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little endian and used in place");

// No text file starts so, and transfers that change line ends or strip bits destroy it.
constexpr std::uint32_t kEndianMark = 0x01020304;
// Bounds far above any bake's, so that a hostile table costs no time.
constexpr std::uint64_t kMaxChunks = 256;
constexpr std::uint64_t kMaxColumns = 64;

struct FileHeader {
  std::array<unsigned char, 8> magic = kBakeMagic;
  std::uint32_t version = kBakeFormatVersion;
  std::uint32_t endianMark = kEndianMark;
  std::uint32_t headerBytes = 64;
  std::uint32_t chunkCount = 0;
  std::uint64_t fileBytes = 0;
  std::uint64_t tableHash = 0;   // XXH3-64 of header and table, this field taken as zero
  std::uint64_t packedFrom = 0;  // the table hash of the bake that was packed, in packed ones
  std::array<std::uint64_t, 2> reserved{};
};
static_assert(sizeof(FileHeader) == 64 && offsetof(FileHeader, tableHash) == 32);

struct TableRow {
  std::array<char, 16> name{};
  std::uint32_t type = 0;
  std::uint32_t coding = 0;
  std::array<std::uint64_t, 2> shape{};
  std::uint64_t offset = 0, bytes = 0, hash = 0;
};
static_assert(sizeof(TableRow) == 64 && offsetof(TableRow, offset) == 40 && offsetof(TableRow, hash) == 56);

Error expectedFound(const std::string& what, const std::string& expected, const std::string& found) {
  return invalidFile(what + ": expected " + expected + ", found " + found);
}

Error expectedFound(const std::string& what, std::uint64_t expected, std::uint64_t found) {
  return expectedFound(what, std::to_string(expected), std::to_string(found));
}

constexpr std::uint64_t alignUp(std::uint64_t offset) {
  return (offset + kChunkAlignment - 1) / kChunkAlignment * kChunkAlignment;
}

std::uint64_t hashOf(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

// Hash of header and table with the header's own hash field zero.
std::uint64_t hashTable(FileHeader header, std::span<const std::byte> table, std::pmr::memory_resource* memory) {
  header.tableHash = 0;
  std::pmr::vector<std::byte> bytes(sizeof(header) + table.size(), memory);
  std::memcpy(bytes.data(), &header, sizeof(header));
  if (!table.empty()) std::memcpy(bytes.data() + sizeof(header), table.data(), table.size());
  return hashOf(bytes);
}

bool beginsAs(std::span<const std::byte> file, const ChunkFileType& type) {
  return std::memcmp(file.data(), type.magic.data(), std::min(file.size(), type.magic.size())) == 0;
}

std::string versionsOf(const ChunkFileType& type) {
  if (type.oldestVersion == type.version) return "version " + std::to_string(type.version);
  return "versions " + std::to_string(type.oldestVersion) + " to " + std::to_string(type.version);
}

Result<FileHeader> readHeader(std::span<const std::byte> file, const ChunkFileType& type) {
  FileHeader header;
  if (file.empty()) return invalidFile("empty file");
  if (!beginsAs(file, type)) {
    const char* found = "something else";
    for (const ChunkFileType* other : {&kBakeFileType, &kPlanFileType, &kShardFileType}) {
      if (file.size() >= other->magic.size() && beginsAs(file, *other)) found = other->name;
    }
    if (file.size() >= 2 && file[0] == std::byte{0x1F} && file[1] == std::byte{0x8B})
      found = "a file of gzip: unpack it by gunzip first";
    return expectedFound("header magic", type.name, found);
  }
  if (file.size() < sizeof(header)) return expectedFound("header: truncated", "64 bytes", std::to_string(file.size()));
  std::memcpy(&header, file.data(), sizeof(header));
  if (header.endianMark != kEndianMark) {
    if (header.endianMark == 0x04030201) return Error{ErrorCode::unsupported, "header: the file is big endian"};
    return expectedFound("header byte-order mark", kEndianMark, header.endianMark);
  }
  if (header.version < type.oldestVersion || header.version > type.version)
    return Error{ErrorCode::unsupported,
                 "format version " + std::to_string(header.version) + ", this program reads " + versionsOf(type)};
  if (header.headerBytes != sizeof(header)) return expectedFound("header size", sizeof(header), header.headerBytes);
  if (header.fileBytes != file.size())
    return expectedFound(file.size() < header.fileBytes ? "file size: truncated" : "file size: bytes were appended",
                         header.fileBytes, file.size());
  if (header.reserved != std::array<std::uint64_t, 2>{} || (header.packedFrom != 0 && !type.isPacked(header.version)))
    return invalidFile("header: reserved bytes are not zero");
  const std::uint64_t max = std::min<std::uint64_t>(kMaxChunks, (file.size() - sizeof(header)) / sizeof(TableRow));
  if (header.chunkCount > max)
    return expectedFound("header chunk count", "at most " + std::to_string(max), std::to_string(header.chunkCount));
  return header;
}

Result<ChunkInfo> readRow(const TableRow& row, std::size_t index, bool packed) {
  const auto end = std::find(row.name.begin(), row.name.end(), '\0');
  const bool padded = std::all_of(end, row.name.end(), [](char c) { return c == '\0'; });
  const bool legible = std::all_of(row.name.begin(), end, [](char c) { return (c >= 'a' && c <= 'z') || c == '.'; });
  if (end == row.name.begin() || !padded || !legible)
    return invalidFile("chunk table row " + std::to_string(index) + ": name is not 1 to 16 of a-z and '.'");

  ChunkInfo info{std::string(row.name.begin(), end),
                 static_cast<ElementType>(row.type),
                 row.coding,
                 row.shape,
                 row.offset,
                 row.bytes,
                 row.hash};
  const std::size_t size = elementBytes(info.type);
  if (size == 0) return invalidFile("chunk " + info.name + ": unknown element type " + std::to_string(row.type));
  if (row.coding != 0 && !packed) return invalidFile("chunk " + info.name + ": reserved bytes are not zero");
  const std::uint64_t rows = row.shape[0], columns = row.shape[1];
  const bool narrow = columns >= 1 && columns <= kMaxColumns;
  const auto expected = narrow ? storedBytes(info.type, row.shape, row.coding) : std::nullopt;
  if (!expected || *expected != row.bytes)
    return expectedFound("chunk " + info.name + " size",
                         std::to_string(rows) + " x " + std::to_string(columns) + " " + toString(info.type) + " of " +
                             std::to_string(size) + " bytes" +
                             (row.coding != 0 ? ", packed by coding " + hexadecimal(row.coding) : ""),
                         std::to_string(row.bytes) + " bytes");
  return info;
}

// Offset and size against the file and the chunk before. `end` is where that one ended.
Status checkPlace(const ChunkInfo& info, std::uint64_t end, std::span<const std::byte> file) {
  if (info.offset % kChunkAlignment != 0)
    return expectedFound("chunk " + info.name + " offset: misaligned", "a multiple of 64", std::to_string(info.offset));
  if (info.offset > file.size() || info.bytes > file.size() - info.offset)
    return expectedFound("chunk " + info.name + ": reaches out of the file",
                         "an end within " + std::to_string(file.size()) + " bytes",
                         std::to_string(info.bytes) + " bytes at " + std::to_string(info.offset));
  if (info.offset < end)
    return expectedFound("chunk " + info.name + " offset: overlaps what lies before it",
                         "at least " + std::to_string(end), std::to_string(info.offset));
  if (info.offset != alignUp(end))
    return expectedFound("chunk " + info.name + " offset: leaves a hole", alignUp(end), info.offset);
  const auto padding = file.subspan(static_cast<std::size_t>(end), static_cast<std::size_t>(info.offset - end));
  if (std::any_of(padding.begin(), padding.end(), [](std::byte b) { return b != std::byte{0}; }))
    return invalidFile("chunk " + info.name + ": padding before it is not zero");
  return done();
}

}  // namespace

const char* toString(ElementType type) {
  switch (type) {
    case ElementType::u32:
      return "u32";
    case ElementType::f32:
      return "f32";
    case ElementType::f16:
      return "f16";
    case ElementType::coneLink:
      return "coneLink";
    case ElementType::lightmapPart:
      return "lightmapPart";
    case ElementType::archive:
      return "archive";
  }
  return "unknown";
}

std::size_t elementBytes(ElementType type) {
  switch (type) {
    case ElementType::u32:
    case ElementType::f32:
      return 4;
    case ElementType::f16:
      return 2;
    case ElementType::coneLink:
      return 12;
    case ElementType::lightmapPart:
      return 24;
    case ElementType::archive:
      return 1;
  }
  return 0;
}

bool writeChunks(std::span<const Chunk> chunks, const ByteSink& sink, std::uint32_t version, const ChunkFileType& type,
                 std::uint64_t packedFrom) {
  // Lay out: each chunk starts at the next multiple of 64; the file ends with the last byte of the last chunk.
  FileHeader header;
  header.magic = type.magic;
  header.version = version;
  header.packedFrom = packedFrom;
  header.chunkCount = static_cast<std::uint32_t>(chunks.size());
  std::vector<TableRow> table;
  std::uint64_t end = sizeof(FileHeader) + chunks.size() * sizeof(TableRow);
  for (const Chunk& chunk : chunks) {
    TableRow row;
    std::copy(chunk.info.name.begin(), chunk.info.name.end(), row.name.begin());
    row.type = static_cast<std::uint32_t>(chunk.info.type);
    row.coding = chunk.info.coding;
    row.shape = chunk.info.shape;
    row.offset = alignUp(end);
    row.bytes = chunk.data.size();
    row.hash = hashOf(chunk.data);
    end = row.offset + row.bytes;
    table.push_back(row);
  }
  header.fileBytes = end;
  const auto tableBytes = std::as_bytes(std::span<const TableRow>(table));
  header.tableHash = hashTable(header, tableBytes, std::pmr::new_delete_resource());

  // Write front to back.
  if (!sink(std::as_bytes(std::span<const FileHeader>(&header, 1))) || !sink(tableBytes)) return false;
  constexpr std::array<std::byte, kChunkAlignment> kZeros{};
  std::uint64_t at = sizeof(FileHeader) + tableBytes.size();
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    if (!sink(std::span(kZeros).first(static_cast<std::size_t>(table[i].offset - at))) || !sink(chunks[i].data))
      return false;
    at = table[i].offset + table[i].bytes;
  }
  return true;
}

std::vector<std::byte> joinChunks(std::span<const Chunk> chunks, std::uint32_t version, const ChunkFileType& type,
                                  std::uint64_t packedFrom) {
  std::uint64_t bytes = sizeof(FileHeader) + chunks.size() * sizeof(TableRow);
  for (const Chunk& chunk : chunks) bytes = alignUp(bytes) + chunk.data.size();
  std::vector<std::byte> file;
  file.reserve(static_cast<std::size_t>(bytes));
  const ByteSink append = [&file](std::span<const std::byte> more) {
    file.insert(file.end(), more.begin(), more.end());
    return true;
  };
  writeChunks(chunks, append, version, type, packedFrom);
  return file;
}

Result<std::pmr::vector<Chunk>> readChunks(std::span<const std::byte> file, std::pmr::memory_resource* memory,
                                           const ChunkFileType& type) {
  const Result<FileHeader> header = readHeader(file, type);
  if (!header) return header.error();
  const auto tableBytes = file.subspan(sizeof(FileHeader), header->chunkCount * sizeof(TableRow));
  std::pmr::vector<Chunk> chunks(memory);
  chunks.reserve(header->chunkCount);
  std::uint64_t end = sizeof(FileHeader) + tableBytes.size();
  for (std::size_t i = 0; i < header->chunkCount; ++i) {
    TableRow row;
    std::memcpy(&row, tableBytes.data() + i * sizeof(TableRow), sizeof(row));
    const Result<ChunkInfo> info = readRow(row, i, type.isPacked(header->version));
    if (!info) return info.error();
    if (std::any_of(chunks.begin(), chunks.end(), [&](const Chunk& c) { return c.info.name == info->name; }))
      return invalidFile("chunk " + info->name + ": appears twice");
    if (const Status place = checkPlace(*info, end, file); !place) return place.error();
    end = info->offset + info->bytes;
    chunks.push_back(
        {*info, file.subspan(static_cast<std::size_t>(info->offset), static_cast<std::size_t>(info->bytes))});
  }
  if (end != file.size()) return expectedFound("file: bytes after the last chunk", end, file.size());
  if (const std::uint64_t hash = hashTable(*header, tableBytes, memory); hash != header->tableHash)
    return expectedFound("header and chunk table checksum", hexadecimal(header->tableHash), hexadecimal(hash));
  return chunks;
}

std::uint32_t versionOf(std::span<const std::byte> file) {
  FileHeader header;
  std::memcpy(&header, file.data(), sizeof(header));
  return header.version;
}

std::uint64_t identityOf(std::span<const std::byte> file) {
  FileHeader header;
  std::memcpy(&header, file.data(), sizeof(header));
  return header.packedFrom != 0 ? header.packedFrom : header.tableHash;
}

bool isPacked(std::span<const std::byte> file) { return kBakeFileType.isPacked(versionOf(file)); }

Status verifyChunks(std::span<const Chunk> chunks) {
  for (const Chunk& chunk : chunks) {
    if (const std::uint64_t hash = hashOf(chunk.data); hash != chunk.info.hash)
      return expectedFound("chunk " + chunk.info.name + " checksum", hexadecimal(chunk.info.hash), hexadecimal(hash));
  }
  return done();
}

}  // namespace relume
