// SPDX-License-Identifier: MIT
// The walk with registers of 8 floats; see bundle_walk.h.
#include "bake/rays/bundle/bundle_walk.h"

namespace relume {

void traceBundleAvx2(const BundleJob& job) { Walk(job).run(); }

}  // namespace relume
