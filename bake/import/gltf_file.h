// SPDX-License-Identifier: MIT
// Bytes of a glTF: whole files, the GLB container, data URIs and files beside the scene. Nothing outside the scene's
// folder is read, and nothing is allocated that the bytes on disk do not justify.
#pragma once

#include "relume/result.h"

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relume {

// [byte, max] of a .gltf's JSON, data URIs and all; buffers of their own files have no such bound.
inline constexpr std::uint64_t kMaxGltfBytes = 1ull << 30;

// Bytes begin..end of something; `end` may lie beyond it.
struct ByteRange {
  std::uint64_t begin = 0, end = std::numeric_limits<std::uint64_t>::max();
};

// A part of a file: what was read of it, from where, and how large the whole is.
struct FileSlice {
  std::vector<std::uint8_t> bytes;
  std::uint64_t begin = 0, fileBytes = 0;

  // Bytes offset..offset + length of the file; nothing where they are not in the file, or were not read.
  std::optional<std::span<const std::uint8_t>> range(std::uint64_t offset, std::uint64_t length) const;
};

// A regular file, or a part of it; no more is read than the range asks for. io: missing, not a regular file, not
// readable.
Result<FileSlice> readFileBytes(const std::filesystem::path& path, const std::string& where, ByteRange range = {});

// A .glb as long as its header says, or a .gltf. Its first bytes are looked at before the rest is read. invalidFile:
// neither of the two, a .gltf of more than kMaxGltfBytes.
Result<std::vector<std::uint8_t>> readSceneBytes(const std::filesystem::path& path, const std::string& file);

struct GltfContainer {
  std::string json;
  std::vector<std::uint8_t> binary;  // the GLB's BIN chunk
  bool hasBinary = false;
};

// A .glb by its magic, anything else as the JSON of a .gltf. invalidFile: header or chunk lengths do not fit the file.
Result<GltfContainer> splitContainer(std::vector<std::uint8_t> bytes, const std::string& file);

// All bytes of a data URI, or the range's of a file beside the scene, which is then added to `filesRead`: under
// `folder` as the URI names it, so that a build system knows it by the name that the scene has, then what links lead to
// from there. invalidFile: not base64, or leaves the folder (absolute, "..", a link that points out, another scheme);
// io: not readable.
Result<FileSlice> readUri(const std::string& uri, const std::filesystem::path& folder, const std::string& where,
                          std::vector<std::filesystem::path>& filesRead, ByteRange range = {});

}  // namespace relume
