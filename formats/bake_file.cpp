// SPDX-License-Identifier: MIT
// See bake_file.h. One list, kLayout, says which chunks a bake has, in the order of the file.
#include "relume/bake_file.h"
#include "formats/chunks.h"

#include "formats/archive.h"
#include "formats/chunk_arrays.h"
#include "formats/format_version.h"
#include "formats/memory.h"
#include "formats/packed_chunks.h"
#include "formats/validate.h"

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <new>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

namespace relume {
namespace {

// Call visit(chunk name, array) for every array of a bake, in the order of the file.
template <class BakeType, class Visitor>
void forEachArray(BakeType& b, Visitor&& visit) {
  visit("surfel.position", b.surfels.positionWorld);
  visit("surfel.normal", b.surfels.normal);
  visit("surfel.albedo", b.surfels.albedo);
  visit("surfel.emission", b.surfels.emission);
  visit("surfel.receiver", b.surfels.receiver);
  visit("surfel.instance", b.surfels.instance);
  visit("node.child", b.hierarchy.child);
  visit("node.weight", b.hierarchy.firstWeight);
  visit("node.level", b.hierarchy.levelBegin);
  visit("node.leaf", b.hierarchy.leafNode);
  visit("node.group", b.hierarchy.groupRoot);
  visit("sky.direction", b.hierarchy.skyDirection);
  visit("cache.position", b.caches.positionWorld);
  visit("cache.normal", b.caches.normal);
  visit("grid.cache", b.caches.grid.cache);
  visit("grid.brick", b.caches.grid.brick);
  visit("grid.fine", b.caches.grid.fine);
  visit("grid.depth", b.caches.grid.depth);
  visit("map.cache", b.caches.lightmap.cache);
  visit("map.part", b.caches.lightmap.parts);
  visit("map.corner", b.caches.lightmap.cornerUv);
  visit("map.back", b.caches.lightmap.backCornerUv);
  visit("link.row", b.links.rowBegin);
  visit("link.node", b.links.shNode);
  visit("link.sh", b.links.shCoefficients);
  visit("link.cone", b.links.cone);
  visit("link.head", b.links.head);
  visit("link.shape", b.links.shape);
  visit("mesh.shape", b.shapes);
}

// The same for the arrays that only bakes of levels with emitters have.
template <class EmittersType, class Visitor>
void forEachEmitterArray(EmittersType& e, Visitor&& visit) {
  visit("emit.surfel", e.surfel);
  visit("emit.tap", e.tap);
  visit("emit.width", e.tapWidth);
}

// The same for the arrays of a certificate.
template <class CertificateType, class Visitor>
void forEachCertificateArray(CertificateType& c, Visitor&& visit) {
  visit("cert.kind", c.lightKind);
  visit("cert.error", c.squaredError);
  visit("cert.deviation", c.standardError);
  visit("cert.receivers", c.partReceivers);
  visit("cert.part", c.partError);
}

constexpr const char* kScalars = "scalars";
constexpr const char* kMaterials = "emit.material";
constexpr const char* kInstances = "instances";
constexpr const char* kProvenance = "provenance";
constexpr const char* kMapSight = "map.sight";

BakeScalars scalarsOf(const Bake& b) {
  return {b.surfels.areaEach,
          b.caches.grid.resolution,
          b.caches.grid.originWorld,
          b.caches.grid.spacing,
          b.caches.lightmap.width,
          b.caches.lightmap.height,
          static_cast<std::uint32_t>(b.links.kind),
          b.links.bands};
}

void applyScalars(const BakeScalars& s, Bake& b) {
  b.surfels.areaEach = s.surfelAreaEach;
  b.caches.grid.resolution = s.gridResolution;
  b.caches.grid.originWorld = s.gridOriginWorld;
  b.caches.grid.spacing = s.gridSpacing;
  b.caches.lightmap.width = s.lightmapWidth;
  b.caches.lightmap.height = s.lightmapHeight;
  b.links.kind = static_cast<LinkKind>(s.linkKind);
  b.links.bands = s.linkBands;
}

// Columns of a chunk's rows: a constant of the type, but for SH coefficients.
template <class T>
std::uint64_t columnsOf(const char* name, std::uint32_t linkBands) {
  if (std::string_view(name) == "link.sh" && linkBands >= 1) return std::uint64_t{linkBands} * linkBands;
  if (std::string_view(name) == "grid.fine") return kBrickWords;
  if (std::string_view(name) == "mesh.shape") return kShapeWords;
  if (std::string_view(name) == "emit.tap") return kFootprintTaps;
  return StoredElement<T>::columns;
}

using Archives = std::array<std::vector<std::byte>, 4>;

// The chunks of a bake, scalars first, then arrays, then names; `archives` keeps what is not in the bake itself.
Result<std::vector<Chunk>> chunksOf(const Bake& bake, Archives& archives) {
  const std::array<Result<std::vector<std::byte>>, 4> saved = {
      saveArchive(scalarsOf(bake)), saveArchive(bake.emitters.materials), saveArchive(bake.instances),
      saveArchive(bake.provenance)};
  for (std::size_t i = 0; i < saved.size(); ++i) {
    if (!saved[i]) return saved[i].error();
    archives[i] = *saved[i];
  }
  std::vector<Chunk> chunks;
  const auto addArchive = [&](const char* name, const std::vector<std::byte>& bytes) {
    chunks.push_back(archiveChunk(name, bytes));
  };
  addArchive(kScalars, archives[0]);
  const auto addArray = [&](const char* name, const auto& array) {
    using T = typename std::remove_cvref_t<decltype(array)>::value_type;
    chunks.push_back(chunkOf<T>(name, array.span(), columnsOf<T>(name, bake.links.bands)));
  };
  forEachArray(bake, addArray);
  if (!bake.emitters.materials.empty()) {
    addArchive(kMaterials, archives[1]);
    forEachEmitterArray(bake.emitters, addArray);
  }
  addArchive(kInstances, archives[2]);
  addArchive(kProvenance, archives[3]);
  if (!bake.certificate.empty()) forEachCertificateArray(bake.certificate, addArray);
  if (!bake.caches.lightmap.sight.empty()) addArray(kMapSight, bake.caches.lightmap.sight);
  return chunks;
}

Result<Bake> assemble(std::span<const Chunk> chunks, const std::shared_ptr<const void>& owner,
                      std::pmr::memory_resource* memory) {
  Bake bake;
  BakeScalars scalars;
  ChunkReader reader(chunks);
  reader.takeArchive(kScalars, scalars);
  if (!reader.failed() && scalars.linkBands > 8)
    return Error{ErrorCode::invalidFile,
                 "chunk scalars: link bands: expected 0..8, found " + std::to_string(scalars.linkBands)};
  applyScalars(scalars, bake);
  const auto takeArray = [&](const char* name, auto& array) {
    using T = typename std::remove_cvref_t<decltype(array)>::value_type;
    array = reader.takeArray<T>(name, owner, columnsOf<T>(name, scalars.linkBands));
  };
  forEachArray(bake, takeArray);
  if (reader.isNext(kMaterials)) {
    reader.takeArchive(kMaterials, bake.emitters.materials, memory);
    forEachEmitterArray(bake.emitters, takeArray);
  }
  reader.takeArchive(kInstances, bake.instances, memory);
  reader.takeArchive(kProvenance, bake.provenance);
  if (reader.isNext("cert.kind")) forEachCertificateArray(bake.certificate, takeArray);
  if (reader.isNext(kMapSight)) takeArray(kMapSight, bake.caches.lightmap.sight);
  reader.finish();
  if (reader.failed()) return reader.error();
  return bake;
}

Result<Bake> assemblePacked(std::span<const Chunk> chunks, std::pmr::memory_resource* memory) {
  const Result<UnpackedChunks> unpacked = unpackChunks(chunks, memory);
  if (!unpacked) return unpacked.error();
  return assemble(unpacked->chunks, unpacked->owner, memory);
}

// A bake has one file: the version is the least that has what is in it.
Status checkFormatVersion(const Bake& bake, std::span<const std::byte> file) {
  const std::uint32_t version = versionOf(file),
                      expected = isPacked(file) ? packedVersionOf(bake) : formatVersionOf(bake);
  if (version == expected) return done();
  const char* of = !bake.caches.lightmap.sight.empty() ? "a bake whose light map has sight"
                   : !bake.certificate.empty()         ? "a bake with a certificate"
                   : isPacked(file)                    ? "a packed bake without a certificate"
                   : bake.emitters.materials.empty()   ? "a bake without emitters"
                                                       : "a bake with emitters";
  return Error{ErrorCode::invalidFile, "header format version: expected " + std::to_string(expected) + ", of " + of +
                                           ", found " + std::to_string(version)};
}

Result<Bake> named(const std::filesystem::path& path, Result<Bake> result) {
  if (!result) result.error().message = path.string() + ": " + result.error().message;
  return result;
}

}  // namespace

namespace {

// The chunks of a bake as they stand in its file: plain, or packed from the bake that `packedFrom` tells.
class FileChunks {
 public:
  FileChunks(FileChunks&&) = default;  // copies would point into the original
  static Result<FileChunks> of(const Bake& bake, std::optional<std::uint64_t> packedFrom) {
    if (const Status status = checkStructure(bake); !status)
      return Error{ErrorCode::failed, "the bake is broken: " + status.error().message};
    FileChunks file;
    Result<std::vector<Chunk>> chunks = chunksOf(bake, file.archives_);
    if (!chunks) return chunks.error();
    file.version_ = packedFrom ? packedVersionOf(bake) : formatVersionOf(bake);
    file.packedFrom_ = packedFrom.value_or(0);
    if (packedFrom)
      file.chunks_ = packChunks(*chunks, bake.links.kind);
    else
      file.chunks_.chunks = std::move(*chunks);
    return file;
  }

