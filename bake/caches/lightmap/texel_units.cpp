// SPDX-License-Identifier: MIT
// See texel_units.h.
#include "bake/caches/lightmap/texel_units.h"

#include "bake/base/morton.h"

#include <glm/common.hpp>

#include <algorithm>

namespace relume {
namespace {

// Texels with a smaller share of surface than this choose together: in groups of this many texels' width that look the
// same way.
constexpr float kSmallShare = 0.25f;
constexpr float kGroupTexels = 0.4f;

// The face of a cube that a normal goes through.
std::uint32_t sideOf(const glm::vec3& n) {
  const glm::vec3 a = glm::abs(n);
  const int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
  return static_cast<std::uint32_t>(2 * axis + (n[axis] < 0.0f ? 1 : 0));
}

struct SmallTexel {
  std::uint64_t group;
  std::uint32_t look, texel;
};

// The unit of the texels of one group.
TexelUnit unitOf(const PatchSet& set, const PatchTexels& texels, const TexelSpots& spots,
                 std::span<const SmallTexel> group) {
  TexelUnit unit{kNone, 0.0f, true, 0.0f, {}};
  for (const SmallTexel& small : group) {
    const std::uint32_t texel = small.texel;
    unit.weight += spots.share[texel];
    const bool better =
        unit.texel == kNone || spots.invalid[texel] < spots.invalid[unit.texel] ||
        (spots.invalid[texel] == spots.invalid[unit.texel] && spots.share[texel] > spots.share[unit.texel]);
    if (better) unit.texel = texel;
  }
  unit.closed = spots.invalid[unit.texel] != 0;
  unit.texelSize = texelSizeOf(set, texels, unit.texel);
  unit.spot = spots.spot[unit.texel];
  return unit;
}

}  // namespace

std::vector<TexelUnit> makeTexelUnits(const PatchSet& set, const PatchTexels& texels, const TexelSpots& spots,
                                      std::span<const std::uint32_t> some) {
  // Texels by themselves, and the others by their groups.
  const float groupSize = kGroupTexels * std::max(texels.texelSize, 1e-12f);
  std::vector<TexelUnit> units;
  std::vector<SmallTexel> small;
  for (const std::uint32_t texel : some) {
    const SurfaceSpot& spot = spots.spot[texel];
    if (spots.share[texel] >= kSmallShare) {
      units.push_back({texel, spots.share[texel], spots.invalid[texel] != 0, texelSizeOf(set, texels, texel), spot});
      continue;
    }
    small.push_back({mortonOf((spot.positionWorld - spots.low) / groupSize), sideOf(spot.normal), texel});
  }
  std::sort(small.begin(), small.end(), [](const SmallTexel& a, const SmallTexel& b) {
    if (a.group != b.group) return a.group < b.group;
    return a.look != b.look ? a.look < b.look : a.texel < b.texel;
  });
  for (std::size_t begin = 0, end = 0; begin < small.size(); begin = end) {
    while (end < small.size() && small[end].group == small[begin].group && small[end].look == small[begin].look) ++end;
    units.push_back(unitOf(set, texels, spots, std::span(small).subspan(begin, end - begin)));
  }
  std::stable_sort(units.begin(), units.end(),
                   [](const TexelUnit& a, const TexelUnit& b) { return a.weight > b.weight; });
  return units;
}

}  // namespace relume
