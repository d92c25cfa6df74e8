// SPDX-License-Identifier: MIT
// The options of a bake that takes hundredths of a second, for tests that bake hundreds of levels.
#pragma once

#include "relume/bake/options.h"

namespace relume::test {

inline BakeOptions tinyBakeOptions() {
  BakeOptions options = presetOptions(Preset::draft);
  options.playSpace.walks = 1000;
  options.surfels.count = 64;
  options.caches.gridCaches = 16;
  options.caches.lightmapCaches = 24;
  options.links.linksPerCache = 16;
  options.links.raysPerCache = 32;
  options.links.skyPatches = 8;
  return options;
}

}  // namespace relume::test
