// SPDX-License-Identifier: MIT
// The hemisphere of a record, cut into cells: what the light of a cell adds to the irradiance vector, and what the
// border of two cells adds to the translational gradient. Tables in the frame of the record, whose normal is +Z, made
// once and turned with each record.
//
// Two ways to cut it. fan: the strata of equal projected solid angle that the baker's rays have. plane, scaled, border:
// the pixels of a square in front of the surface, as RCS 5.2 draws them; the square misses the horizon.
//   plane:  what it misses is dark (RCS Table 1 "plane sampling")
//   scaled: all pixels count for more by one factor (Larsen and Christensen 2004)
//   border: each pixel on the border owns in addition the sky behind its outer edges (RCS 5.2)
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <functional>
#include <vector>

namespace relume {

enum class Hemisphere { fan, plane, scaled, border };

struct HemisphereCells {
  std::uint32_t columns = 0, rows = 0;  // cell (i, j) is number j * columns + i
  bool strata = false;                  // cells of DirectionStrata, to be jittered
  // [sr] Int omega d omega over a cell: E = sum of L times its z, I = sum of L times all of it. [Size cells]
  std::vector<glm::vec3> integral;
  // [sr] Int cos theta m ds along the border with the next column and with the next row; m is the unit normal of the
  // border on the sphere toward the next cell, its part in the surface's plane. Zero where there is no next cell.
  // [Size cells]
  std::vector<glm::vec2> toNextColumn, toNextRow;
  std::vector<glm::vec3> direction;  // of the pixels' centres, unit [Size 0 or cells]
  // The unit direction of a point of the grid's square, in cells; how far [cells] the square reaches beyond them, to
  // the horizon; and the factor by which all cells count for more.
  std::function<glm::dvec3(double column, double row)> map;
  double margin = 0.0, scale = 1.0;

  std::uint32_t count() const { return columns * rows; }
};

// The strata of DirectionStrata(rays, 0). rays [16..65536]
HemisphereCells fanCells(std::uint32_t rays);

// side [2..256] pixels along a side of the plane; fovRad (0..pi) the angle that the plane spans along a side. mode:
// plane, scaled or border.
HemisphereCells planeCells(std::uint32_t side, float fovRad, Hemisphere mode);

}  // namespace relume
