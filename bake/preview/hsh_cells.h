// SPDX-License-Identifier: MIT
// What the light of a record's cells adds to hemispherical coefficients of radiance and to their gradient, as
// hemisphere_cells.h has it for the irradiance vector, with H_lm in place of the direction and of the cosine:
//   lambda_lm = sum of L_i Int H_lm domega
//   gradient of lambda_lm = sum over borders a|b of (L_b - L_a) / min(r_a, r_b) Int H_lm m ds
// (Krivanek, Gautron, Bouatouch, Pattanaik, "Improved Radiance Gradient Computation", SCCG 2005.)
#pragma once

#include "bake/preview/hemisphere_cells.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace relume {

struct HshCells {
  int order = 0;
  // [sr] Int H_lm domega over each cell [Size cells * order²]
  std::vector<float> integral;
  // [sr] Int H_lm m ds along the border with the next column and with the next row, for all lm the x of m, then the y
  // [Size cells * 2 order²]
  std::vector<float> toNextColumn, toNextRow;
};

// Tables of cells, made once. [order 1..kMaxHshOrder]
HshCells hshCells(const HemisphereCells& cells, int order);

// Numbers of a record's light: order² coefficients of R, of G, of B, then the same of the gradient along the tangent,
// and along the bitangent.
constexpr std::size_t hshRecordSize(int order) { return static_cast<std::size_t>(9 * order * order); }

// The coefficients and the gradient in the frame of the cells. distance [m]: infinite where nothing is met; negative
// below the surface, where borders have no term. [Size radiance = distance = cells] [Size sums = hshRecordSize()]
void sumHshCells(const HemisphereCells& cells, const HshCells& tables, std::span<const glm::vec3> radiance,
                 std::span<const float> distance, std::span<float> sums);

}  // namespace relume
