// SPDX-License-Identifier: MIT
// How often, and for how much, this program has called operator new, of all threads together (allocations.cpp counts).
// Sanitizers have an operator new of their own: with them nothing is counted.
#pragma once

#include <cstddef>

namespace relume::test {

std::size_t allocations();
bool countsAllocations();
// [byte] the largest since forgetLargest().
std::size_t largestAllocation();
void forgetLargest();

}  // namespace relume::test
