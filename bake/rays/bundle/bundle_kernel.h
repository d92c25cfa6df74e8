// SPDX-License-Identifier: MIT
// What the walk of a bundle of rays works on (bundle_walk.h): plain pointers, since it is built once for each
// instruction set and shares no inline function with the rest. All sets give the same bits: no contraction, no
// estimates.
#pragma once

#include <cstdint>

namespace relume {

constexpr std::uint32_t kBundleLanes = 8;             // children of a node, triangles of a leaf
constexpr std::uint32_t kBundleLeaf = 0x80000000u;    // in BundleNode::child: a leaf's index
constexpr std::uint32_t kBundleMasked = 0x80000000u;  // in BundleLeaf::geometry: has an alpha test
constexpr std::uint32_t kBundleOverlaps =
    0x40000000u;  // in BundleLeaf::geometry: other triangles lie in the same place
constexpr std::uint32_t kBundleGeometry = 0x3FFFFFFFu;  // the rest of BundleLeaf::geometry
constexpr std::uint32_t kBundleBack = 0x80000000u;      // in BundleJob::hit: the back was hit
constexpr std::uint32_t kBundleNone = 0xFFFFFFFFu;      // in BundleJob::hit: nothing was hit
constexpr std::uint32_t kBundleStrip = 4;               // cells along a side of a block
constexpr std::uint32_t kFewBundleRays = 64;            // that pass a box are listed
constexpr std::uint32_t kMaxBundleBlocks = 63;          // a side of a face: a cell's coordinate fits into a byte

struct alignas(64) BundleNode {
  float low[3][kBundleLanes], high[3][kBundleLanes];  // [m] of the children; low > high: none
  std::uint32_t child[kBundleLanes];
};

struct alignas(64) BundleLeaf {
  float corner[9][kBundleLanes];         // [m] three corners, of missing triangles all the same
  std::uint32_t geometry[kBundleLanes];  // of the top scene, and flags
  std::uint32_t triangle[kBundleLanes];  // of the geometry
};

// The children of a node, those that wait for their turn among them. (Arrays, since registers are stored and lanes are
// read: an array of structs is stored by lanes and read by registers, which processors wait for.)
struct alignas(64) BundleFrame {
  float distance2[kBundleLanes];      // [m²] to the box
  std::uint32_t child[kBundleLanes];  // as in BundleNode
  // Of a node that many rays pass, what each child covers of the face:
  float u0[kBundleLanes], u1[kBundleLanes], v0[kBundleLanes], v1[kBundleLanes];
  std::uint32_t cells[kBundleLanes];  // a byte each: first column, row, last column, row
  // Of a node that few rays pass:
  std::uint32_t ray[kFewBundleRays];       // their places
  std::uint32_t passing[2][kBundleLanes];  // a bit for each of them that passes the child: the first 32, the rest
  std::uint32_t count;                     // of them; 0 = many
};

struct BundleJob {
  // The triangles
  const BundleNode* nodes;
  const BundleLeaf* leaves;
  bool (*opaque)(const void* self, std::uint32_t geometry, std::uint32_t triangle, float b, float c);
  const void* self;

  // The rays
  float origin[3];         // [m]
  float axis[3];           // zero: rays go anywhere, else into its hemisphere only
  std::uint32_t count;     // K
  const float* direction;  // [Size 3 K] unit
  std::uint32_t blocks;    // [1..kMaxBundleBlocks] a side of a face

  // Memory, every array at the begin of a line of cache; K' is K rounded up to whole registers
  float *faceU, *faceV;      // [Size K'] in the order of the rays
  std::uint32_t* begin;      // [Size 6 cells + 1] first place of each cell
  std::uint32_t* cursor;     // [Size 6 cells]
  float *x, *y, *z, *u, *v;  // [Size K'] by place
  std::uint16_t* block;      // [Size K'] by place
  float* farthest;           // [Size bundlePyramidSize(blocks)]
  BundleFrame* frames;       // [Size depth] one per level
  std::uint32_t* stack;      // [Size 7 depth + 8] boxes that wait for their turn: kBundleLanes x level + lane

  // The hits
  std::uint32_t* place;  // [Size K'] of each ray
  float *t, *b, *c;      // [Size K'] by place; [m], barycentric
  std::uint32_t* hit;    // [Size K'] by place: lanes x leaf + lane, or kBundleNone
};

// Levels of blocks until one is left.
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
