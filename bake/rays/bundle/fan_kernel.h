// SPDX-License-Identifier: MIT
// What the walk of a fan of rays works on (fan_walk.h): plain pointers, since it is built once for each instruction
// set and shares no inline function with the rest. All sets give the same bits: no contraction, no estimates.
#pragma once

#include <cstdint>

namespace relume {

constexpr std::uint32_t kFanLanes = 8;               // children of a node, triangles of a leaf
constexpr std::uint32_t kFanLeaf = 0x80000000u;      // in FanNode::child: a leaf's index
constexpr std::uint32_t kFanMasked = 0x80000000u;    // in FanLeaf::geometry: has an alpha test
constexpr std::uint32_t kFanOverlaps = 0x40000000u;  // in FanLeaf::geometry: other triangles lie in the same place
constexpr std::uint32_t kFanGeometry = 0x3FFFFFFFu;  // the rest of FanLeaf::geometry
constexpr std::uint32_t kFanBack = 0x80000000u;      // in FanJob::hit: the back was hit
constexpr std::uint32_t kFanNone = 0xFFFFFFFFu;      // in FanJob::hit: nothing was hit
constexpr std::uint32_t kFanStrip = 4;               // cells a side of a block
constexpr std::uint32_t kFewFanRays = 64;            // that pass a box are listed
constexpr std::uint32_t kMostFanBlocks = 63;         // a side of a face: a cell's coordinate fits into a byte

struct alignas(64) FanNode {
  float low[3][kFanLanes], high[3][kFanLanes];  // [m] of the children; low > high: none
  std::uint32_t child[kFanLanes];
};

struct alignas(64) FanLeaf {
  float corner[9][kFanLanes];         // [m] three corners, of missing triangles all the same
  std::uint32_t geometry[kFanLanes];  // of the top scene, and flags
  std::uint32_t triangle[kFanLanes];  // of the geometry
};

// The children of a node, those that wait for their turn among them. (Arrays, since registers are stored and lanes are
// read: an array of structs is stored by lanes and read by registers, which processors wait for.)
struct alignas(64) FanFrame {
  float distance2[kFanLanes];      // [m²] to the box
  std::uint32_t child[kFanLanes];  // as in FanNode
  // Of a node that many rays pass, what each child covers of the face:
  float u0[kFanLanes], u1[kFanLanes], v0[kFanLanes], v1[kFanLanes];
  std::uint32_t cells[kFanLanes];  // a byte each: first column, row, last column, row
  // Of a node that few rays pass:
  std::uint32_t ray[kFewFanRays];       // their places
  std::uint32_t passing[2][kFanLanes];  // a bit for each of them that passes the child: the first 32, the rest
  std::uint32_t count;                  // of them; 0 = many
};

struct FanJob {
  // The triangles
  const FanNode* nodes;
  const FanLeaf* leaves;
  bool (*opaque)(const void* self, std::uint32_t geometry, std::uint32_t triangle, float b, float c);
  const void* self;

  // The rays
  float origin[3];         // [m]
  float axis[3];           // zero: rays go anywhere, else into its hemisphere only
  std::uint32_t count;     // K
  const float* direction;  // [Size 3 K] unit
  std::uint32_t blocks;    // [1..kMostFanBlocks] a side of a face

  // Memory, every array at the begin of a line of cache; K' is K rounded up to whole registers
  float *faceU, *faceV;      // [Size K'] in the order of the rays
  std::uint32_t* begin;      // [Size 6 cells + 1] first place of each cell
  std::uint32_t* cursor;     // [Size 6 cells]
  float *x, *y, *z, *u, *v;  // [Size K'] by place
  std::uint16_t* block;      // [Size K'] by place
  float* farthest;           // [Size fanPyramidSize(blocks)]
  FanFrame* frames;          // [Size depth] one a level
  std::uint32_t* stack;      // [Size 7 depth + 8] boxes that wait for their turn: kFanLanes x level + lane

  // The hits
  std::uint32_t* place;  // [Size K'] of each ray
  float *t, *b, *c;      // [Size K'] by place; [m], barycentric
  std::uint32_t* hit;    // [Size K'] by place: lanes x leaf + lane, or kFanNone
};

// Levels of blocks until one is left.
constexpr std::uint32_t fanPyramidSize(std::uint32_t blocks) {
  std::uint32_t size = 0;
  for (std::uint32_t side = blocks;; side = (side + 1) / 2) {
    size += side * side;
    if (side == 1) return size;
  }
}

void traceFanBaseline(const FanJob& job);
#if defined(RELUME_X86_FANS)
void traceFanAvx2(const FanJob& job);
#endif

}  // namespace relume
