// SPDX-License-Identifier: MIT
// The data of the walk of a bundle of rays (bundle_walk.h). Plain pointers, because the walk is compiled once for each
// instruction set and must not share inline functions with other code. All sets give the same bits: multiplications and
// additions are not contracted, and no estimates of reciprocals are used.
#pragma once

#include <cstdint>

namespace relume {

constexpr std::uint32_t kBundleLanes = 8;               // children of a node, triangles of a leaf
constexpr std::uint32_t kBundleLeaf = 0x80000000u;      // in BundleNode::child: a leaf's index
constexpr std::uint32_t kBundleMasked = 0x80000000u;    // in BundleLeaf::geometry: has an alpha test
constexpr std::uint32_t kBundleOverlaps = 0x40000000u;  // in BundleLeaf::geometry: other triangles coincide with it
constexpr std::uint32_t kBundleGeometry = 0x3FFFFFFFu;  // the rest of BundleLeaf::geometry
constexpr std::uint32_t kBundleBack = 0x80000000u;      // in BundleJob::hit: the back was hit
constexpr std::uint32_t kBundleNone = 0xFFFFFFFFu;      // in BundleJob::hit: nothing was hit
constexpr std::uint32_t kBundleStrip = 4;               // bins along a side of a block
constexpr std::uint32_t kFewBundleRays = 64;            // so few rays that pass a box are listed one by one
constexpr std::uint32_t kMaxBundleBlocks = 63;  // along a side of a face: a bin's coordinate must fit into a byte

struct alignas(64) BundleNode {
  float low[3][kBundleLanes], high[3][kBundleLanes];  // [m] of the children; low > high: none
  std::uint32_t child[kBundleLanes];
};

struct alignas(64) BundleLeaf {
  float corner[9][kBundleLanes];         // [m] three corners; all the same for a missing triangle
  std::uint32_t geometry[kBundleLanes];  // of the top scene, and flags
  std::uint32_t triangle[kBundleLanes];  // of the geometry
};

// The children of a node, among them those that wait for their turn. A struct of arrays, because whole registers are
// written and single lanes are read. The other way round, processors would stall.
struct alignas(64) BundleFrame {
  float distance2[kBundleLanes];      // [m²] to the box
  std::uint32_t child[kBundleLanes];  // as in BundleNode
  // For a node that many rays pass: what each child covers of the face.
  float u0[kBundleLanes], u1[kBundleLanes], v0[kBundleLanes], v1[kBundleLanes];
  std::uint32_t bins[kBundleLanes];  // one byte each: first column, first row, last column, last row
  // For a node that few rays pass: these rays.
  std::uint32_t ray[kFewBundleRays];  // their slots
  std::uint32_t
      passing[2][kBundleLanes];  // one bit per listed ray, 1 = passes the child: the first 32 rays, then the rest
  std::uint32_t count;           // of listed rays; 0 = many rays pass
};

struct BundleJob {
  // The triangles
  const BundleNode* nodes;
  const BundleLeaf* leaves;
  bool (*opaque)(const void* self, std::uint32_t geometry, std::uint32_t triangle, float b, float c);
  const void* self;

  // The rays
  float origin[3];         // [m]
  float axis[3];           // zero: rays go anywhere; otherwise into its hemisphere only
  std::uint32_t count;     // K
  const float* direction;  // [Size 3 K] unit
  std::uint32_t blocks;    // [1..kMaxBundleBlocks] along a side of a face

  // Scratch memory; every array starts at a cache line. K' is K rounded up to whole registers.
  float *faceU, *faceV;      // [Size K'] in the order of the rays
  std::uint32_t* begin;      // [Size 6 bins + 1] first slot of each bin
  std::uint32_t* cursor;     // [Size 6 bins]
  float *x, *y, *z, *u, *v;  // [Size K'] by slot
  std::uint16_t* block;      // [Size K'] by slot
  float* farthest;           // [Size bundlePyramidSize(blocks)]
  BundleFrame* frames;       // [Size depth] one per level
  std::uint32_t* stack;      // [Size 7 depth + 8] boxes that wait for their turn: kBundleLanes x level + lane

  // The hits
  std::uint32_t* slot;  // [Size K'] of each ray
  float *t, *b, *c;     // [Size K'] by slot; [m], barycentric
  std::uint32_t* hit;   // [Size K'] by slot: lanes x leaf + lane, or kBundleNone
};

// The size of a pyramid over a face's blocks, down to the level that has a single block.
constexpr std::uint32_t bundlePyramidSize(std::uint32_t blocks) {
  std::uint32_t size = 0;
  for (std::uint32_t side = blocks;; side = (side + 1) / 2) {
    size += side * side;
    if (side == 1) return size;
  }
}

void traceBundleBaseline(const BundleJob& job);
#if defined(RELUME_X86_BUNDLES)
void traceBundleAvx2(const BundleJob& job);
#endif

}  // namespace relume
