// SPDX-License-Identifier: MIT
// Bakes, plans and shards that commands look at, against --max-memory before they are mapped.
#pragma once

#include "relume/bake/context.h"
#include "relume/result.h"

#include <string>
#include <string_view>

namespace relume {

// Done where the file fits into Context::maxMemory (bake/base/memory_budget.h), or is no bake or not there, which its
// reader says better. A bake is held as its file is: mapped, and read whole for its checksums. copies: times that it is
// held.
Status reserveBake(Context& context, std::string_view stage, const std::string& path, double copies = 1.0);

}  // namespace relume
