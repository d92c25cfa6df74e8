// SPDX-License-Identifier: MIT
// See vertex_data.h. glTF 2.0, section 3.6.2.
#include "bake/export/vertex_data.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace relume {
namespace {

using nlohmann::json;

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125,
              kFloat = 5126;

std::size_t componentBytes(int type) {
  if (type == kByte || type == kUnsignedByte) return 1;
  if (type == kShort || type == kUnsignedShort) return 2;
  return type == kUnsignedInt || type == kFloat ? 4 : 0;
}

// Columns of matrices begin at multiples of four.
std::size_t bytesOf(const std::string& type, int componentType) {
  const std::size_t component = componentBytes(componentType);
  if (type == "SCALAR") return component;
  const bool matrix = type.starts_with("MAT");
  if (type.size() != 4 || (!matrix && !type.starts_with("VEC")) || type[3] < '2' || type[3] > '4') return 0;
  const auto n = static_cast<std::size_t>(type[3] - '0');
  return matrix ? n * ((n * component + 3) / 4 * 4) : n * component;
}

template <class T>
void append(std::vector<std::uint8_t>& bytes, T value) {
  const auto* from = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), from, from + sizeof value);
}

template <class T>
json numberAt(const std::uint8_t* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

json componentAt(const std::uint8_t* bytes, int type) {
  switch (type) {
    case kByte:
      return numberAt<std::int8_t>(bytes);
    case kUnsignedByte:
      return numberAt<std::uint8_t>(bytes);
    case kShort:
      return numberAt<std::int16_t>(bytes);
    case kUnsignedShort:
      return numberAt<std::uint16_t>(bytes);
    case kUnsignedInt:
      return numberAt<std::uint32_t>(bytes);
    default:
      return numberAt<float>(bytes);
  }
}

template <class T>
void appendRounded(std::vector<std::uint8_t>& bytes, float value, bool normalized) {
  const double max = static_cast<double>(std::numeric_limits<T>::max()),
               min = static_cast<double>(std::numeric_limits<T>::lowest());
  const double scaled = normalized ? value * max : static_cast<double>(value);
  append(bytes, static_cast<T>(std::isfinite(scaled) ? std::clamp(std::round(scaled), min, max) : 0.0));
}

void appendComponent(std::vector<std::uint8_t>& bytes, float value, int type, bool normalized) {
  switch (type) {
    case kByte:
      return appendRounded<std::int8_t>(bytes, value, normalized);
    case kUnsignedByte:
      return appendRounded<std::uint8_t>(bytes, value, normalized);
    case kShort:
      return appendRounded<std::int16_t>(bytes, value, normalized);
    case kUnsignedShort:
      return appendRounded<std::uint16_t>(bytes, value, normalized);
    case kUnsignedInt:
      return appendRounded<std::uint32_t>(bytes, value, normalized);
    default:
      return append(bytes, value);
  }
}

std::uint32_t loadIndex(const std::uint8_t* bytes, std::size_t size) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes, size);  // little endian, as the file
  return value;
}

Result<const json*> accessorAt(const LevelDocument& document, int accessor, const std::string& where) {
  const auto accessors = document.root.find("accessors");
  if (accessor < 0 || accessors == document.root.end() || static_cast<std::size_t>(accessor) >= accessors->size())
    return document.source().invalid(where, jsonPath("accessors", accessor) + " does not exist");
  return &(*accessors)[static_cast<std::size_t>(accessor)];
}

// Copy `count` elements that lie `stride` bytes apart in a view of the source.
Status gather(const LevelDocument& document, int view, std::uint64_t offset, std::size_t stride, std::size_t size,
              std::size_t count, const std::string& where, std::vector<std::uint8_t>& out) {
  const Result<std::span<const std::uint8_t>> bytes = document.source().viewBytes(view, where);
  if (!bytes) return bytes.error();
  if (stride == 0) stride = size;
  if (count == 0) return done();
  if (stride < size || offset > bytes->size() || bytes->size() - offset < size ||
      (bytes->size() - offset - size) / stride < count - 1)
    return document.source().invalid(where, "its elements do not fit " + jsonPath("bufferViews", view));
  out.resize(size * count);
  for (std::size_t i = 0; i < count; ++i) std::memcpy(&out[i * size], bytes->data() + offset + i * stride, size);
  return done();
}

