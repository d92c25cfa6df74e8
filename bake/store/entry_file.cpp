// SPDX-License-Identifier: MIT
// See entry_file.h.
#include "bake/store/entry_file.h"

#include "formats/decimal.h"
#include "formats/file_io.h"

#include <xxhash.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace relume {
namespace {

static_assert(std::endian::native == std::endian::little, "entries are little-endian");

constexpr std::array<unsigned char, 8> kMagic = {0x89, 'R', 'L', 'E', '\r', '\n', 0x1A, '\n'};
constexpr std::size_t kHeaderBytes = kEntryHeaderBytes, kHashedBytes = 48;
constexpr int kLevel = 1;  // 400 MB/s; level 3 saves 3 % more of a block of links, and takes twice as long

struct Header {
  std::array<unsigned char, 8> magic = kMagic;
  std::uint32_t version = kEntryVersion, zero = 0;
  std::uint64_t nameHigh = 0, nameLow = 0, size = 0, zero2 = 0, hashHigh = 0, hashLow = 0;
};
static_assert(sizeof(Header) == kHeaderBytes);

Result<Header> readHeader(std::span<const std::byte> file) {
  Header header;
  if (file.size() < kHeaderBytes) return invalidFile("cut to " + std::to_string(file.size()) + " bytes");
  if (!beginsAsEntry(file)) return invalidFile("not an entry of a store");
  std::memcpy(&header, file.data(), kHeaderBytes);
  if (header.version != kEntryVersion)
    return invalidFile("of version " + std::to_string(header.version) + ", expected " + std::to_string(kEntryVersion));
  return header;
}

XXH128_hash_t hashOf(const Header& header, std::span<const std::byte> frame) {
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(), XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_128bits_reset(state.get());
  XXH3_128bits_update(state.get(), &header, kHashedBytes);
  XXH3_128bits_update(state.get(), frame.data(), frame.size());
  return XXH3_128bits_digest(state.get());
}

}  // namespace

std::string toString(const EntryName& name) { return hexadecimal(name.high) + hexadecimal(name.low); }

EntryName nameEntry(std::span<const std::byte> madeFrom) {
  const XXH128_hash_t hash = XXH3_128bits(madeFrom.data(), madeFrom.size());
  return {hash.high64, hash.low64};
}

Result<std::vector<std::byte>> sealEntry(const EntryName& name, std::span<const std::byte> bytes) {
  std::vector<std::byte> file(kHeaderBytes + ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress(file.data() + kHeaderBytes, file.size() - kHeaderBytes, bytes.data(), bytes.size(), kLevel);
  if (ZSTD_isError(size) != 0) return Error{ErrorCode::failed, std::string("zstd: ") + ZSTD_getErrorName(size)};
  file.resize(kHeaderBytes + size);
  Header header;
  header.nameHigh = name.high;
  header.nameLow = name.low;
  header.size = bytes.size();
  const XXH128_hash_t hash = hashOf(header, std::span(file).subspan(kHeaderBytes));
  header.hashHigh = hash.high64;
  header.hashLow = hash.low64;
  std::memcpy(file.data(), &header, kHeaderBytes);
  return file;
}

bool beginsAsEntry(std::span<const std::byte> beginning) {
  return beginning.size() >= kMagic.size() && std::memcmp(beginning.data(), kMagic.data(), kMagic.size()) == 0;
}

Result<std::uint64_t> mostEntryBytes(std::span<const std::byte> beginning) {
  constexpr std::uint64_t kMost = 1ull << 62;  // sums below stay within 64 bits
  const Result<Header> header = readHeader(beginning);
  if (!header) return header.error();
  return kHeaderBytes + std::uint64_t{ZSTD_compressBound(std::min(header->size, kMost))};
}

Status checkEntrySize(std::uint64_t bytes, std::uint64_t most, std::uint64_t maxBytes) {
  const std::string has = "it has " + std::to_string(bytes) + " bytes, ";
  if (bytes > most) return invalidFile(has + "by its header at most " + std::to_string(most));
  if (bytes <= maxBytes) return done();
  return Error{ErrorCode::memory, has + "at most " + std::to_string(maxBytes) + " can be read"};
}

Result<std::uint64_t> checkEntry(const EntryName& name, std::span<const std::byte> file) {
  const Result<Header> header = readHeader(file);
  if (!header) return header.error();
  const XXH128_hash_t hash = hashOf(*header, file.subspan(kHeaderBytes));
  if (hash.high64 != header->hashHigh || hash.low64 != header->hashLow) return invalidFile("damaged: wrong checksum");
  if (header->nameHigh != name.high || header->nameLow != name.low)
    return invalidFile("the entry of another name, " + toString({header->nameHigh, header->nameLow}));
  return header->size;
}

Result<EntryBytes> openEntry(std::span<const std::byte> file) {
  Header header;
  std::memcpy(&header, file.data(), kHeaderBytes);
  const std::span<const std::byte> frame = file.subspan(kHeaderBytes);
  // Before anything is allocated: both must say the same size, and the frame must be one.
  const unsigned long long stated = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (stated == ZSTD_CONTENTSIZE_ERROR || stated == ZSTD_CONTENTSIZE_UNKNOWN || stated != header.size)
    return invalidFile("its frame is not of " + std::to_string(header.size) + " bytes");
  const auto words = std::make_shared<std::vector<std::uint64_t>>((header.size + 7) / 8);
  const std::size_t size = ZSTD_decompress(words->data(), header.size, frame.data(), frame.size());
  if (ZSTD_isError(size) != 0 || size != header.size)
    return invalidFile("its frame cannot be unpacked" +
                       (ZSTD_isError(size) != 0 ? std::string(": ") + ZSTD_getErrorName(size) : std::string()));
  return EntryBytes{words, std::as_bytes(std::span(*words)).first(header.size)};
}

}  // namespace relume
