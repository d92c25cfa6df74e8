// SPDX-License-Identifier: MIT
// Writes the links of a cut: spherical-harmonic coefficients (PIC Eq. (2)), direction and cone (PIC 4.6), or irradiance
// alone, plain or packed (formats/compact_links.h).
#pragma once

#include "bake/links/select_cut.h"
#include "formats/compact_links.h"
#include "relume/links.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Links of consecutive caches, before all rows are joined.
struct LinkRowBuilder {
  explicit LinkRowBuilder(LinkKind kind) : compact(kind) {}
  std::vector<std::uint32_t> length;  // [Size caches] links of a cache
  std::vector<std::uint32_t> shNode;  // as in Links
  std::vector<std::uint16_t> shCoefficients;
  std::vector<ConeLink> cone;
  CompactLinkWriter compact;
};

// Sums over rays of w (x, y, z, 1) times 1, z, x², x y and y².
struct Moments {
  typedef float Four __attribute__((vector_size(16)));
  Four one{}, z{}, xx{}, xy{}, yy{};
};

// Memory of one thread.
struct ProjectScratch {
  std::vector<std::uint32_t> linkOf;  // [Size visible leaves]
  std::vector<Moments> moments;       // [Size links]
  std::vector<float> coefficients;    // [Size links * bands²]
};

// Append a row of links with a cone (cone, irradiance in the grid): f, the mean direction of the rays, and the
// cone whose band 1 is theirs.
void appendConeRow(const VisibleSubtree& tree, std::span<const CutLink> cut, LinkKind kind, LinkRowBuilder& rows);

// Append a row of links with coefficients (sh), or whose shapes are chosen by them (oct6): every ray's basis
// functions summed into the link its leaf lies under. [bands 1..8]
void appendShRow(const VisibleSubtree& tree, std::span<const CutLink> cut, std::span<const Arrival> arrivals,
                 LinkKind kind, std::uint32_t bands, ProjectScratch& scratch, LinkRowBuilder& rows);

// Append a row of irradiance links of a cache on a surface (formats/compact_links.h).
void appendIrradianceRow(const VisibleSubtree& tree, std::span<const CutLink> cut, LinkRowBuilder& rows);

// Append a row of any kind.
void appendRow(const VisibleSubtree& tree, std::span<const CutLink> cut, std::span<const Arrival> arrivals,
               bool onSurface, LinkKind kind, std::uint32_t bands, ProjectScratch& scratch, LinkRowBuilder& rows);

}  // namespace relume
