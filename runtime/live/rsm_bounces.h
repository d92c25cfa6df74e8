// SPDX-License-Identifier: MIT
// Light of the cells from reflective shadow maps: the first bounce (CRC Eq. (2)) and the bounces between cells
// (CRC Eqs. (3), (4)).
#pragma once

#include "relume/relighter.h"
#include "runtime/live/cell_field.h"
#include "runtime/live/cell_visibility.h"
#include "runtime/live/rsm_image.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// What a sample sends to a place P: adds power V cos Y(w) / (d² + softening) to the coefficients of a cell, w the
// direction from P to X and d their distance [m]. Nothing from behind the sample. `occlusion` null: nothing hides it.
//
// Deviation: the softening, the area A that a sample stands for over pi. Print has d² alone, which has no bound near
// the sample; with it no sample fills more of a cell's sphere than pi sr.
void addSample(const RsmSample& sample, const glm::vec3& positionWorld, const CellOcclusion* occlusion, float jitter,
               const Bands& bands, std::span<float> numbers);

// The first bounce in each cell of the list, which are all that are active; others keep what they have. Places are
// anywhere in the cell, each sample at its own, unless `occlusion` says where.
void gatherFirstBounce(std::span<const RsmSample> samples, const CellOcclusion& occlusion,
                       std::span<const std::uint32_t> cells, const ParallelFor& parallelFor, CellField& field);

// Rays between the cells, the same for all of a frame.
struct SecondaryRays {
  std::uint32_t count = 32;    // [1..4096]
  float far = 0.0f;            // [voxels] how long they are
  float averageAlbedo = 0.5f;  // [0..1] of the whole level
  std::uint32_t set = 0;       // raysOfSet()
};

// One bounce more: out = first + T in, with T light over rays between cells and the level's albedo. `out` differs from
// the others.
//
// Erratum: CRC Eq. (3) adds T in to `in` and so counts bounces twice: in a furnace of albedo 1/2 it has 2.25 after two
// passes where there is 1.75.
void gatherNextBounce(const CellField& first, const CellField& in, const SecondaryRays& rays,
                      const CellOcclusion& occlusion, std::span<const std::uint32_t> cells,
                      const ParallelFor& parallelFor, CellField& out);

}  // namespace relume
