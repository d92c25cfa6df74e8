// SPDX-License-Identifier: MIT
// Pieces of a triangle and the voxels that they overlap: runtime/voxels/split_edges.h and overlap.h, line by line.
// Corners count 1/64 voxel.

struct RelumePiece {
  ivec3 a, b, c;
};

const int kRelumeMaxEdge = 512;  // kMaxEdge of runtime/voxels/snap_triangles.h

bool relumeIsLong(ivec3 a, ivec3 b) {
  ivec3 d = abs(b - a);
  if (max(max(d.x, d.y), d.z) > kRelumeMaxEdge) return true;
  return d.x * d.x + d.y * d.y + d.z * d.z > kRelumeMaxEdge * kRelumeMaxEdge;
}

// Into how many pieces it is cut; 0 = no edge is long.
uint relumeCountPieces(RelumePiece t) {
  uint edges = uint(relumeIsLong(t.a, t.b)) + uint(relumeIsLong(t.b, t.c)) + uint(relumeIsLong(t.c, t.a));
  return edges > 0u ? edges + 1u : 0u;
}

// One of the pieces of a triangle that is cut.
RelumePiece relumePieceOf(RelumePiece t, uint which) {
  bool ab = relumeIsLong(t.a, t.b), bc = relumeIsLong(t.b, t.c), ca = relumeIsLong(t.c, t.a);
  uint edges = uint(ab) + uint(bc) + uint(ca);
  // Turn the triangle so that edge ab is long, and of two long edges the other is bc.
  uint first = edges == 3u ? 0u : edges == 1u ? (ab ? 0u : bc ? 1u : 2u) : (!ca ? 0u : !ab ? 1u : 2u);
  if (first == 1u) t = RelumePiece(t.b, t.c, t.a);
  if (first == 2u) t = RelumePiece(t.c, t.a, t.b);
  ivec3 midAb = (t.a + t.b) >> 1, midBc = (t.b + t.c) >> 1, midCa = (t.c + t.a) >> 1;
  if (edges == 3u) {
    if (which == 0u) return RelumePiece(t.a, midAb, midCa);
    if (which == 1u) return RelumePiece(midAb, t.b, midBc);
    if (which == 2u) return RelumePiece(midCa, midBc, t.c);
    return RelumePiece(midAb, midBc, midCa);
  }
  if (edges == 1u) {
    if (which == 0u) return RelumePiece(t.a, midAb, t.c);
    return RelumePiece(midAb, t.b, t.c);
  }
  if (which == 0u) return RelumePiece(midAb, t.b, midBc);
  if (which == 1u) return RelumePiece(t.a, midAb, midBc);
  return RelumePiece(t.a, midBc, t.c);
}

// An inward normal of each edge, in the projection along an axis, and half a voxel's reach beyond it.
struct RelumeEdges {
  ivec3 u, v, offset;
};

RelumeEdges relumeEdgesOf(ivec3 cornerU, ivec3 cornerV, int normal) {
  int side = normal < 0 ? -1 : 1;
  RelumeEdges e;
  e.u = -side * (cornerV.yzx - cornerV);
  e.v = side * (cornerU.yzx - cornerU);
  e.offset = 32 * max(abs(e.u), abs(e.v)) - e.u * cornerU - e.v * cornerV;
  return e;
}

bool relumeIsInside(RelumeEdges e, int u, int v) {
  ivec3 at = e.u * u + e.v * v + e.offset;
  return min(min(at.x, at.y), at.z) >= 0;
}
