// SPDX-License-Identifier: MIT
// The tree that bundles of rays walk: eight children per node, up to eight triangles per leaf. Immutable, shared by
// threads.
#pragma once

#include "bake/rays/bundle/bundle_kernel.h"
#include "bake/rays/hit_points.h"

#include <embree3/rtcore.h>

#include <span>
#include <string>
#include <vector>

namespace relume {

class Context;

struct BundleTree {
  std::vector<BundleNode> nodes;  // [0] the root
  std::vector<BundleLeaf> leaves;
  std::uint32_t depth = 0;  // levels of nodes
};

// A triangle on its way into the tree.
struct BundleTriangle {
  Corners corners;         // [m] as traced
  std::uint32_t geometry;  // with kBundleMasked
  std::uint32_t triangle;
};

// Builds the tree by Embree's builder. It is always the same if oneTBB has one thread (runOnOneThread). Triangles that
// are not finite, or farther away than 1e17 m, are left out. Empty when cancelled, or on failure, which the device
// reports.
BundleTree buildBundleTree(RTCDevice device, std::span<const BundleTriangle> triangles, const Context& context);

}  // namespace relume
