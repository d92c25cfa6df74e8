// SPDX-License-Identifier: MIT
// A bake without a baker, of any size: an empty box of a room, its walls covered by surfels and by a light map, its air
// by a grid. Nothing is hidden in a box, so links come from geometry alone. For tests of the runtime and its speed.
#pragma once

#include "relume/bake_data.h"

#include <vector>

namespace relume::test {

struct SyntheticOptions {
  std::uint32_t surfels = 2048;
  std::uint32_t skyPatches = 0;
  glm::uvec3 grid{4, 3, 4};
  std::uint32_t lightmapSize = 24;     // [texel] a side
  std::uint32_t lightmapCaches = 300;  // at most what the walls' texels offer
  std::uint32_t linksPerCache = 64;
  LinkKind kind = LinkKind::cone;
  std::uint32_t bands = 4;  // of SH links
  std::uint32_t seed = 1;
};

// PIC's high setting: n_S 131072, n_C 10585, n_L 254; and its moderate one: n_S 32768, n_L 128.
inline SyntheticOptions highSetting() { return {131072, 0, {24, 8, 12}, 98, 8281, 254, LinkKind::oct6, 4, 1}; }
inline SyntheticOptions moderateSetting() { return {32768, 0, {24, 8, 12}, 98, 8281, 128, LinkKind::oct6, 3, 1}; }

// Each row's transfers are scaled to cover the hemisphere (surface caches) or sphere (grid caches) exactly.
Bake makeSyntheticBake(const SyntheticOptions& options);

// Sight of any kind for a third of the squares of its light map.
void addSight(Bake& bake);

// A synthetic bake whose cells have bricks of any of its grid's caches, hanging and missing points, and whose caches
// see any distance.
Bake makeBakeWithBricks(const glm::uvec3& resolution, bool bricks, bool depths);

// A receiver as a host may hand it over by a fault of its own: any mix of ordinary, huge, infinite and NaN numbers.
struct WeirdReceiver {
  glm::vec3 position, normal;  // position.xy is also a light-map coordinate

  bool canShade() const;  // finite, and no longer than normals may be
  bool isInGrid() const;
  bool isOnMap() const;
};
// Every combination of the components of a position, and of those of a normal.
std::vector<WeirdReceiver> weirdReceivers();

}  // namespace relume::test