double component(const std::uint8_t* bytes, int type) {
  const auto load = [bytes](auto value) {
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
  };
  switch (type) {
    case kByte:
      return load(std::int8_t{});
    case kUnsignedByte:
      return load(std::uint8_t{});
    case kShort:
      return load(std::int16_t{});
    case kUnsignedShort:
      return load(std::uint16_t{});
    case kUnsignedInt:
      return load(std::uint32_t{});
    default:
      return load(float{});
  }
}

// Let min and max, where the accessor has them, be those of its elements that are numbers.
void boundElements(json& accessor, std::span<const std::uint8_t> bytes, std::size_t stride) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const int type = accessor["componentType"].get<int>();
  for (const char* name : {"min", "max"}) {
    if (!accessor.contains(name) || !accessor[name].is_array() || bytes.empty()) continue;
    for (std::size_t c = 0; c < accessor[name].size() && (c + 1) * componentBytes(type) <= stride; ++c) {
      const bool isMin = name[1] == 'i';
      double bound = isMin ? kInfinity : -kInfinity;
      for (std::size_t at = 0; at < bytes.size(); at += stride) {
        const double value = component(&bytes[at + c * componentBytes(type)], type);
        if (std::isfinite(value)) bound = isMin ? std::min(bound, value) : std::max(bound, value);
      }
      if (!std::isfinite(bound)) continue;
      if (type == kFloat)
        accessor[name][c] = bound;
      else
        accessor[name][c] = static_cast<std::int64_t>(bound);
    }
  }
}

}  // namespace

std::size_t elementBytes(const json& accessor) {
  return bytesOf(accessor.at("type").get<std::string>(), accessor.at("componentType").get<int>());
}

Result<RawElements> readRaw(const LevelDocument& document, int accessor, const std::string& where) {
  const Result<const json*> found = accessorAt(document, accessor, where);
  if (!found) return found.error();
  const json& a = **found;
  const GltfDocument& source = document.source();
  const std::string path = jsonPath("accessors", accessor);
  RawElements out;
  out.size = elementBytes(a);
  if (out.size == 0) return source.invalid(path, "no element of glTF's in " + where);
  const auto count = a.at("count").get<std::size_t>();
  const int view = a.value("bufferView", -1);
  if (view >= 0) {
    const auto& views = source.model.bufferViews;
    const std::size_t stride =
        static_cast<std::size_t>(view) < views.size() ? views[static_cast<std::size_t>(view)].byteStride : 0;
    const Status read =
        gather(document, view, a.value("byteOffset", std::uint64_t{0}), stride, out.size, count, path, out.bytes);
    if (!read) return read.error();
  } else if (count > std::max<std::uint64_t>(65536, source.dataBytes)) {
    return source.invalid(path, "claims " + std::to_string(count) + " elements without data");
  } else {
    out.bytes.assign(out.size * count, 0);
  }
  if (!a.contains("sparse")) return out;

  const json& sparse = a["sparse"];
  const auto differ = sparse.at("count").get<std::size_t>();
  const json &at = sparse.at("indices"), &value = sparse.at("values");
  const std::size_t indexBytes = componentBytes(at.at("componentType").get<int>());
  if (indexBytes == 0) return source.invalid(path + ".sparse.indices", "no unsigned integers");
  std::vector<std::uint8_t> indices, values;
  Status read = gather(document, at.at("bufferView").get<int>(), at.value("byteOffset", std::uint64_t{0}), 0,
                       indexBytes, differ, path + ".sparse.indices", indices);
  if (read)
    read = gather(document, value.at("bufferView").get<int>(), value.value("byteOffset", std::uint64_t{0}), 0, out.size,
                  differ, path + ".sparse.values", values);
  if (!read) return read.error();
  for (std::size_t i = 0; i < differ; ++i) {
    const std::uint32_t element = loadIndex(&indices[i * indexBytes], indexBytes);
    if (element >= count) return source.invalid(path + ".sparse.indices", "element " + std::to_string(element));
    std::memcpy(&out.bytes[element * out.size], &values[i * out.size], out.size);
  }
  return out;
}

