// SPDX-License-Identifier: MIT
// A bake's caches as the runtime's receivers read them. It takes a while: loops want one that stays.
#pragma once

#include "runtime/shared/packed_caches.h"

#include <memory_resource>

namespace relume::test {

inline PackedCaches packed(const Caches& caches) { return PackedCaches(caches, std::pmr::new_delete_resource()); }

}  // namespace relume::test
