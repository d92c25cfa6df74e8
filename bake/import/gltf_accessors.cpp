// SPDX-License-Identifier: MIT
// See gltf_accessors.h. glTF 2.0, section 3.6.2.
#include "bake/import/gltf_accessors.h"

#include <algorithm>
#include <cstring>
#include <span>

namespace relume {
namespace {

// Elements an accessor without data of its own (all zeros, or sparse over zeros) may claim at least.
constexpr std::uint64_t kMinClaim = 65536;
// Numbers that all accessors together may have for each byte of data, and may have at least: views and accessors may
// overlap, and all that are read are held.
constexpr std::uint64_t kMaxNumbersPerByte = 16;
constexpr std::uint64_t kMinNumbers = 1u << 24;

std::size_t componentBytes(int componentType) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      return 0;
  }
}

int componentCount(int type) {
  switch (type) {
    case TINYGLTF_TYPE_SCALAR:
      return 1;
    case TINYGLTF_TYPE_VEC2:
      return 2;
    case TINYGLTF_TYPE_VEC3:
      return 3;
    case TINYGLTF_TYPE_VEC4:
      return 4;
    default:
      return 0;  // matrices, which the importer never reads
  }
}

template <class T>
T load(const std::uint8_t* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

float loadFloat(const std::uint8_t* bytes, int componentType, bool normalized) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
      const auto v = static_cast<float>(load<std::int8_t>(bytes));
      return normalized ? std::max(v / 127.0f, -1.0f) : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: {
      const auto v = static_cast<float>(*bytes);
      return normalized ? v / 255.0f : v;
    }
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
      const auto v = static_cast<float>(load<std::int16_t>(bytes));
      return normalized ? std::max(v / 32767.0f, -1.0f) : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
      const auto v = static_cast<float>(load<std::uint16_t>(bytes));
      return normalized ? v / 65535.0f : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return static_cast<float>(load<std::uint32_t>(bytes));
    default:
      return load<float>(bytes);
  }
}

std::uint32_t loadIndex(const std::uint8_t* bytes, int componentType) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return *bytes;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<std::uint16_t>(bytes);
    default:
      return load<std::uint32_t>(bytes);
  }
}

bool isIndexType(int componentType) {
  return componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
         componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
         componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

// Elements in memory: the first at data, one every stride bytes. data is null where all elements are zero.
struct Elements {
  const std::uint8_t* data = nullptr;
  std::size_t stride = 0;
};

// `count` elements of `size` bytes at `offset` of a view.
Result<Elements> elementsOf(const GltfDocument& document, int view, std::uint64_t offset, std::uint64_t count,
                            std::size_t size, std::size_t stride, const std::string& where) {
  const Result<std::span<const std::uint8_t>> bytes = document.viewBytes(view, where);
  if (!bytes) return bytes.error();
  if (stride == 0) stride = size;
  if (stride < size)
    return document.invalid(jsonPath("bufferViews", view), "byteStride " + std::to_string(stride) +
                                                               " is less than the " + std::to_string(size) +
                                                               " bytes of an element of " + where);
  if (count == 0) return Elements{bytes->data(), stride};
  if (offset > bytes->size() || bytes->size() - offset < size || (bytes->size() - offset - size) / stride < count - 1)
    return document.invalid(where, std::to_string(count) + " elements of " + std::to_string(size) + " bytes, stride " +
                                       std::to_string(stride) + ", from byte " + std::to_string(offset) +
                                       " do not fit the " + std::to_string(bytes->size()) + " bytes of " +
                                       jsonPath("bufferViews", view));
  return Elements{bytes->data() + offset, stride};
}

struct CheckedAccessor {
  const tinygltf::Accessor* accessor = nullptr;
  int components = 0;
  std::size_t size = 0;  // [B] of an element
  Elements base;
};

Result<CheckedAccessor> checkAccessor(const GltfDocument& document, int index, const std::string& where) {
  const std::string path = jsonPath("accessors", index);
  if (index < 0 || static_cast<std::size_t>(index) >= document.model.accessors.size())
    return document.invalid(where,
                            path + " does not exist, there are " + std::to_string(document.model.accessors.size()));
  CheckedAccessor checked;
  checked.accessor = &document.model.accessors[static_cast<std::size_t>(index)];
  const tinygltf::Accessor& a = *checked.accessor;
  checked.components = componentCount(a.type);
  checked.size = componentBytes(a.componentType) * static_cast<std::size_t>(checked.components);
  if (checked.size == 0)
    return document.invalid(
        path, "componentType " + std::to_string(a.componentType) + " is not one that " + where + " can have");
  if (a.bufferView >= 0) {
    const std::size_t views = document.model.bufferViews.size();
    const auto view = static_cast<std::size_t>(a.bufferView);
    const std::size_t stride = view < views ? document.model.bufferViews[view].byteStride : 0;
    const Result<Elements> base = elementsOf(document, a.bufferView, a.byteOffset, a.count, checked.size, stride, path);
    if (!base) return base.error();
    checked.base = *base;
  } else if (a.count > std::max(kMinClaim, document.dataBytes)) {
    return document.invalid(path, "claims " + std::to_string(a.count) + " elements without data, the whole file has " +
                                      std::to_string(document.dataBytes) + " bytes");
  }
  return checked;
}

// Call replace(element, bytes) for each element of a sparse accessor that differs from its base.
template <class Replace>
Status applySparse(const GltfDocument& document, const CheckedAccessor& checked, const std::string& path,
                   const Replace& replace) {
  const tinygltf::Accessor& a = *checked.accessor;
  if (!a.sparse.isSparse) return done();
  const auto count = static_cast<std::uint64_t>(std::max(a.sparse.count, 0));
  const int type = a.sparse.indices.componentType;
  if (!isIndexType(type)) return document.invalid(path + ".sparse.indices", "componentType is not an unsigned integer");
  const Result<Elements> at =
      elementsOf(document, a.sparse.indices.bufferView, static_cast<std::uint64_t>(a.sparse.indices.byteOffset), count,
                 componentBytes(type), 0, path + ".sparse.indices");
  if (!at) return at.error();
  const Result<Elements> values =
      elementsOf(document, a.sparse.values.bufferView, static_cast<std::uint64_t>(a.sparse.values.byteOffset), count,
                 checked.size, 0, path + ".sparse.values");
  if (!values) return values.error();
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint32_t element = loadIndex(at->data + i * at->stride, type);
    if (element >= a.count)
      return document.invalid(path + ".sparse.indices",
                              "element " + std::to_string(element) + " of " + std::to_string(a.count));
    replace(element, values->data + i * values->stride);
  }
  return done();
}

}  // namespace

