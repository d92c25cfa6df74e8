// SPDX-License-Identifier: MIT
// Structure-aware mutations of bake files: one chunk is changed by what its type says it holds (numbers of a float's or
// an index's edges, elements swapped and repeated, rows more or less), the options' JSON as JSON, or header and table;
// sizes, offsets and checksums are made to fit again, but for a few files that are left broken.
#pragma once

#include "tests/fuzz/mutate.h"

namespace relume::fuzz {

Bytes mutateBake(std::span<const std::uint8_t> file, std::size_t max, Random& random);

}  // namespace relume::fuzz
