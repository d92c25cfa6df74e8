// SPDX-License-Identifier: MIT
// How many surfels, caches and links a bake gets for what it may cost a game (BakeOptions::budget). Sizes grow along a
// line on which the presets `medium` and `high` lie nearly; what surfels and caches leave of a budget becomes links,
// once it is known how many of them the level has.
#pragma once

#include "bake/budget/runtime_cost.h"
#include "relume/bake/options.h"
#include "relume/result.h"

namespace relume {

// The options with the sizes that their budgets allow, before anything is placed; as they are where there is no budget.
// An error to bake for (BudgetOptions::maxError) chooses nothing here: bake_to_error.h.
BakeOptions chooseSizes(const BakeOptions& options);

// The options with all sizes that their budgets allow, once it is known what chooseSizes() has placed: its sizes, and
// the links that are left. usage: too little for 16 links a cache, which no other stage says; tells what would do.
Result<BakeOptions> chooseLinks(const BakeOptions& options, const Surfels& surfels, const Hierarchy& hierarchy,
                                const Caches& caches);

// [MiB] Beyond which more memory changes nothing, or is not allowed.
double largestMemoryMiB(const BakeOptions& options);

}  // namespace relume