json numbersOf(const json& accessor, std::span<const std::uint8_t> element) {
  const int type = accessor["componentType"].get<int>();
  json numbers = json::array();
  for (std::size_t at = 0; at < element.size(); at += componentBytes(type))
    numbers.push_back(componentAt(&element[at], type));
  return numbers.size() == 1 ? numbers.front() : numbers;
}

Result<RawElements> encodeRaw(const LevelDocument& document, int accessor, const AccessorValues& values,
                              const std::string& where) {
  const Result<const json*> found = accessorAt(document, accessor, where);
  if (!found) return found.error();
  const json& a = **found;
  const int type = a.at("componentType").get<int>();
  RawElements out;
  out.size = elementBytes(a);
  if (out.size == 0 || out.size != componentBytes(type) * static_cast<std::size_t>(values.components))
    return document.source().invalid(where, std::to_string(values.components) + " components, not what " +
                                                jsonPath("accessors", accessor) + " says");
  out.bytes.reserve(out.size * values.count);
  for (const float v : values.values) appendComponent(out.bytes, v, type, a.value("normalized", false));
  return out;
}

Result<int> copyElements(LevelDocument& document, int accessor, const RawElements& elements,
                         std::span<const std::uint32_t> source, const std::string& where) {
  const Result<const json*> found = accessorAt(document, accessor, where);
  if (!found) return found.error();
  json copy = **found;
  // Elements of vertices begin at multiples of four.
  const std::size_t stride = (elements.size + 3) / 4 * 4;
  std::vector<std::uint8_t> bytes(stride * source.size(), 0);
  for (std::size_t i = 0; i < source.size(); ++i) {
    if (source[i] >= elements.count())
      return document.source().invalid(
          where, "vertex " + std::to_string(source[i]) + " of " + std::to_string(elements.count()));
    std::memcpy(&bytes[i * stride], &elements.bytes[source[i] * elements.size], elements.size);
  }
  copy.erase("sparse");
  copy.erase("byteOffset");
  copy["count"] = source.size();
  boundElements(copy, bytes, stride);
  copy["bufferView"] = document.addView(bytes, ViewTarget::vertices, stride == elements.size ? 0 : stride);
  return document.addAccessor(std::move(copy));
}

int addIndices(LevelDocument& document, std::span<const std::uint32_t> indices, std::uint32_t vertexCount,
               int componentType) {
  // The largest value of each type would restart a primitive.
  if (componentType == kUnsignedByte && vertexCount > 0xFF) componentType = kUnsignedShort;
  if (componentType != kUnsignedByte && componentType != kUnsignedShort) componentType = kUnsignedInt;
  if (componentType == kUnsignedShort && vertexCount > 0xFFFF) componentType = kUnsignedInt;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(indices.size() * componentBytes(componentType));
  for (const std::uint32_t index : indices) {
    if (componentType == kUnsignedByte) append(bytes, static_cast<std::uint8_t>(index));
    if (componentType == kUnsignedShort) append(bytes, static_cast<std::uint16_t>(index));
    if (componentType == kUnsignedInt) append(bytes, index);
  }
  const int view = document.addView(bytes, ViewTarget::indices);
  return document.addAccessor(
      {{"bufferView", view}, {"componentType", componentType}, {"count", indices.size()}, {"type", "SCALAR"}});
}

int addCoordinates(LevelDocument& document, std::span<const std::uint32_t> packed) {
  // packUnorm16x2 has x in the low half: in a little-endian file, x then y.
  std::vector<std::uint8_t> bytes(4 * packed.size());
  std::memcpy(bytes.data(), packed.data(), bytes.size());
  const int view = document.addView(bytes, ViewTarget::vertices);
  return document.addAccessor({{"bufferView", view},
                               {"componentType", kUnsignedShort},
                               {"normalized", true},
                               {"count", packed.size()},
                               {"type", "VEC2"}});
}

}  // namespace relume
