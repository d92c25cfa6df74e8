// SPDX-License-Identifier: MIT
// See mutate.h.
#include "tests/fuzz/mutate.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstring>
#include <limits>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max);

namespace relume::fuzz {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxValues = 4000;  // of a document that are looked at

// Numbers that sit on the edges of the types a reader may use.
constexpr double kNumbers[] = {0,
                               1,
                               -1,
                               2,
                               3,
                               4,
                               5,
                               7,
                               8,
                               15,
                               16,
                               17,
                               63,
                               64,
                               127,
                               128,
                               255,
                               256,
                               257,
                               1024,
                               4096,
                               65535,
                               65536,
                               16777216.0,
                               2147483647.0,
                               2147483648.0,
                               4294967295.0,
                               4294967296.0,
                               9007199254740992.0,
                               1e18,
                               1.8446744073709552e19,
                               1e30,
                               1e300,
                               -1e300,
                               1e-30,
                               1e-300,
                               0.5,
                               -0.5,
                               0.001,
                               -0.0,
                               1.5,
                               3.14159265358979,
                               5120,
                               5121,
                               5122,
                               5123,
                               5125,
                               5126};

// The same of single precision, and coordinates about the bounds of levels.
constexpr float kFloats[] = {0.0f,
                             -0.0f,
                             1.0f,
                             -1.0f,
                             0.5f,
                             1e-45f,
                             1e-38f,
                             1e-20f,
                             1e-10f,
                             1e-5f,
                             1e3f,
                             1e5f,
                             1e7f,
                             9.9e7f,
                             -9.9e7f,
                             1.1e8f,
                             9.9e8f,
                             1e12f,
                             1e19f,
                             1e30f,
                             3.4e38f,
                             -3.4e38f,
                             std::numeric_limits<float>::infinity(),
                             std::numeric_limits<float>::quiet_NaN()};

constexpr const char* kGltfWords[] = {"accessors",
                                      "animations",
                                      "alphaCutoff",
                                      "alphaMode",
                                      "asset",
                                      "attributes",
                                      "BLEND",
                                      "MASK",
                                      "OPAQUE",
                                      "bake",
                                      "baseColorFactor",
                                      "baseColorTexture",
                                      "buffer",
                                      "bufferView",
                                      "bufferViews",
                                      "buffers",
                                      "byteLength",
                                      "byteOffset",
                                      "byteStride",
                                      "camera",
                                      "cameras",
                                      "children",
                                      "color",
                                      "COLOR",
                                      "COLOR_0",
                                      "channels",
                                      "componentType",
                                      "count",
                                      "diffuseFactor",
                                      "diffuseTexture",
                                      "directional",
                                      "doubleSided",
                                      "emissiveFactor",
                                      "emissiveStrength",
                                      "emissiveTexture",
                                      "EXPONENTIAL",
                                      "extensions",
                                      "extensionsRequired",
                                      "EXT_mesh_gpu_instancing",
                                      "EXT_meshopt_compression",
                                      "extras",
                                      "fallback",
                                      "filter",
                                      "images",
                                      "index",
                                      "indices",
                                      "INDICES",
                                      "innerConeAngle",
                                      "intensity",
                                      "KHR_draco_mesh_compression",
                                      "KHR_lights_punctual",
                                      "KHR_materials_emissive_strength",
                                      "KHR_materials_pbrSpecularGlossiness",
                                      "KHR_materials_unlit",
                                      "KHR_mesh_quantization",
                                      "KHR_meshopt_compression",
                                      "KHR_node_visibility",
                                      "KHR_texture_transform",
                                      "light",
                                      "lights",
                                      "magFilter",
                                      "material",
                                      "materials",
                                      "matrix",
                                      "mesh",
                                      "meshes",
                                      "metallicFactor",
                                      "mode",
                                      "name",
                                      "node",
                                      "nodes",
                                      "NORMAL",
                                      "normalized",
                                      "NONE",
                                      "OCTAHEDRAL",
                                      "offset",
                                      "orthographic",
                                      "outerConeAngle",
                                      "path",
                                      "pbrMetallicRoughness",
                                      "perspective",
                                      "point",
                                      "POSITION",
                                      "primitives",
                                      "QUATERNION",
                                      "range",
                                      "relume",
                                      "rotation",
                                      "ROTATION",
                                      "sampler",
                                      "samplers",
                                      "SCALAR",
                                      "scale",
                                      "SCALE",
                                      "scene",
                                      "scenes",
                                      "skin",
                                      "source",
                                      "sparse",
                                      "spot",
                                      "TANGENT",
                                      "target",
                                      "targets",
                                      "texCoord",
                                      "TEXCOORD_0",
                                      "TEXCOORD_1",
                                      "texelDensity",
                                      "textures",
                                      "translation",
                                      "TRANSLATION",
                                      "TRIANGLES",
                                      "type",
                                      "uri",
                                      "values",
                                      "VEC2",
                                      "VEC3",
                                      "VEC4",
                                      "MAT4",
                                      "version",
                                      "volume",
                                      "weights",
                                      "wrapS",
                                      "wrapT",
                                      "yfov",
                                      "zfar",
                                      "znear",
                                      "b.bin",
                                      "i.png",
                                      "../b.bin",
                                      "data:application/octet-stream;base64,AAAA"};

// A place in a document: a value and, where it has one, its parent.
struct Place {
  json* value;
  json* parent;
};

void collect(json& value, json* parent, std::vector<Place>& places) {
  if (places.size() >= kMaxValues) return;
  places.push_back({&value, parent});
  if (value.is_structured()) {
    for (json& child : value) collect(child, &value, places);
  }
}

template <class List>
const auto& pick(const List& list, Random& random) {
  return list[random() % std::size(list)];
}

json randomValue(std::span<const char* const> words, Random& random) {
  switch (random() % 8) {
    case 0:
      return nullptr;
    case 1:
      return random() % 2 == 0;
    case 2:
      return json::array();
    case 3:
      return json::object();
    case 4:
      return pick(words, random);
    case 5:
      return json::array({pick(kNumbers, random), pick(kNumbers, random), pick(kNumbers, random)});
    case 6:
      return static_cast<unsigned>(random() % 8);
    default:
      return pick(kNumbers, random);
  }
}

void changeNumber(json& value, Random& random) {
  const double old = value.get<double>();
  switch (random() % 5) {
    case 0:
      value = old + 1;
      break;
    case 1:
      value = old - 1;
      break;
    case 2:
      value = old * (random() % 2 ? 2.0 : -1.0);
      break;
    case 3:
      value = static_cast<unsigned>(random() % 8);
      break;
    default:
      value = pick(kNumbers, random);
  }
  // Whole numbers are written without a point, as files have them.
  const double number = value.get<double>();
  if (number == static_cast<double>(static_cast<std::int64_t>(std::clamp(number, -9e18, 9e18))))
    value = static_cast<std::int64_t>(number);
}

void changeText(json& value, std::span<const char* const> words, Random& random) {
  if (random() % 2 == 0) {
    value = pick(words, random);
    return;
  }
  const auto& text = value.get_ref<const std::string&>();
  Bytes bytes(text.begin(), text.end());
  mutateBytes(bytes, text.size() + 16);
  value = std::string(bytes.begin(), bytes.end());
}

void changeOnce(json& root, std::span<const char* const> words, Random& random) {
  std::vector<Place> places;
  collect(root, nullptr, places);
  const Place place = pick(places, random);
  json& value = *place.value;
  switch (random() % 8) {
    case 0:  // take it out
      if (place.parent && place.parent->is_array()) {
        place.parent->erase(static_cast<std::size_t>(&value - &(*place.parent)[0]));
        return;
      }
      if (value.is_object() && !value.empty()) {
        value.erase(std::next(value.begin(), static_cast<std::ptrdiff_t>(random() % value.size())));
        return;
      }
      break;
    case 1:  // put the copy of another in its place
      value = json(*pick(places, random).value);
      return;
    case 2:  // add a member or an element
      if (value.is_object()) {
        value[pick(words, random)] = random() % 2 ? randomValue(words, random) : json(*pick(places, random).value);
        return;
      }
      if (value.is_array()) {
        value.push_back(value.empty() || random() % 4 == 0 ? randomValue(words, random) : json(pick(value, random)));
        return;
      }
      break;
    case 3:
      value = randomValue(words, random);
      return;
    case 4:  // bury it, rarely as deep as readers allow and beyond
      if (random() % 16 == 0) {
        constexpr std::size_t kDepths[] = {1, 3, 120, 127, 128, 129, 1000};
        for (std::size_t depth = pick(kDepths, random); depth > 0; --depth)
          value = random() % 2 ? json::array({value}) : json::object({{"a", value}});
        return;
      }
      break;
    default:
      break;
  }
  if (value.is_number()) return changeNumber(value, random);
  if (value.is_string()) return changeText(value, words, random);
  if (value.is_boolean()) value = !value.get<bool>();
}

std::uint32_t u32At(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t value = 0;
  if (at + 4 <= bytes.size()) std::memcpy(&value, &bytes[at], 4);
  return value;
}

void putU32(Bytes& out, std::size_t value) {
  const auto v = static_cast<std::uint32_t>(value);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&v);
  out.insert(out.end(), bytes, bytes + 4);
}

