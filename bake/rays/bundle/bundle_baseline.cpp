// SPDX-License-Identifier: MIT
// The walk for any processor; see bundle_walk.h.
#include "bake/rays/bundle/bundle_walk.h"

namespace relume {

void traceBundleBaseline(const BundleJob& job) { Walk(job).run(); }

}  // namespace relume
