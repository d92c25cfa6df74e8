// SPDX-License-Identifier: MIT
// libFuzzer: any bytes as a bake file. What parses must validate without a crash and be written again as the same
// bytes. The mutator changes one chunk (also its size), or header and table, and makes offsets and checksums fit again,
// so that mutations reach what lies behind them; some it leaves broken.
#include "formats/bake_file.h"
#include "formats/chunks.h"
#include "formats/validate.h"
#include "tests/formats/corrupt_file.h"
#include "tests/fuzz/mutate.h"

#include <algorithm>
#include <cstdlib>

using namespace relume;

namespace {

using Raw = fuzz::Bytes;

// Another content for one chunk, of the same size or of whole rows more or less; the file is laid out anew.
Raw changeChunk(const std::vector<Chunk>& chunks, std::size_t most, fuzz::Random& random) {
  std::vector<Chunk> changed = chunks;
  Chunk& chunk = changed[random() % changed.size()];
  const std::size_t row = static_cast<std::size_t>(chunk.info.shape[1]) * elementBytes(chunk.info.type);
  Raw data(chunk.data.size());
  if (!data.empty()) std::memcpy(data.data(), chunk.data.data(), data.size());
  const bool resize = data.empty() || random() % 4 == 0;
  fuzz::mutateBytes(data, resize ? data.size() + 4 * row : data.size());
  data.resize(resize ? data.size() / row * row : chunk.data.size());
  chunk.data = std::as_bytes(std::span(data));
  chunk.info.shape[0] = data.size() / row;
  Raw out;
  writeChunks(changed, [&](std::span<const std::byte> bytes) {
    const auto* first = reinterpret_cast<const std::uint8_t*>(bytes.data());
    out.insert(out.end(), first, first + bytes.size());
    return out.size() <= most;
  });
  return out;
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  fuzz::Random random(seed);
  const std::span<const std::byte> file(reinterpret_cast<const std::byte*>(data), size);
  const unsigned way = static_cast<unsigned>(random() % 16);
  if (way >= 3) {
    const Result<std::vector<Chunk>> chunks = readChunks(file);
    if (chunks && !chunks->empty()) {
      const Raw changed = changeChunk(*chunks, most, random);
      if (changed.size() <= most) return fuzz::store(changed, data, most);
    }
  }
  Raw raw(data, data + size);
  const std::size_t head = way == 0 ? size : std::min<std::size_t>(size, kHeaderBytes + 30 * kRowBytes);
  Raw front(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(head));
  fuzz::mutateBytes(front, head == size ? most : head);
  raw.erase(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(head));
  raw.insert(raw.begin(), front.begin(), front.end());
  if (random() % 4 != 0) {
    Bytes sealed(raw.size());
    if (!raw.empty()) std::memcpy(sealed.data(), raw.data(), raw.size());
    if (sealed.size() >= kHeaderBytes && random() % 2) putAt<std::uint64_t>(sealed, 24, sealed.size());
    reseal(sealed);
    if (!raw.empty()) std::memcpy(raw.data(), sealed.data(), raw.size());
  }
  return fuzz::store(raw, data, most);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> file(reinterpret_cast<const std::byte*>(data), size);
  Result<Bake> bake = parseBake(file, nullptr);
  const bool verified = static_cast<bool>(bake);
  if (!verified && bake.error().message.find("checksum") != std::string::npos)
    bake = parseBake(file, nullptr, Checksums::skip);  // what a game that trusts its files would load
  if (!bake) return 0;
  for (const Finding& finding : validateBake(*bake)) {
    if (static_cast<int>(finding.check) < 200) std::abort();  // the reader lets no structural damage through
  }
  const Result<std::vector<std::byte>> again = serializeBake(*bake);
  if (!again || (verified && !std::equal(again->begin(), again->end(), file.begin(), file.end()))) std::abort();
  return 0;
}
