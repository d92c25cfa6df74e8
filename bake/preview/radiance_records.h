// SPDX-License-Identifier: MIT
// Radiance records (RCS 4.1, "Extension to Radiance Caching"): what arrives at a surface from each direction, by
// hemispherical harmonics, so that glossy surfaces can be lit by it whatever they are seen from.
//
// In: what was gathered for records. Out: their light at receivers between them, and what lobes there mirror of it.
#pragma once

#include "bake/preview/glossy_lobe.h"
#include "bake/preview/hsh.h"
#include "bake/preview/hsh_cells.h"
#include "bake/preview/place_records.h"
#include "bake/preview/record_tiles.h"

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// The least order that carries a lobe of an exponent. [1..kMaxHshOrder]
int hshOrderOf(float exponent);

// What arrives at a receiver, interpolated between records, in a frame of its own. Memory of one thread, kept from one
// receiver to the next.
struct RadianceSplat {
  float weight = 0.0f;                // sum of w_k; 0: no record reaches here
  glm::mat3 frame{1.0f};              // tangent, bitangent, normal
  std::vector<float> light;           // [W/m²/sr, times sr] coefficients of R, of G, of B [Size 3 order²]
  std::vector<float> uniform;         // of a world of radiance 1, as far as records see into this frame [Size order²]
  std::vector<float> turned, tilted;  // of one record
  std::vector<RecordTiles::Weighed> records;  // that are read
};

class RadianceRecords {
 public:
  // Keeps the cells and the lobes, whose order records get, by reference. accuracy: of the records, which says how far
  // they may be turned against what they light.
  RadianceRecords(const HemisphereCells& cells, const LobeTable& lobes, float accuracy, RecordReach reach);

  int order() const { return tables_.order; }
  // Keeps what placeRecords() gathers. Records are numbered as there. exponents: of the lobes at the pixels' centres;
  // guarded records reach no farther than their own pixel's allows. Kept by reference.
  RecordKeeper keeper(std::span<const float> exponents);

  // What rasterisers splat by: the records' light, the frames of their cells, and what turns and reads it.
  std::span<const float> coefficients() const { return coefficients_; }  // [Size records * hshRecordSize()]
  std::span<const glm::mat3> frames() const { return frames_; }          // [Size records]
  const HshTilt& tilt() const { return tilt_; }
  const LobeTable& lobes() const { return lobes_; }

  // RCS Eq. (1) over coefficients: each record's are extrapolated by their gradient, then turned into the frame of the
  // receiver. `tiles` are of the records that were kept.
  void splat(const RecordTiles& tiles, std::span<const Record> records, std::uint32_t x, std::uint32_t y,
             const PixelReceiver& receiver, RadianceSplat& sums) const;

 private:
  void add(const Record& record, const RecordTiles::Weighed& weighed, RadianceSplat& sums) const;
  std::size_t size() const { return static_cast<std::size_t>(tables_.order * tables_.order); }

  const HemisphereCells& cells_;
  HshCells tables_;
  HshTilt tilt_;
  const LobeTable& lobes_;
  RecordReach reach_;
  std::vector<glm::mat3> frames_;    // [Size records] of their cells
  std::vector<float> coefficients_;  // [Size records * hshRecordSize()]
};

// RCS Eq. (9): the mean radiance in a lobe about an axis, of what a splat has; black where that is negative. The axis
// is unit, in the world.
//
// Deviation: a record does not see what lies below its own horizon, which a receiver that is turned against it does.
// What is missing is taken to be as bright as the rest of the lobe, so that a uniform world is mirrored as it is.
glm::vec3 mirroredLight(const RadianceSplat& splat, const LobeTable& lobes, float exponent, const glm::vec3& axis);

}  // namespace relume
