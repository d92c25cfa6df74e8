// SPDX-License-Identifier: MIT
// How often, and for how much, this program has called operator new, of all threads together (allocations.cpp counts).
// Sanitizers have an operator new of their own: with them nothing is counted or refused.
#pragma once

#include <cstddef>

namespace relume::test {

std::size_t allocations();
bool countsAllocations();
// Let the n-th allocation from here on, counted from 1, end in std::bad_alloc; 0 = none. Returns whether the last one
// asked for has been refused.
bool refuseAllocation(std::size_t n);
// [byte] the largest since forgetLargest().
std::size_t largestAllocation();
void forgetLargest();
// From now on refuse those of so many bytes and more; 0 = none.
void refuseAllocationsFrom(std::size_t bytes);

}  // namespace relume::test
