// SPDX-License-Identifier: MIT
// Bakes, larger each time, until one certifies the error that was asked for (BudgetOptions::maxError).
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake_data.h"
#include "relume/result.h"

#include <functional>

namespace relume {

// A bake with budgets of cost alone; usage: they are too small for the level.
using BakeOnce = std::function<Result<Bake>(const BakeOptions& options)>;

// What `bakeOnce` gives for the options, where they ask for no error; else the smallest that was tried and is good
// enough. Its provenance has `asked`. Tells each try as an info, and as a warning where the error is met by what is
// below the certificate's noise. failed: none was good enough, or there is nothing to certify; else what bakeOnce()
// says.
Result<Bake> bakeToError(const BakeOptions& asked, Context& context, const BakeOnce& bakeOnce);

}  // namespace relume
