// SPDX-License-Identifier: MIT
// What a bake costs a game, from the sizes of its arrays: memory on the CPU, as Relighter::bufferSizes() adds it up,
// and a frame's time by one thread of the reference processor. Sums of counts times constants, so that the same level
// gets the same answer on every machine; docs/notes/budgets.md has how the constants were measured and how well they
// hold.
#pragma once

#include "relume/bake/options.h"
#include "relume/bake_data.h"

#include <cstdint>

namespace relume {

// The processor whose times these are: one thread of an AMD EPYC of family 26 (Zen 5) with AVX-512, at 2.6 GHz nominal.
inline constexpr const char* kReferenceProcessor = "AMD EPYC (family 26, model 2), one thread";

struct RuntimeCost {
  double bytes = 0.0;
  double frameMs = 0.0;  // of the reference processor: relight() under a sun and a spot light, with a bounce
};

// All that the cost of a bake follows from.
struct CostSizes {
  double surfels = 0.0;
  double skyPatches = 0.0;
  double gridCaches = 0.0, mapCaches = 0.0;
  double texels = 0.0;          // of the light map
  double sightWords = 0.0;      // as many as texels where walls stand between them, else 0
  double gridIndexBytes = 0.0;  // of what look-ups keep of CacheGrid's arrays
  LinkKind linkKind = LinkKind::oct6;
  std::uint32_t linkBands = 0;  // of SH links
  std::uint32_t lumaBands = 1, chromaBands = 1;
};
CostSizes costSizesOf(const Bake& bake);
// What options decide alone: kind of links and bands, and nothing of which there are counts.
CostSizes costSizesOf(const BakeOptions& options);
// Of what is placed, whose links are not traced yet.
CostSizes costSizesOf(const Surfels& surfels, const Hierarchy& hierarchy, const Caches& caches,
                      const BakeOptions& options);

RuntimeCost costWithoutLinks(const CostSizes& sizes);
RuntimeCost costOfLink(const CostSizes& sizes);
// The whole bake, as a relighter has it by default.
RuntimeCost runtimeCost(const Bake& bake);

}  // namespace relume
