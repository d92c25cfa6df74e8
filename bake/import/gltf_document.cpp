// SPDX-License-Identifier: MIT
// From a path to a checked GltfDocument. tinygltf parses the JSON into its model; buffers and images are taken out of
// the document before, because tinygltf neither bounds them nor keeps them inside the folder.
#include "bake/import/gltf_document.h"

#include "bake/base/memory_budget.h"
#include "bake/base/read_json.h"
#include "bake/import/gltf_file.h"
#include "bake/import/gltf_schema.h"
#include "relume/bake/context.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <string_view>
#include <utility>

namespace relume {
namespace {

using nlohmann::json;

// What extensionsRequired may name: what is read, and what has no part in diffuse transport.
constexpr std::array<std::string_view, 25> kKnownExtensions = {"KHR_lights_punctual",
                                                               "KHR_texture_transform",
                                                               "KHR_mesh_quantization",
                                                               "KHR_materials_emissive_strength",
                                                               "KHR_materials_unlit",
                                                               "KHR_materials_pbrSpecularGlossiness",
                                                               "EXT_mesh_gpu_instancing",
                                                               kMeshoptExtensions[0],
                                                               kMeshoptExtensions[1],
                                                               kDracoExtension,
                                                               "KHR_materials_anisotropy",
                                                               "KHR_materials_clearcoat",
                                                               "KHR_materials_diffuse_transmission",
                                                               "KHR_materials_dispersion",
                                                               "KHR_materials_ior",
                                                               "KHR_materials_iridescence",
                                                               "KHR_materials_sheen",
                                                               "KHR_materials_specular",
                                                               "KHR_materials_transmission",
                                                               "KHR_materials_variants",
                                                               "KHR_materials_volume",
                                                               "KHR_animation_pointer",
                                                               "KHR_node_visibility",
                                                               "KHR_xmp",
                                                               "KHR_xmp_json_ld"};

Status checkVersion(const json& asset, const std::string& file) {
  const std::string version = asset.value("version", std::string());
  const std::string min = asset.value("minVersion", std::string("2.0"));
  if (!version.starts_with("2.") || min != "2.0")
    return Error{ErrorCode::unsupported,
                 file + ": glTF version " + version + " (at least " + min + " needed to read it); expected 2.0"};
  return done();
}

Status checkExtensions(const json& root, const std::string& file) {
  const auto required = root.find("extensionsRequired");
  if (required == root.end()) return done();
  for (const json& name : *required) {
    const auto& text = name.get_ref<const std::string&>();
    if (std::find(kKnownExtensions.begin(), kKnownExtensions.end(), text) == kKnownExtensions.end())
      return Error{ErrorCode::unsupported,
                   file + ": requires the extension " + text + ", which is not supported" + imageRemedy(text)};
  }
  return done();
}

// What tinygltf would refuse without saying where: KHR_lights_punctual wants `spot` of spot lights.
Status checkSpots(const json& root, const std::string& file) {
  const json::json_pointer path("/extensions/KHR_lights_punctual/lights");
  if (!root.contains(path)) return done();
  for (std::size_t i = 0; i < root[path].size(); ++i) {
    const json& light = root[path][i];
    if (light["type"] == "spot" && !light.contains("spot"))
      return Error{ErrorCode::invalidFile, file + ": " + jsonPath("lights", static_cast<int>(i)) +
                                               ": a spot light without \"spot\", which has its cone angles; {} has "
                                               "the extension's defaults"};
  }
  return done();
}

// How many values a JSON text has, give or take a few: each comes with one of these signs outside of strings.
std::size_t countValues(std::string_view text) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"') {
      for (++i; i < text.size() && text[i] != '"'; ++i) {
        if (text[i] == '\\') ++i;
      }
    } else if (c == ',' || c == ':' || c == '[' || c == '{') {
      ++count;
    }
  }
  return count;
}

// Ask for what the JSON becomes, whose values take far more than their text; strings, data URIs among them, do not.
// Measured as the peak above the file: 111 bytes a value of levels of many nodes, 124 of primitives, 155 of materials,
// 209 of lights.
Status reserveTree(std::string_view text, const std::string& file, Context& context) {
  constexpr double kValueBytes = 140.0, kTextCopies = 2.0;
  constexpr double kMuch = 4 << 20;  // less is told by the stages after, which have remedies of their own
  const double bytes =
      kValueBytes * static_cast<double>(countValues(text)) + kTextCopies * static_cast<double>(text.size());
  if (bytes < kMuch) return done();
  Status reserved = reserveMemory(context, "import", bytes, std::to_string(text.size()) + " bytes of JSON",
                                  "use fewer nodes, meshes and materials");
  if (!reserved) reserved.error().message = file + ": " + reserved.error().message;
  return reserved;
}

