// SPDX-License-Identifier: MIT
// Writes the links of a cut: spherical-harmonic coefficients (PIC Eq. (2)) or direction and cone (PIC 4.6).
#pragma once

#include "bake/links/touched_tree.h"
#include "formats/links.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Links of consecutive caches, before all rows are joined.
struct LinkRows {
  std::vector<std::uint32_t> length;  // [Size caches] links of a cache
  std::vector<std::uint32_t> shNode;  // as in Links
  std::vector<std::uint16_t> shCoefficients;
  std::vector<ConeLink> cone;
};

// Memory of one thread.
struct ProjectScratch {
  std::vector<std::uint32_t> linkOf;  // [Size touched nodes] link of a leaf's slot
  std::vector<std::uint32_t> stack;
  std::vector<float> coefficients;  // [Size links * bands²]
};

// Append a row of cone links: f, the mean direction of the rays, and the cone whose band 1 is theirs.
void appendConeRow(const TouchedTree& tree, std::span<const std::uint32_t> cut, LinkRows& rows);

// Append a row of SH links: every ray's basis functions summed into the link its leaf lies under. [bands 1..8]
void appendShRow(const TouchedTree& tree, std::span<const std::uint32_t> cut, std::span<const Arrival> arrivals,
                 std::uint32_t bands, ProjectScratch& scratch, LinkRows& rows);

}  // namespace relume
