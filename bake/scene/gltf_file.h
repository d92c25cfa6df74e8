// SPDX-License-Identifier: MIT
// Bytes of a glTF: whole files, the GLB container, data URIs and files beside the scene. Nothing outside the scene's
// folder is read, and nothing is allocated that the bytes on disk do not justify.
#pragma once

#include "formats/result.h"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relume {

// All bytes of a regular file. io: missing, not a regular file, not readable.
Result<std::vector<std::uint8_t>> readFileBytes(const std::filesystem::path& path, const std::string& where);

struct GltfContainer {
  std::string json;
  std::vector<std::uint8_t> binary;  // the GLB's BIN chunk
  bool hasBinary = false;
};

// A .glb by its magic, anything else as the JSON of a .gltf. invalidFile: header or chunk lengths do not fit the file.
Result<GltfContainer> splitContainer(std::vector<std::uint8_t> bytes, const std::string& file);

// The bytes of a data URI, or of a file beside the scene, which is then added to `filesRead`. invalidFile: not base64,
// or leaves the folder (absolute, "..", a link that points out, another scheme); io: not readable.
Result<std::vector<std::uint8_t>> readUri(const std::string& uri, const std::filesystem::path& folder,
                                          const std::string& where, std::vector<std::filesystem::path>& filesRead);

}  // namespace relume