Result<json> parseJson(const std::string& text, const std::string& file) {
  Result<json> root = readJson(text);
  if (!root) return Error{ErrorCode::invalidFile, file + ": " + root.error().message};
  if (Status status = checkGltfSchema(*root, file); !status) return status.error();
  if (Status status = checkVersion((*root)["asset"], file); !status) return status.error();
  if (Status status = checkExtensions(*root, file); !status) return status.error();
  if (Status status = checkSpots(*root, file); !status) return status.error();
  return root;
}

// The bytes of a buffer that views, compressed ones among them, read; views that reach beyond its `length` are refused
// when they are read.
ByteRange rangeOfViews(const json& root, std::size_t buffer, std::uint64_t length) {
  ByteRange range{length, 0};
  const auto add = [&](const json& view) {
    if (view.value("buffer", std::uint64_t{0}) != buffer) return;
    const auto begin = view.value("byteOffset", std::uint64_t{0}), size = view.value("byteLength", std::uint64_t{0});
    if (begin > length || size > length - begin) return;
    range.begin = std::min(range.begin, begin);
    range.end = std::max(range.end, begin + size);
  };
  const auto views = root.find("bufferViews");
  if (views == root.end()) return range;
  for (const json& view : *views) {
    add(view);
    for (const char* name : kMeshoptExtensions) {
      const json::json_pointer compressed(std::string("/extensions/") + name);
      if (view.contains(compressed)) add(view[compressed]);
    }
  }
  return range;
}

// Load every buffer; a buffer without data (the fallback of kMeshoptExtensions) stays empty.
Status loadBuffers(const json& root, GltfContainer& container, GltfDocument& document) {
  const auto buffers = root.find("buffers");
  if (buffers == root.end()) return done();
  for (std::size_t i = 0; i < buffers->size(); ++i) {
    const json& buffer = (*buffers)[i];
    const std::string where = jsonPath("buffers", static_cast<int>(i));
    const auto length = buffer["byteLength"].get<std::uint64_t>();
    FileSlice bytes;
    const auto uri = buffer.find("uri");
    if (uri != buffer.end()) {
      auto read = readUri(uri->get_ref<const std::string&>(), document.folder, document.at(where), document.files,
                          rangeOfViews(root, i, length));
      if (!read) return read.error();
      bytes = std::move(*read);
    } else if (i == 0 && container.hasBinary) {
      bytes = {std::move(container.binary), 0, 0};
      bytes.fileBytes = bytes.bytes.size();
    } else {
      document.buffers.emplace_back();
      continue;
    }
    if (bytes.fileBytes < length)
      return document.invalid(where, "byteLength is " + std::to_string(length) + ", its data has " +
                                         std::to_string(bytes.fileBytes) + " bytes");
    bytes.fileBytes = length;
    document.dataBytes += std::min<std::uint64_t>(bytes.bytes.size(), length);
    document.buffers.push_back(std::move(bytes));
  }
  return done();
}

void takeImages(const json& root, GltfDocument& document) {
  const auto images = root.find("images");
  if (images == root.end()) return;
  for (const json& image : *images) {
    document.images.push_back(
        {image.value("name", std::string()), image.value("uri", std::string()), image.value("bufferView", -1)});
  }
}

// Leave in the JSON what tinygltf is to parse, and give accessors without a view a stand-in view (it insists on one
// for indices), taken back after parsing.
constexpr const char* kUnparsed[] = {"buffers", "images", "animations", "skins"};

Status parseModel(json root, GltfDocument& document) {
  for (const char* name : kUnparsed) root.erase(name);
  const int standIn = root.contains("bufferViews") ? static_cast<int>(root["bufferViews"].size()) : 0;
  root["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 1}});
  std::vector<std::size_t> viewless;
  if (root.contains("accessors")) {
    json& accessors = root["accessors"];
    for (std::size_t i = 0; i < accessors.size(); ++i) {
      if (accessors[i].contains("bufferView")) continue;
      accessors[i]["bufferView"] = standIn;
      viewless.push_back(i);
    }
  }
  std::string error, warning;
  try {
    const std::string text = root.dump(-1, ' ', false, json::error_handler_t::replace);
    root = json();  // tinygltf makes a tree of its own
    tinygltf::TinyGLTF loader;
    if (!loader.LoadASCIIFromString(&document.model, &error, &warning, text.c_str(),
                                    static_cast<unsigned int>(text.size()), "", 0))
      return Error{ErrorCode::invalidFile, document.at(error.empty() ? "not a glTF" : error)};
  } catch (const std::bad_alloc&) {
    throw;  // not an error of the file: importGltf() reports it
  } catch (const std::exception& e) {
    return Error{ErrorCode::invalidFile, document.at(e.what())};
  }
  document.model.bufferViews.pop_back();
  for (const std::size_t i : viewless) document.model.accessors[i].bufferView = -1;
  return done();
}

}  // namespace