Result<const AccessorValues*> AccessorReader::floats(int accessor, int minComponents, int maxComponents,
                                                     const std::string& where) {
  const std::string path = jsonPath("accessors", accessor);
  const Result<CheckedAccessor> checked = checkAccessor(document_, accessor, where);
  if (!checked) return checked.error();
  const tinygltf::Accessor& a = *checked->accessor;
  const Key key(a.bufferView, a.byteOffset, a.count, a.componentType, a.type, a.normalized,
                a.sparse.isSparse ? accessor : -1);
  if (!cache_.contains(key)) {
    AccessorValues out;
    out.count = a.count;
    out.components = checked->components;
    numbers_ += a.count * static_cast<std::uint64_t>(out.components);
    if (numbers_ > std::max(kMinNumbers, kMaxNumbersPerByte * document_.dataBytes))
      return document_.invalid(path, "with it, the accessors have " + std::to_string(numbers_) + " numbers in " +
                                         std::to_string(document_.dataBytes) + " bytes");
    out.values.resize(a.count * static_cast<std::size_t>(out.components));
    const std::size_t step = componentBytes(a.componentType);
    const auto copyElement = [&](std::size_t element, const std::uint8_t* bytes) {
      float* to = &out.values[element * static_cast<std::size_t>(out.components)];
      for (int c = 0; c < out.components; ++c, bytes += step) *to++ = loadFloat(bytes, a.componentType, a.normalized);
    };
    if (a.bufferView >= 0) {
      for (std::size_t i = 0; i < a.count; ++i) copyElement(i, checked->base.data + i * checked->base.stride);
    }
    if (Status status = applySparse(document_, *checked, path, copyElement); !status) return status.error();
    cache_.emplace(key, std::move(out));
  }
  const AccessorValues& values = cache_.at(key);
  if (values.components < minComponents || values.components > maxComponents)
    return document_.invalid(where, path + " has " + std::to_string(values.components) + " components; expected " +
                                        std::to_string(minComponents) +
                                        (minComponents == maxComponents ? "" : " to " + std::to_string(maxComponents)));
  return &values;
}

Status checkRanges(const GltfDocument& document) {
  const auto& model = document.model;
  // A view on a buffer that holds nothing, and is not decoded from another, is refused when it is read.
  const auto hasData = [&](int view) {
    return !document.decodedViews[static_cast<std::size_t>(view)].empty() ||
           document.hasData(model.bufferViews[static_cast<std::size_t>(view)].buffer);
  };
  for (std::size_t i = 0; i < model.bufferViews.size(); ++i) {
    const auto view = static_cast<int>(i);
    const int buffer = model.bufferViews[i].buffer;
    if (buffer >= 0 && static_cast<std::size_t>(buffer) < document.buffers.size() && !hasData(view)) continue;
    if (const auto bytes = document.viewBytes(view, jsonPath("bufferViews", view)); !bytes) return bytes.error();
  }
  for (std::size_t i = 0; i < model.accessors.size(); ++i) {
    const tinygltf::Accessor& a = model.accessors[i];
    const bool inRange = static_cast<std::size_t>(a.bufferView) < model.bufferViews.size();
    if (a.bufferView < 0 || (inRange && !hasData(a.bufferView)) || componentCount(a.type) == 0) continue;
    const auto index = static_cast<int>(i);
    if (const auto checked = checkAccessor(document, index, jsonPath("accessors", index)); !checked)
      return checked.error();
  }
  return done();
}

Result<std::vector<std::uint32_t>> AccessorReader::indices(int accessor, const std::string& where) const {
  const std::string path = jsonPath("accessors", accessor);
  const Result<CheckedAccessor> checked = checkAccessor(document_, accessor, where);
  if (!checked) return checked.error();
  const tinygltf::Accessor& a = *checked->accessor;
  if (checked->components != 1 || !isIndexType(a.componentType))
    return document_.invalid(where, path + " is not a scalar of 8, 16 or 32-bit unsigned integers");
  std::vector<std::uint32_t> out(a.count, 0);
  if (a.bufferView >= 0) {
    for (std::size_t i = 0; i < a.count; ++i)
      out[i] = loadIndex(checked->base.data + i * checked->base.stride, a.componentType);
  }
  const Status sparse = applySparse(document_, *checked, path, [&](std::size_t element, const std::uint8_t* bytes) {
    out[element] = loadIndex(bytes, a.componentType);
  });
  if (!sparse) return sparse.error();
  return out;
}

}  // namespace relume
