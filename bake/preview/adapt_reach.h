// SPDX-License-Identifier: MIT
// Adaptive caching (Krivanek, Bouatouch, Pattanaik, Zara, "Making Radiance and Irradiance Caching Practical: Adaptive
// Caching and Neighbor Clamping", EGSR 2006): records that contradict each other reach too far.
#pragma once

#include "bake/preview/record_tiles.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Wherever two records differ at a pixel by more than `contrast` of its light (or of a tenth of the mean light of all
// pixels, if that is more), keep both from reaching that pixel: Record::limit. Pixels that no record reaches any more
// are to get one of their own. Returns how many records were limited. The same at any thread count. tiles: of `records`
// as they are. [Size receivers = width * height]
std::uint32_t limitReaches(const RecordTiles& tiles, std::span<const PixelReceiver> receivers, std::uint32_t width,
                           float contrast, std::vector<Record>& records, Context& context);

}  // namespace relume
