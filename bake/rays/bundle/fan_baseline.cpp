// SPDX-License-Identifier: MIT
// The walk for any processor; see fan_walk.h.
#include "bake/rays/bundle/fan_walk.h"

namespace relume {

void traceFanBaseline(const FanJob& job) { Walk(job).run(); }

}  // namespace relume
