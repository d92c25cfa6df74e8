// SPDX-License-Identifier: MIT
// What the runtime relies on, so that no frame reads outside an array or divides by nothing.
#pragma once

#include "relume/bake_data.h"
#include "relume/result.h"

namespace relume {

// invalidFile: an array's size, an index or a number breaks an invariant; the message names array and element.
Status checkBake(const Bake& bake);

}  // namespace relume
