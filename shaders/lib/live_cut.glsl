// SPDX-License-Identifier: MIT
// A placed triangle, cut into pieces, of which each sets the voxels that it overlaps: snapTriangles() and addBits() of
// runtime/voxels, to the bit.
//
// A thread keeps few pieces: it counts through them by the path that leads to each, two bits a cut, and cuts anew along
// it, from the last piece that is a multiple of eight cuts deep.
#include "lib/live_bricks.glsl"
#include "lib/live_place.glsl"
#include "lib/live_overlap.glsl"

layout(std430, binding = RELUME_LIVE_SLOT_POSITIONS) readonly buffer Positions { uint relumePosition[]; };
layout(std430, binding = RELUME_LIVE_SLOT_TRIANGLES) readonly buffer Triangles { uvec4 relumeTriangle[]; };
layout(std430, binding = RELUME_LIVE_SLOT_PLACES) readonly buffer Places { RelumePlace relumePlace[]; };

const int kRelumeMaxCuts = 40;  // corners within 2^29 need 32
// Pieces that a thread looks at: some drivers end its loops after 65,535 rounds in all, of which each is a few. No
// triangle that is smaller than the grid comes near.
const int kRelumeMaxPieces = 1300;

uvec3 relumeVertex(uint index) {
  return uvec3(relumePosition[3u * index], relumePosition[3u * index + 1u], relumePosition[3u * index + 2u]);
}

// In the winding that its front has in the world.
RelumePiece relumePlaced(uint index) {
  uvec4 t = relumeTriangle[index];
  RelumePlace at = relumePlace[t.w];
  bool mirrored = at.mirrored != 0;
  return RelumePiece(relumeStepsOf(at, relumeVertex(t.x)), relumeStepsOf(at, relumeVertex(mirrored ? t.z : t.y)),
                     relumeStepsOf(at, relumeVertex(mirrored ? t.y : t.z)));
}

ivec3 relumeLowest(RelumePiece t) { return min(min(t.a, t.b), t.c); }
ivec3 relumeHighest(RelumePiece t) { return max(max(t.a, t.b), t.c); }

// The voxels of the grid that its bounds touch.
ivec3 relumeFirstVoxel(RelumePiece t) { return max((relumeLowest(t) - 1) >> 6, ivec3(0)); }
ivec3 relumeLastVoxel(RelumePiece t) { return min(relumeHighest(t) >> 6, 4 * ivec3(relumeBrickCells) - 1); }

// Of a triangle without long edges, the voxels within [begin, end]; of their rows along x, in y and z,
// every `stride`th from `row` on.
void relumeSetVoxels(RelumePiece t, ivec3 begin, ivec3 end, ivec2 row, ivec2 stride) {
  ivec3 p = t.b - t.a, q = t.c - t.a;
  ivec3 normal = ivec3(p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x);
  if (normal == ivec3(0)) return;
  ivec3 size = abs(normal);
  int reach = 32 * max(max(size.x, size.y), size.z);
  ivec3 x = ivec3(t.a.x, t.b.x, t.c.x), y = ivec3(t.a.y, t.b.y, t.c.y), z = ivec3(t.a.z, t.b.z, t.c.z);
  RelumeEdges alongX = relumeEdgesOf(y, z, normal.x), alongY = relumeEdgesOf(z, x, normal.y),
              alongZ = relumeEdgesOf(x, y, normal.z);
  ivec3 first = max(relumeFirstVoxel(t), begin), last = min(relumeLastVoxel(t), end), v;
  for (v.z = first.z + row.y; v.z <= last.z; v.z += stride.y) {
    for (v.y = first.y + row.x; v.y <= last.y; v.y += stride.x) {
      ivec3 c = 64 * v + 32;
      if (!relumeIsInside(alongX, c.y, c.z)) continue;
      // The voxels of a row within a brick are bits of one word.
      for (int brick = first.x >> 2; brick <= last.x >> 2; ++brick) {
        uint bits = 0u;
        for (int k = 0; k < 4; ++k) {
          v.x = 4 * brick + k;
          c.x = 64 * v.x + 32;
          ivec3 d = c - t.a;
          if (v.x >= first.x && v.x <= last.x && abs(normal.x * d.x + normal.y * d.y + normal.z * d.z) <= reach &&
              relumeIsInside(alongY, c.z, c.x) && relumeIsInside(alongZ, c.x, c.y))
            bits |= relumeBrickBit(v);
        }
        if (bits != 0u) relumeAddBits(v, bits);
      }
    }
  }
}

// Whether voxels within these bounds may be the triangle's: false where its own bounds, or its plane, are out of reach.
// What floats get wrong is in the last term, so that none is left out on any driver.
bool relumeReaches(RelumePiece t, ivec3 low, ivec3 high) {
  if (any(lessThan(relumeHighest(t), low)) || any(greaterThan(relumeLowest(t), high))) return false;
  vec3 p = vec3(t.b - t.a), q = vec3(t.c - t.a), n = cross(p, q), extent = 0.5 * vec3(high - low) + 64.0,
       d = vec3((low + high) / 2 - t.a);
  vec3 one = vec3(1.0);
  return abs(dot(n, d)) <= dot(abs(n), extent) + 4e-6 * dot(abs(p), one) * dot(abs(q), one) * dot(abs(d), one);
}

// Of any triangle the same. False where it would be too many pieces, and voxels may lack.
bool relumeCutAndSet(RelumePiece whole, ivec3 begin, ivec3 end, ivec2 row, ivec2 stride) {
  ivec3 low = 64 * begin, high = 64 * end + 64;
  uvec4 path = uvec4(0u), ends = uvec4(0u);  // which piece of each cut, and the last of them
  RelumePiece kept[kRelumeMaxCuts / 8 + 1];
  kept[0] = whole;
  int cuts = 0, looked = 0;
  for (;;) {
    RelumePiece piece;
    bool isLeaf = false;
    do {
      ++looked;
      int from = max(cuts - 1, 0) >> 3;
      piece = kept[from];
      for (int k = 8 * from; k < cuts; ++k) piece = relumePieceOf(piece, path[k >> 4] >> (2 * (k & 15)) & 3u);
      if ((cuts & 7) == 0) kept[cuts >> 3] = piece;
      if (relumeReaches(piece, low, high)) {
        uint pieces = relumeCountPieces(piece);
        isLeaf = pieces == 0u || cuts == kRelumeMaxCuts;
        if (!isLeaf) {
          ends[cuts >> 4] |= (pieces - 1u) << (2 * (cuts & 15));
          ++cuts;
          continue;
        }
      }
      // On to the next piece; where it was the last one, of the cut before.
      for (; cuts > 0; --cuts) {
        int word = (cuts - 1) >> 4, bit = 2 * ((cuts - 1) & 15);
        if ((path[word] >> bit & 3u) != (ends[word] >> bit & 3u)) {
          path[word] += 1u << bit;
          break;
        }
        path[word] &= ~(3u << bit);
        ends[word] &= ~(3u << bit);
      }
    } while (!isLeaf && cuts > 0 && looked < kRelumeMaxPieces);
    if (isLeaf) relumeSetVoxels(piece, begin, end, row, stride);
    if (cuts == 0) return true;
    if (looked >= kRelumeMaxPieces) return false;
  }
}
