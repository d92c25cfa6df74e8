// SPDX-License-Identifier: MIT
// A bake as a file (formats/README.md): written atomically, read into memory or mapped and used in place. What comes
// back is safe to index: sizes, indices and the shape of the tree are always checked (validate.h, checkStructure());
// whether the numbers make sense is validateBake()'s question.
//
// Errors of all readers: io: no such file, no permission; invalidFile: not a bake, truncated, damaged: names chunk or
// field, what was expected and found; unsupported: another format version or byte order; memory: there was not enough.
// Memory taken is at most a small multiple of the file's size. Any thread.
//
// The last parameter of the readers that make a Bake is where memory comes from; null = the global operators new and
// delete. What loading takes and what a bake keeps go through it: the bytes of readBake(), the list of instances, what
// the checks need meanwhile. Exempt are the mapped file itself, a few hundred bytes while names are read, and the texts
// of names, provenance and errors, which are std::string. It must outlive the bake, every copy of one of its arrays and
// so every Relighter made from it, and it is called on the thread that loads and on the one that destroys the last of
// these.
#pragma once

#include "relume/bake_data.h"
#include "relume/result.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume {

// Write through a temporary in the same folder and a rename: the path holds the old file or the whole new one.
// Same bake, same bytes. io: not writable; failed: the bake breaks an invariant that a reader would refuse.
Status writeBake(const Bake& bake, const std::filesystem::path& path);

// The file's bytes in memory. Errors as writeBake().
Result<std::vector<std::byte>> serializeBake(const Bake& bake);

// The same bake packed: regrouped and shortened, without loss, so that gzip, Brotli or zstd make it far smaller, for
// bakes that travel (formats/README.md; docs/notes/packing.md). All readers take packed files, and unpack them into
// memory: they are not used in place. packedFrom: identifyBakeFile() of the bake's own file, or of the one that this
// bake was simplified from; a packed file answers to the same number. Errors as above.
Status writePackedBake(const Bake& bake, std::uint64_t packedFrom, const std::filesystem::path& path);
Result<std::vector<std::byte>> serializePackedBake(const Bake& bake, std::uint64_t packedFrom);

// Whether the data is compared with its XXH3 sums: one pass over the file, about 10 GB/s.
enum class Checksums { verify, skip };

// Read into memory.
Result<Bake> readBake(const std::filesystem::path& path, Checksums checksums = Checksums::verify,
                      std::pmr::memory_resource* memory = nullptr);

// Map read-only; the bake's arrays borrow the mapping and keep it alive. The file must not be shortened meanwhile
// (replacing it by rename, as writeBake() does, is safe). Packed files are unpacked into memory and not kept.
Result<Bake> mapBake(const std::filesystem::path& path, Checksums checksums = Checksums::verify,
                     std::pmr::memory_resource* memory = nullptr);

// From bytes that `owner` keeps alive: for games with an own file system. Nothing is copied, but of packed files, whose
// bytes are not needed any more. usage: the bytes are not aligned to 8.
Result<Bake> parseBake(std::span<const std::byte> bytes, const std::shared_ptr<const void>& owner,
                       Checksums checksums = Checksums::verify, std::pmr::memory_resource* memory = nullptr);

// What tells one bake file from another: the XXH3-64 of header and table in its header (formats/README.md), which
// covers the sums of all chunks. Same bytes, same number; a packed bake has that of the one it was packed from.
Result<std::uint64_t> identifyBakeFile(const std::filesystem::path& path);

}  // namespace relume
