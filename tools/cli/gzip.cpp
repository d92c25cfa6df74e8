// SPDX-License-Identifier: MIT
// See gzip.h.
#include "tools/cli/gzip.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <limits>

namespace relume {

Result<std::vector<std::byte>> gzip(std::span<const std::byte> bytes) {
  // A packed bake's numbers repeat by few bytes: not to look for short matches, and codes of their own for every 8,000
  // symbols, save more than level 9 does in four times the time (docs/notes/packing.md).
  constexpr int kLevel = 7, kGzipWindow = 15 + 16, kMemoryLevel = 7;
  z_stream stream{};
  if (deflateInit2(&stream, kLevel, Z_DEFLATED, kGzipWindow, kMemoryLevel, Z_FILTERED) != Z_OK)
    return Error{ErrorCode::memory, "out of memory for gzip"};
  std::vector<std::byte> file;
  std::array<std::byte, 1 << 16> piece;
  int state = Z_OK;
  while (state != Z_STREAM_END) {
    // zlib counts what it is given in 32 bits.
    const std::size_t given = std::min<std::size_t>(bytes.size(), std::numeric_limits<uInt>::max());
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(given);
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    state = deflate(&stream, given == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
    bytes = bytes.subspan(given - stream.avail_in);
    file.insert(file.end(), piece.begin(), piece.end() - stream.avail_out);
  }
  deflateEnd(&stream);
  return file;
}

}  // namespace relume