  bool write(const ByteSink& sink) const {
    return writeChunks(chunks_.chunks, sink, version_, kBakeFileType, packedFrom_);
  }
  std::vector<std::byte> join() const { return joinChunks(chunks_.chunks, version_, kBakeFileType, packedFrom_); }

 private:
  FileChunks() = default;

  Archives archives_;
  PackedChunks chunks_;
  std::uint32_t version_ = kBakeFormatVersion;
  std::uint64_t packedFrom_ = 0;
};

Status writeFile(const Bake& bake, std::optional<std::uint64_t> packedFrom, const std::filesystem::path& path) try {
  const auto chunks = FileChunks::of(bake, packedFrom);
  if (!chunks) return Error{chunks.error().code, path.string() + ": not written, " + chunks.error().message};
  return writeFileAtomically(path, [&](const ByteSink& sink) { return chunks->write(sink); });
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Result<std::vector<std::byte>> serialize(const Bake& bake, std::optional<std::uint64_t> packedFrom) try {
  const auto chunks = FileChunks::of(bake, packedFrom);
  if (!chunks) return chunks.error();
  return chunks->join();
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

}  // namespace

Status writeBake(const Bake& bake, const std::filesystem::path& path) { return writeFile(bake, {}, path); }

Result<std::vector<std::byte>> serializeBake(const Bake& bake) { return serialize(bake, {}); }

Status writePackedBake(const Bake& bake, std::uint64_t packedFrom, const std::filesystem::path& path) {
  return writeFile(bake, packedFrom, path);
}

Result<std::vector<std::byte>> serializePackedBake(const Bake& bake, std::uint64_t packedFrom) {
  return serialize(bake, packedFrom);
}

Result<Bake> parseBake(std::span<const std::byte> bytes, const std::shared_ptr<const void>& owner, Checksums checksums,
                       std::pmr::memory_resource* memory) {
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % 8 != 0)
    return Error{ErrorCode::usage, "the memory of a bake must be aligned to 8 bytes"};
  try {
    memory = memoryOr(memory);
    const auto chunks = readChunks(bytes, memory);
    if (!chunks) return chunks.error();
    if (checksums == Checksums::verify) {
      if (const Status status = verifyChunks(*chunks); !status) return status.error();
    }
    Result<Bake> bake = isPacked(bytes) ? assemblePacked(*chunks, memory) : assemble(*chunks, owner, memory);
    if (!bake) return bake;
    if (const Status status = checkFormatVersion(*bake, bytes); !status) return status.error();
    if (const Status status = checkStructure(*bake, memory); !status) return status.error();
    return bake;
  } catch (const std::bad_alloc& e) {
    return outOfMemory(e);
  }
}

namespace {

// What does not begin as a bake is not even mapped, however large it is.
Status checkMagic(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return done();  // mapFile() says what it is
  std::array<char, kBakeMagic.size()> first{};
  std::ifstream file;
  file.rdbuf()->pubsetbuf(nullptr, 0);  // eight bytes need none of the stream's own memory
  file.open(path, std::ios::binary);
  if (!file.read(first.data(), first.size())) return done();
  if (std::memcmp(first.data(), kBakeMagic.data(), first.size()) == 0) return done();
  const auto chunks = readChunks(std::as_bytes(std::span(first)));
  return chunks ? done() : Status(Error{chunks.error().code, path.string() + ": " + chunks.error().message});
}

// visit(chunks, bytes) for the table of a file, which is mapped meanwhile.
template <class Visit>
Status visitChunks(const std::filesystem::path& path, std::pmr::memory_resource* memory, const Visit& visit) {
  if (const Status status = checkMagic(path); !status) return status.error();
  const Result<FileBytes> file = mapFile(path, memory);
  if (!file) return file.error();
  const auto chunks = readChunks(file->bytes, memory);
  if (!chunks) return Error{chunks.error().code, path.string() + ": " + chunks.error().message};
  visit(*chunks, file->bytes);
  return done();
}

// What ask(chunks, bytes) gives.
template <class Ask>
auto askTable(const std::filesystem::path& path, const Ask& ask)
    -> Result<std::invoke_result_t<Ask, std::span<const Chunk>, std::span<const std::byte>>> try {
  std::invoke_result_t<Ask, std::span<const Chunk>, std::span<const std::byte>> answer{};
  const Status status = visitChunks(
      path, std::pmr::new_delete_resource(),
      [&](std::span<const Chunk> chunks, std::span<const std::byte> bytes) { answer = ask(chunks, bytes); });
  if (!status) return status.error();
  return answer;
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

}  // namespace

Result<Bake> readBake(const std::filesystem::path& path, Checksums checksums, std::pmr::memory_resource* memory) try {
  memory = memoryOr(memory);
  // Header and table first: what is no bake is not read into memory.
  if (const Status status = visitChunks(path, memory, [](auto&&...) {}); !status) return status.error();
  const Result<FileBytes> file = readFile(path, std::numeric_limits<std::size_t>::max(), memory);
  if (!file) return file.error();
  return named(path, parseBake(file->bytes, file->owner, checksums, memory));
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Result<Bake> mapBake(const std::filesystem::path& path, Checksums checksums, std::pmr::memory_resource* memory) try {
  if (const Status status = checkMagic(path); !status) return status.error();
  const Result<FileBytes> file = mapFile(path, memoryOr(memory));
  if (!file) return file.error();
  return named(path, parseBake(file->bytes, file->owner, checksums, memory));
} catch (const std::bad_alloc& e) {
  return outOfMemory(e);
}

Result<std::uint64_t> identifyBakeFile(const std::filesystem::path& path) {
  return askTable(path, [](auto&&, std::span<const std::byte> file) { return identityOf(file); });
}

Result<bool> isPackedFile(const std::filesystem::path& path) {
  return askTable(path, [](auto&&, std::span<const std::byte> file) { return isPacked(file); });
}

Result<std::vector<ChunkInfo>> listChunks(const std::filesystem::path& path) {
  return askTable(path, [](std::span<const Chunk> chunks, auto&&) {
    std::vector<ChunkInfo> list;
    for (const Chunk& chunk : chunks) list.push_back(chunk.info);
    return list;
  });
}

}  // namespace relume
