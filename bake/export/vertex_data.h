// SPDX-License-Identifier: MIT
// Vertices as bytes: elements of any accessor, copied in any order without a look at what they mean.
#pragma once

#include "bake/export/level_document.h"
#include "bake/import/gltf_accessors.h"
#include "relume/result.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relume {

// [byte] of an element of an accessor; 0 = a type that glTF does not know.
std::size_t elementBytes(const nlohmann::json& accessor);

// The elements of an accessor, one after the other, sparse ones put in.
struct RawElements {
  std::size_t size = 0;             // [byte] of an element
  std::vector<std::uint8_t> bytes;  // [Size size * count]

  std::size_t count() const { return size == 0 ? 0 : bytes.size() / size; }
};

// invalidFile: no such accessor, a type that glTF does not know, bytes that are not there.
Result<RawElements> readRaw(const LevelDocument& document, int accessor, const std::string& where);

// An element's numbers as JSON, alone or in an array: those of integer types to the last digit. No matrix, and nothing
// that is normalised.
nlohmann::json numbersOf(const nlohmann::json& accessor, std::span<const std::uint8_t> element);

// Numbers as elements of an accessor's component type: the way back from AccessorReader's and Draco's floats.
Result<RawElements> encodeRaw(const LevelDocument& document, int accessor, const AccessorValues& values,
                              const std::string& where);

// A new accessor with elements source[0], source[1] .. and everything else as `accessor` has it: type, normalisation,
// name, extras. Where it has min and max, they are these elements'. invalidFile: a source is not among the elements.
Result<int> copyElements(LevelDocument& document, int accessor, const RawElements& elements,
                         std::span<const std::uint32_t> source, const std::string& where);

// A new accessor of vertex indices below vertexCount, of componentType (5121, 5123, 5125) if they fit, else larger.
int addIndices(LevelDocument& document, std::span<const std::uint32_t> indices, std::uint32_t vertexCount,
               int componentType);

// A new accessor of light-map coordinates: two 16-bit normalised integers a vertex, from packUnorm16x2.
int addCoordinates(LevelDocument& document, std::span<const std::uint32_t> packed);

}  // namespace relume
