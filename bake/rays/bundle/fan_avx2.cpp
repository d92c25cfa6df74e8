// SPDX-License-Identifier: MIT
// The walk with registers of 8 floats; see fan_walk.h.
#include "bake/rays/bundle/fan_walk.h"

namespace relume {

void traceFanAvx2(const FanJob& job) { Walk(job).run(); }

}  // namespace relume
