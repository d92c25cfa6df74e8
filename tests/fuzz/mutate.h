// SPDX-License-Identifier: MIT
// Structure-aware mutations for the fuzz targets: a JSON value changed in one place so that the text stays JSON, a GLB
// cut into its chunks and put together again, and a scene with the files it refers to in one input.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relume::fuzz {

using Bytes = std::vector<std::uint8_t>;
using Random = std::minstd_rand;

// libFuzzer's own mutation of some bytes; the result has at most `most` bytes.
void mutateBytes(Bytes& bytes, std::size_t max);

// Change one value, member or element of a JSON text; `words` are names and strings to draw from. Text that is not JSON
// is changed as bytes.
std::string mutateJson(std::string_view text, std::size_t max, std::span<const char* const> words, Random& random);

// Change a .glb (in its JSON, its binary chunk or as bytes) or a .gltf.
Bytes mutateGltf(std::span<const std::uint8_t> file, std::size_t max, Random& random);

// A .gltf, a buffer and an image in one input: their first two sizes as u32, then their bytes.
struct FileSet {
  Bytes scene, buffer, image;
};
FileSet splitFiles(std::span<const std::uint8_t> input);
Bytes joinFiles(const FileSet& files);

// libFuzzer's hook: mutate data in place and return its new size.
std::size_t store(const Bytes& mutated, std::uint8_t* data, std::size_t max);

}  // namespace relume::fuzz
