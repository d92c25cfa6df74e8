// SPDX-License-Identifier: MIT
// What a glTF material says of its textures, and the bytes of the images behind them. For the importer's files alone.
#pragma once

#include "bake/import/gltf_document.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/result.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relume {

// A JSON number, clamped to what floats hold.
float toFloat(double value);

// A texture slot of a glTF material before images are numbered and coordinates assigned.
struct TextureSlot {
  int image = -1;  // glTF image; -1 = none
  int set = 0;     // TEXCOORD_n
  TextureRef ref;
};

// The KHR_texture_transform among a textureInfo's extensions; no object where there is none.
tinygltf::Value transformOf(const tinygltf::ExtensionMap& extensions);

// The slot of a texture (-1 = none). `where` is the JSON path, for messages; a texture without an image is none, with a
// warning. invalidFile: no such texture; unsupported: it has an image of a kind that is not read.
Result<TextureSlot> readSlot(const GltfDocument& document, int texture, int texcoord, const tinygltf::Value& transform,
                             const std::string& where, Context& context);

// "materials[3] 'brick'".
std::string materialPath(const tinygltf::Material& material, int index);

// Null where the material has no such extension.
const tinygltf::Value* extensionOf(const tinygltf::Material& material, const char* name);

// Name and file bytes of an image, not decoded. `bytes` are the document's, or in `fileBytes`. io, invalidFile,
// unsupported: not readable, not PNG or JPEG, of another format.
Result<Image> readImage(GltfDocument& document, std::size_t index, std::vector<std::uint8_t>& fileBytes,
                        std::span<const std::uint8_t>& bytes);

// Ask the memory budget for images of so many texels, with mip levels; the largest is held twice while it is decoded.
Status reserveTexels(std::uint64_t texels, std::uint64_t largest, std::size_t images, Context& context);

}  // namespace relume
