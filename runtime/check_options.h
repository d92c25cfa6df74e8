// SPDX-License-Identifier: MIT
// What a relighter or the passes of a level are made from: the bake's arrays, and its recommendation and the host's
// wishes, settled.
#pragma once

#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/shared/bands.h"
#include "runtime/shared/driven_emission.h"

#include <memory_resource>

namespace relume {

struct CheckedOptions {
  Bake bake;  // shares the arrays that frames need
  CacheBands bands;
  ImageSizes images;
};

// invalidFile: the bake breaks an invariant; usage: bands, gridTrust or a driven image that cannot be. memory: keeps
// what comes back. Throws std::bad_alloc.
Result<CheckedOptions> checkOptions(const Bake& bake, const RelightOptions& options, std::pmr::memory_resource* memory);

}  // namespace relume