Result<std::span<const std::uint8_t>> GltfDocument::viewBytes(int view, const std::string& where) const {
  const auto index = static_cast<std::size_t>(view);
  if (view < 0 || index >= model.bufferViews.size())
    return invalid(where, jsonPath("bufferViews", view) + " does not exist, there are " +
                              std::to_string(model.bufferViews.size()));
  if (!decodedViews[index].empty()) return std::span<const std::uint8_t>(decodedViews[index]);
  const tinygltf::BufferView& v = model.bufferViews[index];
  if (v.buffer < 0 || static_cast<std::size_t>(v.buffer) >= buffers.size())
    return invalid(jsonPath("bufferViews", view),
                   jsonPath("buffers", v.buffer) + " does not exist, there are " + std::to_string(buffers.size()));
  const FileSlice& buffer = buffers[static_cast<std::size_t>(v.buffer)];
  const auto bytes = buffer.range(v.byteOffset, v.byteLength);
  if (!bytes)
    return invalid(jsonPath("bufferViews", view),
                   "bytes " + std::to_string(v.byteOffset) + " + " + std::to_string(v.byteLength) + " of " +
                       jsonPath("buffers", v.buffer) + ", which has " + std::to_string(buffer.fileBytes));
  return *bytes;
}

Result<GltfDocument> loadGltfDocument(const std::filesystem::path& path, Context& context) {
  GltfDocument document;
  document.file = path.filename().string();
  document.folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  document.files.push_back(path);
  auto bytes = readSceneBytes(path, document.file);
  if (!bytes) return bytes.error();
  Result<GltfContainer> container = splitContainer(std::move(*bytes), document.file);
  if (!container) return container.error();

  document.dataBytes = container->json.size();
  if (Status status = reserveTree(container->json, document.file, context); !status) return status.error();
  Result<json> root = parseJson(container->json, document.file);
  if (!root) return root.error();
  if (Status status = loadBuffers(*root, *container, document); !status) return status.error();
  takeImages(*root, document);
  document.animated = findAnimated(*root);
  if (Status status = parseModel(std::move(*root), document); !status) return status.error();
  document.decodedViews.resize(document.model.bufferViews.size());
  if (Status status = decodeMeshopt(document); !status) return status.error();
  return document;
}

std::string imageRemedy(std::string_view extension) {
  if (extension == "EXT_texture_webp" || extension == "EXT_texture_avif")
    return "; convert its images by gltf-transform png --formats \"*\" IN OUT";
  if (extension == "KHR_texture_basisu") return "; convert its images by gltf-transform ktxdecompress IN OUT";
  if (extension == "MSFT_texture_dds") return "; export the level with PNG or JPEG images";
  return "";
}

double numberOr(const tinygltf::Value& object, const char* name, double fallback) {
  return object.IsObject() && object.Has(name) && object.Get(name).IsNumber() ? object.Get(name).GetNumberAsDouble()
                                                                              : fallback;
}

int indexOr(const tinygltf::Value& object, const char* name, int fallback) {
  return object.IsObject() && object.Has(name) && object.Get(name).IsInt() ? object.Get(name).GetNumberAsInt()
                                                                           : fallback;
}

void warnOfUnknownMembers(const GltfDocument& document, const tinygltf::Value& relume, const std::string& path,
                          std::initializer_list<std::string_view> known, std::set<std::string>& told,
                          Context& context) {
  constexpr std::size_t kMostTold = 10;  // a file may have any number of them
  std::string names;
  for (const std::string_view name : known) names += (names.empty() ? "" : ", ") + std::string(name);
  for (const std::string& key : relume.Keys()) {
    if (std::find(known.begin(), known.end(), key) != known.end() || told.size() >= kMostTold) continue;
    if (told.insert(key).second)
      context.message(Severity::warning,
                      document.at(path + "." + key + ": nothing is known by this name, and it is not read; " +
                                  "known here: " + names));
  }
}

}  // namespace relume
