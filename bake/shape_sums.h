// SPDX-License-Identifier: MIT
// A mesh's positions and normals, told apart up to exporters' noise. Exporters write the same normal with other last
// digits from run to run. A hash of rounded numbers cannot forgive that: wherever the rounding's borders are, some of
// 100,000 normals lie on one. So a bake keeps sums over blocks of vertices, and noise is what moves a sum by less than
// noise can: a difference, not a border, decides.
#pragma once

#include "relume/bake/scene.h"
#include "relume/bake_data.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kShapeBlock = 32;  // vertices

// Sums of a mesh, kShapeWords a block: for x, y and z of the positions, then of the normals, sum w_i v_i over the
// block's vertices in units of 1e-9, modulo 2^32. w_i from 0.5 up by 1/64: no zero, so that one vertex cannot hide; no
// two alike, so that two cannot swap.
std::vector<std::uint32_t> shapeSums(const Mesh& mesh);
std::uint32_t shapeBlocks(const Mesh& mesh);

// Whether the sums of a mesh may be `then` but for noise. `metresPerUnit` [> 0]: of the mesh's own space. A vertex
// alone is noticed when a coordinate moves by more than 0.4 micrometres, or 2e-6 of the mesh's largest coordinate where
// that is more (there a float's own steps are 1.2e-7 of it at most), or a normal's component by more than 8e-6.
bool sameShape(const Mesh& mesh, std::span<const std::uint32_t> then, float metresPerUnit);

}  // namespace relume
