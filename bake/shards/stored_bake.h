// SPDX-License-Identifier: MIT
// A bake that keeps what it computes in a store, and takes from there what an earlier one has kept: the plan, by level,
// options and program; and the links of the plan's caches in blocks, which are shards of it. The bytes are those of
// bake(), whatever the store holds and however it fails (docs/notes/store.md).
#pragma once

#include "bake/store/entry_cache.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"

namespace relume {

// Errors as of bake(): none of the store's, which are warnings. What the stages of a plan have said is said again where
// the plan is found.
Result<Bake> bakeWithStore(const Scene& scene, const BakeOptions& options, EntryCache& store, Context& context);

}  // namespace relume