// Numbers of a buffer, most of which are floats: to the ends of what floats can say, or a little off.
void changeFloats(Bytes& buffer, Random& random) {
  for (auto left = 1 + random() % 4; left > 0; --left) {
    const std::size_t at = 4 * (random() % (buffer.size() / 4));
    float value = 0.0f;
    std::memcpy(&value, &buffer[at], 4);
    switch (random() % 4) {
      case 0:
        value *= random() % 2 ? -1.0f : 1.001f;
        break;
      case 1:
        value += 0.25f;
        break;
      case 2:
        std::memcpy(&value, &buffer[4 * (random() % (buffer.size() / 4))], 4);
        break;
      default:
        value = pick(kFloats, random);
    }
    std::memcpy(&buffer[at], &value, 4);
  }
}

Bytes bytesOf(std::span<const std::uint8_t> span) { return {span.begin(), span.end()}; }

}  // namespace

void mutateBytes(Bytes& bytes, std::size_t max) {
  const std::size_t size = std::min(bytes.size(), max);
  bytes.resize(std::max<std::size_t>(max, 1));
  bytes.resize(LLVMFuzzerMutate(bytes.data(), size, max));
}

std::string mutateJson(std::string_view text, std::size_t max, std::span<const char* const> words, Random& random) {
  json root = random() % 16 == 0 ? json(json::value_t::discarded) : json::parse(text, nullptr, false, true);
  std::string out;
  if (!root.is_discarded()) {
    for (unsigned left = 1 + random() % 3; left > 0; --left) changeOnce(root, words, random);
    out = root.dump(-1, ' ', false, json::error_handler_t::replace);
  }
  if (!out.empty() && out.size() <= max) return out;
  Bytes bytes(text.begin(), text.end());
  mutateBytes(bytes, max);
  return {bytes.begin(), bytes.end()};
}

