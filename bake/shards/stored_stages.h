// SPDX-License-Identifier: MIT
// Play space and caches by way of a store: found where shapes and options are those of an earlier bake, whatever its
// colours; made and kept where they are not.
#pragma once

#include "bake/shards/entry_names.h"
#include "bake/stages.h"
#include "bake/store/entry_cache.h"

namespace relume {

// Keeps references to all it is made from.
PlaceStages storedStages(const Scene& scene, const BakeOptions& options, const EntryNames& names, EntryCache& store);

}  // namespace relume
