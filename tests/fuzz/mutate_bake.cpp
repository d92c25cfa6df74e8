// SPDX-License-Identifier: MIT
// See mutate_bake.h.
#include "tests/fuzz/mutate_bake.h"

#include "formats/chunks.h"
#include "relume/bake_file.h"
#include "tests/formats/corrupt_file.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

namespace relume::fuzz {
namespace {

using RelumeBytes = relume::Bytes;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::array<float, 30> kFloats = {
    0.0f,   -0.0f,     1.0f,       -1.0f,     0.5f,       2.0f,
    -2.0f,  1e-45f,    1e-38f,     1e-20f,    1e-8f,      1e-3f,
    0.999f, 1.01f,     1e3f,       65504.0f,  65536.0f,   1e6f,
    9e8f,   -9e8f,     1.1e9f,     1e12f,     1e19f,      1e30f,
    -1e30f, 3.402e38f, -3.402e38f, kInfinity, -kInfinity, std::numeric_limits<float>::quiet_NaN()};
constexpr std::array<std::uint16_t, 10> kHalves = {0,      0x8000, 0x0001, 0x3C00, 0xBC00,
                                                   0x7BFF, 0xFBFF, 0x7C00, 0xFC00, 0x7E00};

template <class T>
T at(const Bytes& data, std::size_t offset) {
  T value;
  std::memcpy(&value, &data[offset], sizeof(T));
  return value;
}

template <class T>
void put(Bytes& data, std::size_t offset, T value) {
  std::memcpy(&data[offset], &value, sizeof(T));
}

// A word as an index may be: an edge of its type, the size of some chunk, near what it is, or a few bits of it.
std::uint32_t changedIndex(std::uint32_t old, std::span<const Chunk> chunks, Random& random) {
  constexpr std::array<std::uint32_t, 12> kEdges = {0,           1,           2,           0x7FFFFFFFu,
                                                    0x80000000u, 0x80000001u, 0xFFFFFFFCu, 0xFFFFFFFDu,
                                                    0xFFFFFFFEu, 0xFFFFFFFFu, 0x3FFFFFu,   0xFFFFu};
  const auto rows = static_cast<std::uint32_t>(chunks[random() % chunks.size()].info.shape[0]);
  switch (random() % 8) {
    case 0:
    case 1:
      return kEdges[random() % kEdges.size()];
    case 2:
      return rows;
    case 3:
      return rows - 1;
    case 4:
      return rows == 0 ? 0 : static_cast<std::uint32_t>(random()) % rows;
    case 5:
      return old + 1;
    case 6:
      return old - 1;
    default:
      return old ^ (1u << (random() % 32));
  }
}

float changedFloat(float old, Random& random) {
  switch (random() % 6) {
    case 0:
      return old * (random() % 2 ? -1.0f : 2.0f);
    case 1:
      return old + (random() % 2 ? 1.0f : 1e-3f);
    case 2:
      return static_cast<float>(random() % 1000) / 100.0f;
    default:
      return kFloats[random() % kFloats.size()];
  }
}

// One number of a chunk by its type. Archives begin with their version; what follows is taken for words and floats.
void changeNumber(Bytes& data, ElementType type, std::span<const Chunk> chunks, Random& random) {
  const bool archive = type == ElementType::archive;
  if (type == ElementType::f16) {
    const std::size_t offset = 2 * (random() % (data.size() / 2));
    return put<std::uint16_t>(data, offset,
                              random() % 2 ? kHalves[random() % kHalves.size()] : static_cast<std::uint16_t>(random()));
  }
  if (data.size() < (archive ? 8u : 4u)) return;
  const std::size_t offset =
      archive && random() % 2 ? random() % (data.size() - 3) : 4 * (random() % (data.size() / 4));
  if (type == ElementType::f32 || (archive && random() % 2))
    return put(data, offset, changedFloat(at<float>(data, offset), random));
  put(data, offset, changedIndex(at<std::uint32_t>(data, offset), chunks, random));
}

// Two elements change places, or one takes the place of another.
void moveElements(Bytes& data, std::size_t bytes, Random& random) {
  const std::size_t count = data.size() / bytes;
  const std::size_t a = bytes * (random() % count), b = bytes * (random() % count);
  const auto from = data.begin() + static_cast<std::ptrdiff_t>(a), to = data.begin() + static_cast<std::ptrdiff_t>(b);
  if (a == b) return;
  if (random() % 2) {
    std::swap_ranges(from, from + static_cast<std::ptrdiff_t>(bytes), to);
  } else {
    std::copy_n(Bytes(from, from + static_cast<std::ptrdiff_t>(bytes)).begin(), bytes, to);
  }
}

Bytes layOut(std::span<const Chunk> chunks, std::size_t max) {
  Bytes out;
  writeChunks(chunks, [&](std::span<const std::byte> bytes) {
    const auto* first = reinterpret_cast<const std::uint8_t*>(bytes.data());
    out.insert(out.end(), first, first + bytes.size());
    return out.size() <= max;
  });
  return out;
}

// Another content for one chunk, of the same size or of whole rows more or less; the file is laid out anew.
Bytes changeChunk(std::span<const Chunk> chunks, std::size_t max, Random& random) {
  std::vector<Chunk> changed(chunks.begin(), chunks.end());
  Chunk& chunk = changed[random() % changed.size()];
  const std::size_t element = elementBytes(chunk.info.type);
  const std::size_t row = std::max<std::size_t>(static_cast<std::size_t>(chunk.info.shape[1]) * element, 1);
  Bytes data(chunk.data.size());
  if (!data.empty()) std::memcpy(data.data(), chunk.data.data(), data.size());
  const unsigned way = static_cast<unsigned>(random() % 8);
  if (data.empty() || way == 0) {
    mutateBytes(data, data.size() + 4 * row);
    data.resize(data.size() / row * row);
  } else if (way == 1) {
    mutateBytes(data, data.size());
    data.resize(chunk.data.size());
  } else if (way == 2) {
    moveElements(data, random() % 2 && data.size() >= row ? row : element, random);
  } else {
    for (unsigned left = 1 + static_cast<unsigned>(random() % 3); left > 0; --left)
      changeNumber(data, chunk.info.type, chunks, random);
  }
  chunk.data = std::as_bytes(std::span(data));
  chunk.info.shape[0] = data.size() / row;
  return layOut(changed, max);
}

// The JSON of the options, and names, where the bake can be read. Empty where it cannot.
Bytes changeTexts(std::span<const std::byte> file, Random& random) {
  constexpr std::array<const char*, 8> kWords = {"links",  "kind", "surfels", "count",
                                                 "caches", "seed", "oct6",    "\x1b[2J"};
  Result<Bake> bake = parseBake(file, nullptr, Checksums::skip);
  if (!bake) return {};
  std::string& options = bake->provenance.optionsJson;
  if (bake->instances.empty() || random() % 4 != 0) {
    options = mutateJson(options.empty() ? "{\"links\":{\"kind\":\"oct6\"}}" : options, 4096, kWords, random);
  } else {
    std::vector<BakedInstance> instances = bake->instances.toVector();
    instances[random() % instances.size()].node = kWords[random() % kWords.size()];
    bake->instances = instances;
  }
  const Result<std::vector<std::byte>> again = serializeBake(*bake);
  if (!again) return {};
  const auto* first = reinterpret_cast<const std::uint8_t*>(again->data());
  return {first, first + again->size()};
}

// Header and table, or any bytes, with the checksums made to fit more often than not.
Bytes changeHead(std::span<const std::uint8_t> file, bool anywhere, std::size_t max, Random& random) {
  const std::size_t head = anywhere ? file.size() : std::min<std::size_t>(file.size(), kHeaderBytes + 30 * kRowBytes);
  Bytes front(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(head));
  mutateBytes(front, anywhere ? max : head);
  Bytes raw = front;
  raw.insert(raw.end(), file.begin() + static_cast<std::ptrdiff_t>(head), file.end());
  if (random() % 4 == 0) return raw;
  RelumeBytes sealed(raw.size());
  if (!raw.empty()) std::memcpy(sealed.data(), raw.data(), raw.size());
  if (sealed.size() >= kHeaderBytes && random() % 2) putAt<std::uint64_t>(sealed, 24, sealed.size());
  reseal(sealed);
  if (!raw.empty()) std::memcpy(raw.data(), sealed.data(), raw.size());
  return raw;
}

}  // namespace

Bytes mutateBake(std::span<const std::uint8_t> file, std::size_t max, Random& random) {
  const std::span<const std::byte> bytes = std::as_bytes(file);
  const unsigned way = static_cast<unsigned>(random() % 16);
  if (way == 3) {
    const Bytes changed = changeTexts(bytes, random);
    if (!changed.empty() && changed.size() <= max) return changed;
  }
  if (way >= 3) {
    const auto chunks = readChunks(bytes);
    if (chunks && !chunks->empty()) {
      const Bytes changed = changeChunk(*chunks, max, random);
      if (changed.size() <= max) return changed;
    }
  }
  return changeHead(file, way == 0, max, random);
}

}  // namespace relume::fuzz