Bytes mutateGltf(std::span<const std::uint8_t> file, std::size_t max, Random& random) {
  const std::size_t jsonBytes = u32At(file, 12);
  const bool glb = file.size() >= 20 && std::memcmp(file.data(), "glTF", 4) == 0 && jsonBytes <= file.size() - 20;
  if (random() % 32 == 0 || (!glb && (file.empty() || file[0] != '{'))) {
    Bytes bytes = bytesOf(file);
    mutateBytes(bytes, max);
    return bytes;
  }
  const auto textBytes = glb ? file.subspan(20, jsonBytes) : file;
  std::string text(textBytes.begin(), textBytes.end());
  if (!glb) {
    const std::string changed = mutateJson(text, max, kGltfWords, random);
    return {changed.begin(), changed.end()};
  }

  // Change one of the two chunks and give both their true sizes.
  Bytes binary = file.size() >= 28 + jsonBytes ? bytesOf(file.subspan(28 + jsonBytes)) : Bytes{};
  const std::size_t room = max > 40 + binary.size() ? max - 40 - binary.size() : 0;
  const auto way = random() % 8;
  if (binary.size() >= 4 && way == 0) {
    changeFloats(binary, random);
  } else if (!binary.empty() && way == 1) {
    mutateBytes(binary, random() % 4 == 0 && max > text.size() + 40 ? max - text.size() - 40 : binary.size());
  } else {
    text = mutateJson(text, room, kGltfWords, random);
  }
  text.resize((text.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, 0);
  Bytes out = {'g', 'l', 'T', 'F'};
  putU32(out, 2);
  putU32(out, 20 + text.size() + (binary.empty() ? 0 : 8 + binary.size()));
  putU32(out, text.size());
  putU32(out, 0x4E4F534A);
  out.insert(out.end(), text.begin(), text.end());
  if (!binary.empty()) {
    putU32(out, binary.size());
    putU32(out, 0x004E4942);
    out.insert(out.end(), binary.begin(), binary.end());
  }
  return out;
}

FileSet splitFiles(std::span<const std::uint8_t> input) {
  if (input.size() < 8) return {bytesOf(input), {}, {}};
  const std::size_t scene = std::min<std::size_t>(u32At(input, 0), input.size() - 8);
  const std::size_t buffer = std::min<std::size_t>(u32At(input, 4), input.size() - 8 - scene);
  return {bytesOf(input.subspan(8, scene)), bytesOf(input.subspan(8 + scene, buffer)),
          bytesOf(input.subspan(8 + scene + buffer))};
}

Bytes joinFiles(const FileSet& files) {
  Bytes out;
  putU32(out, files.scene.size());
  putU32(out, files.buffer.size());
  for (const Bytes* part : {&files.scene, &files.buffer, &files.image})
    out.insert(out.end(), part->begin(), part->end());
  return out;
}

std::size_t store(const Bytes& mutated, std::uint8_t* data, std::size_t max) {
  const std::size_t size = std::min(mutated.size(), max);
  if (size > 0) std::memcpy(data, mutated.data(), size);
  return size;
}

}  // namespace relume::fuzz
