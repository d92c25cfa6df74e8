// SPDX-License-Identifier: MIT
// Options of bakes for tests: a tiny one takes hundredths of a second, so that hundreds of levels can be baked; a small
// one of the sample level tenths, and its light is right to some ten percent.
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

inline BakeOptions smallBakeOptions() {
  BakeOptions options = presetOptions(Preset::draft);
  options.playSpace.walks = 20000;
  options.surfels.count = 2048;
  options.caches.gridCaches = 60;
  options.caches.lightmapCaches = 600;
  options.links.linksPerCache = 48;
  options.links.raysPerCache = 128;
  return options;
}

}  // namespace relume::test
