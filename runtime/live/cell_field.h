// SPDX-License-Identifier: MIT
// Light of a volume's cells by direction: spherical harmonics of Y, Co and Cg with fewer bands of chroma than of luma
// (CRC Section 4). What CRC keeps in volume textures: groups of four numbers a cell, of which one marks active cells.
#pragma once

#include "formats/sh.h"
#include "runtime/shared/bands.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace relume {

inline constexpr int kMaxFieldBands = 3;
inline constexpr std::size_t kMaxFieldNumbers = 28;  // of Y3Co3Cg3
using FieldNumbers = std::array<float, kMaxFieldNumbers>;

// Textures of four channels that a volume takes: ceil((l_Y² + 2 l_C² + 1) / 4), 7, 5 and 3 for Y3Co3Cg3, Y3Co2Cg2 and
// Y3Co1Cg1 (CRC Section 4). [bands 1..3]
constexpr std::size_t fieldTextures(const Bands& bands) {
  return static_cast<std::size_t>(bands.luma * bands.luma + 2 * bands.chroma * bands.chroma + 4) / 4;
}

struct CellField {
  Bands bands;                 // luma and chroma 1..3
  std::vector<float> numbers;  // [W/m²/sr] [Size cells * stride()] Y, Co, Cg of a cell, then 1 where it is active or -1

  std::size_t lumaCount() const { return static_cast<std::size_t>(bands.luma * bands.luma); }
  std::size_t chromaCount() const { return static_cast<std::size_t>(bands.chroma * bands.chroma); }
  std::size_t count() const { return lumaCount() + 2 * chromaCount(); }
  std::size_t stride() const { return 4 * fieldTextures(bands); }
  float* at(std::uint32_t cell) { return numbers.data() + stride() * cell; }
  const float* at(std::uint32_t cell) const { return numbers.data() + stride() * cell; }
  bool isActive(std::uint32_t cell) const { return at(cell)[count()] > 0.0f; }
};

// No light, in no active cell. Keeps the field's memory.
void clearField(const Bands& bands, std::size_t cells, CellField& field);

// Add the trilinear mean of the cells around a place to `sum`, and to `missed` how many are not active. Cells that are
// not active are left out and the others share their weight. Returns whether there is an active one. [position in
// cells, finite]
bool addField(const CellField& field, const VolumeGrid& grid, const glm::vec3& position, FieldNumbers& sum,
              int* missed = nullptr);

// Factors of the clamped cosine about a unit direction: irradiance is their dot product with radiance coefficients
// (Ramamoorthi and Hanrahan 2001).
using FieldLobe = std::array<float, static_cast<std::size_t>(kMaxFieldBands* kMaxFieldBands)>;
FieldLobe clampedLobe(const glm::vec3& normal);

// Irradiance as Y, Co, Cg [W/m²]. May be negative where few bands ring.
glm::vec3 irradianceOf(const CellField& field, const FieldNumbers& numbers, const FieldLobe& lobe);

}  // namespace relume
