// SPDX-License-Identifier: MIT
// See gltf_schema.h. One table per glTF object; a walk compares the document with them.
#include "bake/import/gltf_schema.h"

#include "bake/import/gltf_document.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <span>

namespace relume {
namespace {

using nlohmann::json;

enum class Kind {
  boolean,
  text,
  number,
  index,     // [0..2^31-2], an index or a small count
  size,      // [0..2^48], bytes or elements
  numbers,   // array of `count` numbers; 0 = any length
  indices,   // array of indices
  texts,     // array of strings
  indexMap,  // object of indices
  object,
  objects  // array of objects
};

struct Field {
  const char* name;
  Kind kind;
  std::span<const Field> fields = {};
  std::size_t count = 0;
  bool required = false;
};

constexpr double kMaxIndex = 2147483646.0;
constexpr double kMaxSize = 281474976710656.0;

constexpr Field kAsset[] = {{"version", Kind::text, {}, 0, true}, {"minVersion", Kind::text}};
constexpr Field kBuffer[] = {{"uri", Kind::text}, {"byteLength", Kind::size, {}, 0, true}, {"name", Kind::text}};
// tinygltf keeps whole numbers of extensions in 32 bits.
constexpr Field kMeshopt[] = {{"buffer", Kind::index, {}, 0, true},
                              {"byteOffset", Kind::index},
                              {"byteLength", Kind::index, {}, 0, true},
                              {"byteStride", Kind::index, {}, 0, true},
                              {"count", Kind::index, {}, 0, true},
                              {"mode", Kind::text, {}, 0, true},
                              {"filter", Kind::text}};
constexpr Field kViewExtensions[] = {{kMeshoptExtensions[0], Kind::object, kMeshopt},
                                     {kMeshoptExtensions[1], Kind::object, kMeshopt}};
constexpr Field kBufferView[] = {
    {"buffer", Kind::index, {}, 0, true}, {"byteOffset", Kind::size}, {"byteLength", Kind::size, {}, 0, true},
    {"byteStride", Kind::size},           {"name", Kind::text},       {"extensions", Kind::object, kViewExtensions}};
constexpr Field kSparseIndices[] = {
    {"bufferView", Kind::index, {}, 0, true}, {"byteOffset", Kind::index}, {"componentType", Kind::index, {}, 0, true}};
constexpr Field kSparseValues[] = {{"bufferView", Kind::index, {}, 0, true}, {"byteOffset", Kind::index}};
constexpr Field kSparse[] = {{"count", Kind::index, {}, 0, true},
                             {"indices", Kind::object, kSparseIndices, 0, true},
                             {"values", Kind::object, kSparseValues, 0, true}};
constexpr Field kAccessor[] = {
    {"bufferView", Kind::index},   {"byteOffset", Kind::size},         {"componentType", Kind::index, {}, 0, true},
    {"normalized", Kind::boolean}, {"count", Kind::size, {}, 0, true}, {"type", Kind::text, {}, 0, true},
    {"name", Kind::text},          {"sparse", Kind::object, kSparse}};
constexpr Field kDraco[] = {{"bufferView", Kind::index, {}, 0, true}, {"attributes", Kind::indexMap, {}, 0, true}};
constexpr Field kPrimitiveExtensions[] = {{kDracoExtension, Kind::object, kDraco}};
constexpr Field kTarget[] = {{"POSITION", Kind::index}, {"NORMAL", Kind::index}, {"TANGENT", Kind::index}};
constexpr Field kPrimitive[] = {{"attributes", Kind::indexMap, {}, 0, true},
                                {"indices", Kind::index},
                                {"material", Kind::index},
                                {"mode", Kind::index},
                                {"targets", Kind::objects, kTarget},
                                {"extensions", Kind::object, kPrimitiveExtensions}};
constexpr Field kMesh[] = {
    {"name", Kind::text}, {"primitives", Kind::objects, kPrimitive, 0, true}, {"weights", Kind::numbers}};

constexpr Field kInstancing[] = {{"attributes", Kind::indexMap, {}, 0, true}};
constexpr Field kLightRef[] = {{"light", Kind::index, {}, 0, true}};
constexpr Field kVisibility[] = {{"visible", Kind::boolean}};
constexpr Field kNodeExtensions[] = {{"EXT_mesh_gpu_instancing", Kind::object, kInstancing},
                                     {"KHR_lights_punctual", Kind::object, kLightRef},
                                     {"KHR_node_visibility", Kind::object, kVisibility}};
constexpr Field kNode[] = {{"name", Kind::text},
                           {"mesh", Kind::index},
                           {"camera", Kind::index},
                           {"skin", Kind::index},
                           {"children", Kind::indices},
                           {"matrix", Kind::numbers, {}, 16},
                           {"translation", Kind::numbers, {}, 3},
                           {"rotation", Kind::numbers, {}, 4},
                           {"scale", Kind::numbers, {}, 3},
                           {"weights", Kind::numbers},
                           {"extensions", Kind::object, kNodeExtensions}};
constexpr Field kScene[] = {{"name", Kind::text}, {"nodes", Kind::indices}};

constexpr Field kTransform[] = {{"offset", Kind::numbers, {}, 2},
                                {"rotation", Kind::number},
                                {"scale", Kind::numbers, {}, 2},
                                {"texCoord", Kind::index}};
constexpr Field kTextureExtensions[] = {{"KHR_texture_transform", Kind::object, kTransform}};
constexpr Field kTextureInfo[] = {
    {"index", Kind::index, {}, 0, true}, {"texCoord", Kind::index}, {"extensions", Kind::object, kTextureExtensions}};
constexpr Field kNormalInfo[] = {{"index", Kind::index, {}, 0, true},
                                 {"texCoord", Kind::index},
                                 {"scale", Kind::number},
                                 {"strength", Kind::number},
                                 {"extensions", Kind::object, kTextureExtensions}};
constexpr Field kRoughness[] = {{"baseColorFactor", Kind::numbers, {}, 4},
                                {"baseColorTexture", Kind::object, kTextureInfo},
                                {"metallicFactor", Kind::number},
                                {"roughnessFactor", Kind::number},
                                {"metallicRoughnessTexture", Kind::object, kTextureInfo}};
constexpr Field kStrength[] = {{"emissiveStrength", Kind::number}};
constexpr Field kGlossiness[] = {{"diffuseFactor", Kind::numbers, {}, 4},
                                 {"glossinessFactor", Kind::number},
                                 {"diffuseTexture", Kind::object, kTextureInfo}};
constexpr Field kMaterialExtensions[] = {{"KHR_materials_emissive_strength", Kind::object, kStrength},
                                         {"KHR_materials_unlit", Kind::object},
                                         {"KHR_materials_pbrSpecularGlossiness", Kind::object, kGlossiness}};
constexpr Field kMaterial[] = {{"name", Kind::text},
                               {"pbrMetallicRoughness", Kind::object, kRoughness},
                               {"emissiveFactor", Kind::numbers, {}, 3},
                               {"emissiveTexture", Kind::object, kTextureInfo},
                               {"normalTexture", Kind::object, kNormalInfo},
                               {"occlusionTexture", Kind::object, kNormalInfo},
                               {"alphaMode", Kind::text},
                               {"alphaCutoff", Kind::number},
                               {"doubleSided", Kind::boolean},
                               {"extensions", Kind::object, kMaterialExtensions}};
constexpr Field kTexture[] = {
    {"sampler", Kind::index}, {"source", Kind::index}, {"name", Kind::text}, {"extensions", Kind::object}};
constexpr Field kSampler[] = {
    {"magFilter", Kind::index}, {"minFilter", Kind::index}, {"wrapS", Kind::index}, {"wrapT", Kind::index}};
constexpr Field kImage[] = {
    {"uri", Kind::text}, {"bufferView", Kind::index}, {"mimeType", Kind::text}, {"name", Kind::text}};
constexpr Field kPerspective[] = {{"yfov", Kind::number, {}, 0, true},
                                  {"znear", Kind::number, {}, 0, true},
                                  {"zfar", Kind::number},
                                  {"aspectRatio", Kind::number}};
constexpr Field kOrthographic[] = {{"xmag", Kind::number, {}, 0, true},
                                   {"ymag", Kind::number, {}, 0, true},
                                   {"znear", Kind::number, {}, 0, true},
                                   {"zfar", Kind::number, {}, 0, true}};
constexpr Field kCamera[] = {{"name", Kind::text},
                             {"type", Kind::text, {}, 0, true},
                             {"perspective", Kind::object, kPerspective},
                             {"orthographic", Kind::object, kOrthographic}};
constexpr Field kSpot[] = {{"innerConeAngle", Kind::number}, {"outerConeAngle", Kind::number}};
constexpr Field kLight[] = {
    {"name", Kind::text},        {"type", Kind::text, {}, 0, true}, {"color", Kind::numbers, {}, 3},
    {"intensity", Kind::number}, {"range", Kind::number},           {"spot", Kind::object, kSpot}};
constexpr Field kLights[] = {{"lights", Kind::objects, kLight, 0, true}};
constexpr Field kRootExtensions[] = {{"KHR_lights_punctual", Kind::object, kLights}};

constexpr Field kRoot[] = {{"asset", Kind::object, kAsset, 0, true},
                           {"extensionsUsed", Kind::texts},
                           {"extensionsRequired", Kind::texts},
                           {"buffers", Kind::objects, kBuffer},
                           {"bufferViews", Kind::objects, kBufferView},
                           {"accessors", Kind::objects, kAccessor},
                           {"meshes", Kind::objects, kMesh},
                           {"nodes", Kind::objects, kNode},
                           {"scenes", Kind::objects, kScene},
                           {"scene", Kind::index},
                           {"materials", Kind::objects, kMaterial},
                           {"textures", Kind::objects, kTexture},
                           {"samplers", Kind::objects, kSampler},
                           {"images", Kind::objects, kImage},
                           {"cameras", Kind::objects, kCamera},
                           {"extensions", Kind::object, kRootExtensions}};

Error mismatch(const std::string& path, const std::string& expected, const json& found) {
  std::string value = found.dump(-1, ' ', true, json::error_handler_t::replace);
  if (value.size() > 60) value = value.substr(0, 57) + "...";
  return {ErrorCode::invalidFile, path + ": expected " + expected + ", found " + value};
}

Status checkWhole(json& value, double limit, const std::string& path) {
  const bool whole =
      value.is_number_integer() || (value.is_number_float() && value.get<double>() == std::floor(value.get<double>()));
  const double number = whole ? value.get<double>() : -1.0;
  if (!(number >= 0.0 && number <= limit)) return mismatch(path, "a whole number of at least 0 within range", value);
  if (!value.is_number_unsigned()) value = static_cast<std::uint64_t>(number);
  return done();
}

Status checkFields(json& object, std::span<const Field> fields, const std::string& path);

// Every element of an array or object, by the same rule.
template <class Check>
Status checkEach(json& list, const std::string& path, const Check& check) {
  for (auto it = list.begin(); it != list.end(); ++it) {
    const std::string key = list.is_object() ? "." + it.key() : "[" + std::to_string(it - list.begin()) + "]";
    if (Status status = check(*it, path + key); !status) return status;
  }
  return done();
}

Status checkValue(json& value, const Field& field, const std::string& path) {
  const auto index = [](json& v, const std::string& at) { return checkWhole(v, kMaxIndex, at); };
  const auto isNumber = [](json& v, const std::string& at) -> Status {
    return v.is_number() ? done() : Status(mismatch(at, "a number", v));
  };
  const auto isText = [](json& v, const std::string& at) -> Status {
    return v.is_string() ? done() : Status(mismatch(at, "a string", v));
  };
  const auto isObject = [&](json& v, const std::string& at) -> Status {
    return v.is_object() ? checkFields(v, field.fields, at) : Status(mismatch(at, "an object", v));
  };
  const bool wantsArray = field.kind == Kind::numbers || field.kind == Kind::indices || field.kind == Kind::texts ||
                          field.kind == Kind::objects;
  if (wantsArray && !value.is_array()) return mismatch(path, "an array", value);
  switch (field.kind) {
    case Kind::boolean:
      return value.is_boolean() ? done() : Status(mismatch(path, "true or false", value));
    case Kind::text:
      return isText(value, path);
    case Kind::number:
      return isNumber(value, path);
    case Kind::index:
      return index(value, path);
    case Kind::size:
      return checkWhole(value, kMaxSize, path);
    case Kind::object:
      return isObject(value, path);
    case Kind::objects:
      return checkEach(value, path, isObject);
    case Kind::indices:
      return checkEach(value, path, index);
    case Kind::texts:
      return checkEach(value, path, isText);
    case Kind::indexMap:
      return value.is_object() ? checkEach(value, path, index) : Status(mismatch(path, "an object", value));
    case Kind::numbers:
      if (field.count != 0 && value.size() != field.count)
        return mismatch(path, std::to_string(field.count) + " numbers", value);
      return checkEach(value, path, isNumber);
  }
  return done();
}

Status checkFields(json& object, std::span<const Field> fields, const std::string& path) {
  for (const Field& field : fields) {
    const auto member = object.find(field.name);
    const std::string at = path.ends_with(": ") ? path + field.name : path + "." + field.name;
    if (member == object.end()) {
      if (field.required) return Error{ErrorCode::invalidFile, at + ": missing"};
      continue;
    }
    if (Status status = checkValue(*member, field, at); !status) return status;
  }
  return done();
}

}  // namespace

Status checkGltfSchema(json& root, const std::string& file) {
  if (!root.is_object()) return mismatch(file, "a JSON object", root);
  return checkFields(root, kRoot, file + ": ");
}

}  // namespace relume
