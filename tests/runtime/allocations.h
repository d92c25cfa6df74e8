// SPDX-License-Identifier: MIT
// How often this program has called operator new, of all threads together (allocations.cpp counts). Sanitizers have an
// operator new of their own: with them nothing is counted.
#pragma once

#include <cstddef>

namespace relume::test {

std::size_t allocations();
bool countsAllocations();

}  // namespace relume::test
