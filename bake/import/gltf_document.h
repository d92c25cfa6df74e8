// SPDX-License-Identifier: MIT
// A glTF in memory, checked: tinygltf's model of the JSON, the buffers' bytes (compressed views decoded), and where
// images are. Shared by the importer's files; includes tinygltf.
#pragma once

#include "bake/import/gltf_file.h"
#include "relume/result.h"

#include <tiny_gltf.h>

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

// Whose morph weights animations move.
struct AnimatedWeights {
  std::set<int> nodes, meshes;
};

struct GltfDocument {
  std::string file;  // name without folder, opens every message
  std::filesystem::path folder;
  tinygltf::Model model;                                // without buffers and images: those are below
  std::vector<FileSlice> buffers;                       // of each, what its views ask for
  std::vector<std::vector<std::uint8_t>> decodedViews;  // [Size bufferViews] of EXT_meshopt_compression
  struct ImageSource {
    std::string name, uri;
    int bufferView = -1;
  };
  std::vector<ImageSource> images;
  AnimatedWeights animatedWeights;
  std::vector<std::filesystem::path> files;  // read so far
  std::uint64_t dataBytes = 0;               // JSON, buffers and decoded views: what allocations are measured against

  std::string at(const std::string& what) const { return file + ": " + what; }
  Error invalid(const std::string& where, const std::string& what) const {
    return {ErrorCode::invalidFile, file + ": " + where + ": " + what};
  }

  // The bytes of a buffer view. invalidFile: no such view or buffer, or out of the buffer's bytes.
  Result<std::span<const std::uint8_t>> viewBytes(int view, const std::string& where) const;
};

// Read and check a document and all its buffers.
Result<GltfDocument> loadGltfDocument(const std::filesystem::path& path, Context& context);

// Decode the views of EXT_meshopt_compression into GltfDocument::decodedViews.
Status decodeMeshopt(GltfDocument& document);

// JSON path of an element, for messages: "accessors[3]".
inline std::string jsonPath(const char* array, int index) {
  return std::string(array) + "[" + std::to_string(index) + "]";
}

// A member of an extension as tinygltf keeps it; `fallback` when absent. Types were checked by the schema.
double numberOr(const tinygltf::Value& object, const char* name, double fallback);
int indexOr(const tinygltf::Value& object, const char* name, int fallback);

// Warns of members of extras.relume (at `path`) that nobody reads, as of a misspelt one. told: names that were warned
// of before, which need no second line.
void warnOfUnknownMembers(const GltfDocument& document, const tinygltf::Value& relume, const std::string& path,
                          std::initializer_list<std::string_view> known, std::set<std::string>& told, Context& context);

}  // namespace relume
