// SPDX-License-Identifier: MIT
// A glTF in memory, checked: tinygltf's model of the JSON, the buffers' bytes (compressed views decoded), and where
// images are. Shared by the importer's files; includes tinygltf.
#pragma once

#include "bake/import/gltf_animations.h"
#include "bake/import/gltf_file.h"
#include "relume/result.h"

#include <tiny_gltf.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relume {

class Context;

inline constexpr const char* kDracoExtension = "KHR_draco_mesh_compression";

// The extension that compresses buffer views, by its first name and by the ratified one; their JSON is the same.
inline constexpr std::array<const char*, 2> kMeshoptExtensions = {"EXT_meshopt_compression", "KHR_meshopt_compression"};

struct GltfDocument {
  std::string file;  // name without folder, opens every message
  std::filesystem::path folder;
  tinygltf::Model model;                                // without buffers and images: those are below
  std::vector<FileSlice> buffers;                       // of each, what its views ask for
  std::vector<std::vector<std::uint8_t>> decodedViews;  // [Size bufferViews] of kMeshoptExtensions
  struct ImageSource {
    std::string name, uri;
    int bufferView = -1;
  };
  std::vector<ImageSource> images;
  Animated animated;
  std::vector<std::filesystem::path> files;  // read so far
  std::uint64_t dataBytes = 0;               // JSON, buffers and decoded views: what allocations are measured against

  std::string at(const std::string& what) const { return file + ": " + what; }
  Error invalid(const std::string& where, const std::string& what) const {
    return {ErrorCode::invalidFile, file + ": " + where + ": " + what};
  }

  // Whether a buffer exists and has data, unlike the fallback buffers of kMeshoptExtensions.
  bool hasData(int buffer) const {
    return buffer >= 0 && static_cast<std::size_t>(buffer) < buffers.size() &&
           buffers[static_cast<std::size_t>(buffer)].fileBytes > 0;
  }

  // The bytes of a buffer view. invalidFile: no such view or buffer, or out of the buffer's bytes.
  Result<std::span<const std::uint8_t>> viewBytes(int view, const std::string& where) const;
};

// Read and check a document and all its buffers.
Result<GltfDocument> loadGltfDocument(const std::filesystem::path& path, Context& context);

// Decode the views of kMeshoptExtensions into GltfDocument::decodedViews. Those that meshoptimizer cannot decode stay
// as they are where their fallback has data. unsupported: it has none; invalidFile: broken data, or claims beyond it.
Status decodeMeshopt(GltfDocument& document);

// JSON path of an element, for messages: "accessors[3]".
inline std::string jsonPath(const char* array, int index) {
  return std::string(array) + "[" + std::to_string(index) + "]";
}

// What to do about images in a format that only `extension` knows, to go after a message: empty for other extensions.
std::string imageRemedy(std::string_view extension);

// A member of an extension as tinygltf keeps it; `fallback` when absent. Types were checked by the schema.
double numberOr(const tinygltf::Value& object, const char* name, double fallback);
int indexOr(const tinygltf::Value& object, const char* name, int fallback);

// Warns of members of extras.relume (at `path`) that nobody reads, as of a misspelt one. told: names that were warned
// of before, which need no second line.
void warnOfUnknownMembers(const GltfDocument& document, const tinygltf::Value& relume, const std::string& path,
                          std::initializer_list<std::string_view> known, std::set<std::string>& told, Context& context);

}  // namespace relume
