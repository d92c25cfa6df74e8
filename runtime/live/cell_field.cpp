// SPDX-License-Identifier: MIT
// See cell_field.h.
#include "runtime/live/cell_field.h"

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

namespace relume {

void clearField(const Bands& bands, std::size_t cells, CellField& field) {
  field.bands = bands;
  const std::size_t stride = field.stride(), mark = field.count();
  field.numbers.assign(stride * cells, 0.0f);
  for (std::size_t c = 0; c < cells; ++c) field.numbers[stride * c + mark] = -1.0f;
}

bool addField(const CellField& field, const VolumeGrid& grid, const glm::vec3& position, FieldNumbers& sum,
              int* missed) {
  const glm::vec3 at = position - 0.5f, base = glm::floor(at), share = at - base;
  if (!(glm::all(glm::greaterThan(base, glm::vec3(-2.0f))) && glm::all(glm::lessThan(base, glm::vec3(grid.cells)))))
    return false;
  std::array<const float*, 8> corner;
  std::array<float, 8> weight;
  std::size_t found = 0;
  float all = 0.0f;
  for (int k = 0; k < 8; ++k) {
    const glm::ivec3 step(k & 1, k >> 1 & 1, k >> 2), cell = glm::ivec3(base) + step;
    if (glm::any(glm::lessThan(cell, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(cell, grid.cells))) continue;
    const std::uint32_t index = grid.cellIndex(cell);
    if (!field.isActive(index)) {
      if (missed != nullptr) ++*missed;
      continue;
    }
    float w = 1.0f;
    for (int a = 0; a < 3; ++a) w *= step[a] != 0 ? share[a] : 1.0f - share[a];
    corner[found] = field.at(index);
    weight[found++] = w;
    all += w;
  }
  if (!(all > 1e-6f)) return false;
  const std::size_t count = field.count();
  for (std::size_t k = 0; k < found; ++k) {
    const float w = weight[k] / all;
    for (std::size_t i = 0; i < count; ++i) sum[i] += w * corner[k][i];
  }
  return true;
}

FieldLobe clampedLobe(const glm::vec3& normal) {
  FieldLobe lobe;
  evaluateSh(kMaxFieldBands, normal, lobe);
  const std::span<const float> factor = clampedCosineFactors();
  for (std::size_t i = 0; i < lobe.size(); ++i) lobe[i] *= factor[i == 0 ? 0 : i < 4 ? 1 : 2];
  return lobe;
}

glm::vec3 irradianceOf(const CellField& field, const FieldNumbers& numbers, const FieldLobe& lobe) {
  glm::vec3 e(0.0f);
  const std::size_t luma = field.lumaCount(), chroma = field.chromaCount();
  for (std::size_t i = 0; i < luma; ++i) e.x += lobe[i] * numbers[i];
  for (std::size_t i = 0; i < chroma; ++i) {
    e.y += lobe[i] * numbers[luma + i];
    e.z += lobe[i] * numbers[luma + chroma + i];
  }
  return e;
}

}  // namespace relume
