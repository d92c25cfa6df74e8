// SPDX-License-Identifier: MIT
// Arrays of plain elements as chunks of a file, and chunks taken back in their order. For bakes, plans and shards.
#pragma once

#include "formats/archive.h"
#include "formats/chunks.h"
#include "relume/array.h"
#include "relume/caches.h"
#include "relume/links.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace relume {

// How the elements of an Array<T> stand in the file.
template <class T>
struct StoredElement;
template <>
struct StoredElement<std::uint32_t> {
  static constexpr ElementType type = ElementType::u32;
  static constexpr std::uint64_t columns = 1;
};
template <>
struct StoredElement<float> {
  static constexpr ElementType type = ElementType::f32;
  static constexpr std::uint64_t columns = 1;
};
template <>
struct StoredElement<glm::vec3> {
  static constexpr ElementType type = ElementType::f32;
  static constexpr std::uint64_t columns = 3;
};
template <>
struct StoredElement<std::uint16_t> {
  static constexpr ElementType type = ElementType::f16;
  static constexpr std::uint64_t columns = 1;  // links.sh: bands², by the scalars
};
template <>
struct StoredElement<ConeLink> {
  static constexpr ElementType type = ElementType::coneLink;
  static constexpr std::uint64_t columns = 1;
};
template <>
struct StoredElement<LightmapPart> {
  static constexpr ElementType type = ElementType::lightmapPart;
  static constexpr std::uint64_t columns = 1;
};
static_assert(sizeof(glm::vec3) == 12 && sizeof(LightmapPart) == 24);
static_assert(std::is_trivially_copyable_v<ConeLink> && std::is_trivially_copyable_v<LightmapPart>);

// A chunk of elements whose memory must outlive it.
template <class T>
Chunk chunkOf(const char* name, std::span<const T> elements, std::uint64_t columns = StoredElement<T>::columns) {
  constexpr ElementType type = StoredElement<T>::type;
  const auto data = std::as_bytes(elements);
  return {{name, type, kUncoded, {data.size() / (columns * elementBytes(type)), columns}, 0, 0, 0}, data};
}
inline Chunk archiveChunk(const char* name, std::span<const std::byte> bytes) {
  return {{name, ElementType::archive, kUncoded, {bytes.size(), 1}, 0, 0, 0}, bytes};
}

inline Error inChunk(const std::string& name, Error error) {
  error.message = "chunk " + name + ": " + error.message;
  return error;
}

// Takes chunks one after the other, checking that the next one is the one that belongs there.
class ChunkReader {
 public:
  explicit ChunkReader(std::span<const Chunk> chunks) : left_(chunks) {}

  // The next chunk's bytes; nothing once an error has been found.
  std::span<const std::byte> take(const char* name, ElementType type, std::uint64_t columns) {
    if (failed()) return {};
    if (left_.empty() || left_.front().info.name != name) {
      fail(std::string("chunk ") + name + ": missing" +
           (left_.empty() ? "" : ", found chunk " + left_.front().info.name + " in its place"));
      return {};
    }
    const Chunk& chunk = left_.front();
    left_ = left_.subspan(1);
    if (chunk.info.type != type)
      fail(std::string("chunk ") + name + " element type: expected " + toString(type) + ", found " +
           toString(chunk.info.type));
    else if (chunk.info.shape[1] != columns)
      fail(std::string("chunk ") + name + " shape: expected " + std::to_string(columns) + " columns, found " +
           std::to_string(chunk.info.shape[1]));
    else
      return chunk.data;
    return {};
  }

  // An array that borrows the next chunk's bytes.
  template <class T>
  Array<T> takeArray(const char* name, const std::shared_ptr<const void>& owner,
                     std::uint64_t columns = StoredElement<T>::columns) {
    const auto bytes = take(name, StoredElement<T>::type, columns);
    return Array<T>(owner, std::span<const T>(reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)));
  }

  // Whether the next chunk has that name.
  bool isNext(const char* name) const { return !failed() && !left_.empty() && left_.front().info.name == name; }

  // memory: of values that take any.
  template <class Value, class... Memory>
  void takeArchive(const char* name, Value& value, Memory*... memory) {
    const auto bytes = take(name, ElementType::archive, 1);
    if (failed()) return;
    if (const Status status = loadArchive(bytes, value, memory...); !status) error_ = inChunk(name, status.error());
  }

  void finish() {
    if (!failed() && !left_.empty()) fail("chunk " + left_.front().info.name + ": unknown in this format version");
  }

  bool failed() const { return !error_.message.empty(); }
  const Error& error() const { return error_; }

 private:
  void fail(std::string message) { error_ = {ErrorCode::invalidFile, std::move(message)}; }
  std::span<const Chunk> left_;
  Error error_{ErrorCode::invalidFile, ""};
};

}  // namespace relume
