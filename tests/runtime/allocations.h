// SPDX-License-Identifier: MIT
// How often this program has called operator new, of all threads together (allocations.cpp counts).
#pragma once

#include <cstddef>

namespace relume::test {

std::size_t allocations();

}  // namespace relume::test
