// SPDX-License-Identifier: MIT
// Finds what many rays from one point hit, all at once, as a picture is drawn: each ray is a sample of an irregular
// depth buffer (Johnson et al., "The Irregular Z-Buffer", ACM TOG 24(4), 2005) on the faces of a cube around the
// point. A tree of the triangles is walked once per face, near nodes first. A node is skipped when no ray in its
// rectangle ends behind it (Greene et al., "Hierarchical Z-Buffer Visibility", SIGGRAPH 93; for a small rectangle, the
// single rays are tested). When few rays pass a node, they are listed, and only these are tested below it. Packets of
// rays, by contrast, walk the same tree once per packet.
//
// Included by bundle_baseline.cpp and bundle_avx2.cpp; what bundle_vectors.h says of functions holds here, too. The
// rays and their pyramid are part of this class: as a class of their own, they cost 6 % of the speed with g++ 12.
#include "bake/rays/bundle/bundle_bins.h"

namespace relume {
namespace {

constexpr float kMinDepth = 1e-30f;  // [m] what is nearer counts as beside the origin, not in front of it
constexpr float kNearer = 0.99999f;  // factor on squared distances to boxes, for their rounding errors

class Walk {
 public:
  explicit Walk(const BundleJob& job)
      : job_(job),
        bins_(job.blocks),
        edges_(bins_),
        hemisphere_(job.axis[0] != 0.0f || job.axis[1] != 0.0f || job.axis[2] != 0.0f) {
    for (std::uint32_t first = 0, side = bins_.blocks;; side = (side + 1) / 2) {
      levelBegin_[levels_] = first;
      levelSide_[levels_++] = side;
      first += side * side;
      if (side == 1) break;
    }
  }

  void run() {
    sortRays(job_, bins_);
    for (std::uint32_t face = 0; face < 6; ++face) {
      if (job_.begin[face * bins_.count] != job_.begin[(face + 1) * bins_.count]) walkFace(face);
    }
  }

 private:
  struct Rectangle {  // one per lane
    Floats u0, u1, v0, v1;
    Ints x0, x1, y0, y1;
  };

  // What a single box covers.
  struct Box {
    float distance2, u0, u1, v0, v1;
    std::uint32_t x0, y0, x1, y1;  // bins, first and last
  };
  static Box boxOf(const BundleFrame& f, std::uint32_t i) {
    const std::uint32_t bins = f.bins[i];
    return {f.distance2[i], f.u0[i],         f.u1[i],          f.v0[i],   f.v1[i],
            bins & 255,     bins >> 8 & 255, bins >> 16 & 255, bins >> 24};
  }

  void findBins(Rectangle& r) const {
    r.x0 = bins_.of(r.u0, -kSlackBins), r.x1 = bins_.of(r.u1, kSlackBins);
    r.y0 = bins_.of(r.v0, -kSlackBins), r.y1 = bins_.of(r.v1, kSlackBins);
  }
  static Ints onFace(const Rectangle& r) {
    constexpr float kEdge = 1.0f + kSlack;
    return (r.u0 <= kEdge) & (r.u1 >= -kEdge) & (r.v0 <= kEdge) & (r.v1 >= -kEdge);
  }

  // The farthest of the four blocks below a block of level 1 or higher.
  float farthestBelow(std::uint32_t level, std::uint32_t x, std::uint32_t y) const {
    const std::uint32_t side = levelSide_[level - 1];
    const float* below = job_.farthest + levelBegin_[level - 1];
    const std::uint32_t x0 = 2 * x, x1 = min(x0 + 1, side - 1), y0 = 2 * y * side;
    const std::uint32_t y1 = min(2 * y + 1, side - 1) * side;
    return max(max(below[y0 + x0], below[y0 + x1]), max(below[y1 + x0], below[y1 + x1]));
  }

  // Update the pyramid after the rays of a block were shortened.
  void lower(std::uint32_t block) {
    const std::uint32_t begin = begin_[block * kBlockBins], end = begin_[(block + 1) * kBlockBins];
    Floats all{};
    for (std::uint32_t i = firstOf(begin); i < end; i += kBundleLanes) {
      all = max(all, lanesWithin(i, begin, end) ? load(job_.t + i) : Floats{});
    }
    float farthest = maxLane(all);
    if (!(farthest < job_.farthest[block])) return;
    job_.farthest[block] = farthest;
    std::uint32_t x = block % bins_.blocks, y = block / bins_.blocks;
    for (std::uint32_t level = 1; level < levels_; ++level) {
      x /= 2, y /= 2;
      farthest = farthestBelow(level, x, y);
      float& old = job_.farthest[levelBegin_[level] + y * levelSide_[level] + x];
      if (!(farthest < old)) return;
      old = farthest;
    }
  }

  void walkFace(std::uint32_t face) {
    depth_ = static_cast<int>(face / 2), across_ = (depth_ + 1) % 3, up_ = (depth_ + 2) % 3;
    backward_ = face % 2 != 0;
    begin_ = job_.begin + face * bins_.count;
    for (std::uint32_t i = 0; i < bins_.blocks * bins_.blocks; ++i) {
      job_.farthest[i] = begin_[(i + 1) * kBlockBins] > begin_[i * kBlockBins] ? kInfinity : 0.0f;
    }
    for (std::uint32_t level = 1; level < levels_; ++level) {
      const std::uint32_t side = levelSide_[level];
      for (std::uint32_t i = 0; i < side * side; ++i) {
        job_.farthest[levelBegin_[level] + i] = farthestBelow(level, i % side, i / side);
      }
    }

    top_ = job_.stack;
    visitNode<false>(0, 0);
    while (top_ != job_.stack) {
      const std::uint32_t waiting = *--top_;
      const BundleFrame& frame = job_.frames[waiting / kBundleLanes];
      const std::uint32_t lane = waiting % kBundleLanes;
      const std::uint32_t child = frame.child[lane];
      const bool isLeaf = (child & kBundleLeaf) != 0;
      if (frame.count > 0) {
        listPassing(frame, lane);
        if (passing_ == 0) continue;
        if (isLeaf) {
          visitLeaf(Box{}, child & ~kBundleLeaf);
        } else {
          visitNode<true>(child, waiting / kBundleLanes + 1);
        }
        continue;
      }
      const Box box = boxOf(frame, lane);
      if (!isSeen(box, isLeaf)) continue;
      if (isLeaf) {
        visitLeaf(box, child & ~kBundleLeaf);
      } else if (passing_ > 0 && passing_ <= kFewBundleRays) {
        visitNode<true>(child, waiting / kBundleLanes + 1);
      } else {
        visitNode<false>(child, waiting / kBundleLanes + 1);
      }
    }
  }

  // List in ray_ the rays that pass a child and may still end in it.
  void listPassing(const BundleFrame& frame, std::uint32_t lane) {
    const Floats near = splat(frame.distance2[lane]);
    passing_ = 0;
    for (std::uint32_t first = 0; first < frame.count; first += kBundleLanes) {
      const unsigned bits = frame.passing[first / 32][lane] >> first % 32 & 0xFFu;
      if (bits == 0) continue;
      const Ints ray = loadInts(frame.ray + first);
      const Floats t = gather(job_.t, ray);
      passing_ += append(ray_ + passing_, ray, bitsOf(near < t * t) & bits);
    }
  }

  // Whether any ray may end in a box. For a small box, list these rays in ray_, and stop soon after kFewBundleRays.
  bool isSeen(const Box& e, bool isLeaf) {
    const std::uint32_t x0 = e.x0 / kBundleStrip, x1 = e.x1 / kBundleStrip, y0 = e.y0 / kBundleStrip,
                        y1 = e.y1 / kBundleStrip;
    const std::uint32_t extent = (x1 - x0) | (y1 - y0);
    passing_ = 0;
    if (extent > 1) {
      const auto level = 31u - static_cast<unsigned>(__builtin_clz(extent));
      const float* farthest = job_.farthest + levelBegin_[level];
      float all = 0.0f;
      for (std::uint32_t y = y0 >> level; y <= y1 >> level; ++y) {
        for (std::uint32_t x = x0 >> level; x <= x1 >> level; ++x) all = max(all, farthest[y * levelSide_[level] + x]);
      }
      if (!isLeaf || e.distance2 >= all * all) return e.distance2 < all * all;
    }

    const Floats u0 = splat(e.u0), u1 = splat(e.u1), v0 = splat(e.v0), v1 = splat(e.v1), near = splat(e.distance2);
    for (std::uint32_t strip = y0; strip <= y1; ++strip) {
      const std::uint32_t* row = begin_ + strip * kBundleStrip * bins_.side;
      const std::uint32_t begin = row[e.x0 * kBundleStrip], end = row[(e.x1 + 1) * kBundleStrip];
      for (std::uint32_t i = firstOf(begin); i < end; i += kBundleLanes) {
        const Floats u = load(job_.u + i), v = load(job_.v + i), t = load(job_.t + i);
        const Ints lanes = lanesWithin(i, begin, end);
        const unsigned bits = bitsOf((u >= u0) & (u <= u1) & (v >= v0) & (v <= v1) & (near < t * t) & lanes);
        passing_ += append(ray_ + passing_, kLane + static_cast<std::int32_t>(i), bits);
        if (passing_ > kFewBundleRays) return true;
      }
    }
    return passing_ > 0;
  }

  // Put the children that rays may meet on the stack. kFew: the rays in ray_ are all that pass the node.
  template <bool kFew>
  void visitNode(std::uint32_t index, std::uint32_t depth) {
    const BundleNode& node = job_.nodes[index];
    const float* origin = job_.origin;
    const Floats low = load(node.low[depth_]) - origin[depth_], high = load(node.high[depth_]) - origin[depth_];
    const Floats near = backward_ ? -high : low, far = backward_ ? -low : high;
    const Floats a0 = load(node.low[across_]) - origin[across_], a1 = load(node.high[across_]) - origin[across_];
    const Floats b0 = load(node.low[up_]) - origin[up_], b1 = load(node.high[up_]) - origin[up_];

    // Project the boxes, and leave out those outside the face or below the horizon.
    const Floats perNear = 1.0f / max(near, splat(kMinDepth)), perFar = 1.0f / max(far, splat(kMinDepth));
    Rectangle r;
    r.u0 = a0 * (a0 < 0.0f ? perNear : perFar), r.u1 = a1 * (a1 < 0.0f ? perFar : perNear);
    r.v0 = b0 * (b0 < 0.0f ? perNear : perFar), r.v1 = b1 * (b1 < 0.0f ? perFar : perNear);
    Ints seen = (far > 0.0f) & onFace(r);
    if (hemisphere_) {
      const float* axis = job_.axis;
      const Floats height = max(a0 * axis[across_], a1 * axis[across_]) + max(b0 * axis[up_], b1 * axis[up_]) +
                            max(low * axis[depth_], high * axis[depth_]);
      seen &= height > 0.0f;
    }
    const Floats da = max(max(a0, -a1), Floats{}), db = max(max(b0, -b1), Floats{}), dd = max(near, Floats{});
    const Floats distance2 = ((da * da + db * db) + dd * dd) * kNearer;
    r.u0 -= kSlack, r.u1 += kSlack, r.v0 -= kSlack, r.v1 += kSlack;
    BundleFrame& frame = job_.frames[depth];
    if constexpr (kFew) seen &= findPassing(r, distance2, frame);
    unsigned bits = bitsOf(seen);
    if (bits == 0) return;
    if constexpr (!kFew) {
      findBins(r);
      store(frame.u0, r.u0), store(frame.u1, r.u1), store(frame.v0, r.v0), store(frame.v1, r.v1);
      store(frame.bins, r.x0 | r.y0 << 8 | r.x1 << 16 | r.y1 << 24);
      frame.count = 0;
    }
    store(frame.distance2, distance2);
    store(frame.child, loadInts(node.child));
    const Floats ma = a0 + a1, mb = b0 + b1, md = low + high;
    const Floats middle2 = (ma * ma + mb * mb) + md * md;
    alignas(32) float middle[kBundleLanes];
    store(middle, middle2);

    // Sort by the distance to the boxes' middles, the nearest on top (3 % faster than by the nearest point of the box).
    // The position of each is the number of boxes that are farther.
    const unsigned all = bits;
    std::uint32_t* bottom = top_;
    for (; bits != 0; bits &= bits - 1) {
      const unsigned i = lowestBit(bits);
      fetch(frame.child[i]);
      const Floats own = splat(middle[i]);
      const Ints below = (middle2 > own) | ((middle2 == own) & (kLane < static_cast<std::int32_t>(i)));
      bottom[__builtin_popcount(bitsOf(below) & all)] = depth * kBundleLanes + i;
    }
    top_ += __builtin_popcount(all);
  }

  // For each child, all ones if a listed ray passes it before the ray ends. Keeps the list.
  Ints findPassing(const Rectangle& r, Floats distance2, BundleFrame& frame) const {
    const auto passingOf = [&](std::uint32_t first, std::uint32_t end) {
      Ints all{}, bit = splatInt(1u);
      for (std::uint32_t k = first; k < end; ++k, bit <<= 1) {
        const std::uint32_t ray = ray_[k];
        const float u = job_.u[ray], v = job_.v[ray], t = job_.t[ray];
        all |= (u >= r.u0) & (u <= r.u1) & (v >= r.v0) & (v <= r.v1) & (distance2 < t * t) & bit;
      }
      return all;
    };
    frame.count = passing_;
    for (std::uint32_t k = 0; k < passing_; k += kBundleLanes) store(frame.ray + k, loadInts(ray_ + k));
    const Ints low = passingOf(0, min(32u, passing_));
    const Ints high = passing_ > 32 ? passingOf(32, passing_) : Ints{};
    store(frame.passing[0], low), store(frame.passing[1], high);
    return (low | high) != 0;
  }

  void fetch(std::uint32_t child) const {
    const bool isLeaf = (child & kBundleLeaf) != 0;
    const char* from = isLeaf ? reinterpret_cast<const char*>(job_.leaves + (child & ~kBundleLeaf))
                              : reinterpret_cast<const char*>(job_.nodes + child);
    const std::size_t size = isLeaf ? sizeof(BundleLeaf) : sizeof(BundleNode);
    for (std::size_t line = 0; line < size; line += 64) __builtin_prefetch(from + line);
  }

  void visitLeaf(const Box& box, std::uint32_t index) {
    const BundleLeaf& leaf = job_.leaves[index];
    const Vectors from = splat(job_.origin[0], job_.origin[1], job_.origin[2]);
    const auto corner = [&](int k) {
      return Vectors{load(leaf.corner[k]), load(leaf.corner[k + 1]), load(leaf.corner[k + 2])} - from;
    };
    const Vectors a = corner(0), b = corner(3), c = corner(6);
    const Triangles triangles = seenFrom(a, b, c);
    if (passing_ <= kFewBundleRays) {
      crossRays(leaf, index, triangles);
    } else {
      crossTriangles(box, leaf, index, triangles, a, b, c);
    }
  }

  bool isOpaque(const BundleLeaf& leaf, unsigned lane, float b, float c) const {
    return (leaf.geometry[lane] & kBundleMasked) == 0 ||
           job_.opaque(job_.self, leaf.geometry[lane], leaf.triangle[lane], b, c);
  }

  // Test one ray after the other against all triangles of the leaf at once.
  void crossRays(const BundleLeaf& leaf, std::uint32_t index, const Triangles& triangles) {
    constexpr std::uint32_t kNoBlock = 0xFFFFFFFFu;
    std::uint32_t shortened = kNoBlock;
    for (std::uint32_t k = 0; k < passing_; ++k) {
      const std::uint32_t ray = ray_[k];
      const Vectors direction = splat(job_.x[ray], job_.y[ray], job_.z[ray]);
      const Passing passing = pass(triangles, direction);
      const Meeting meeting = meet(triangles, direction);
      unsigned bits = bitsOf(passing.inside & (meeting.distance > 0.0f) & (meeting.distance < job_.t[ray]));
      if (bits == 0) continue;
      alignas(32) float distance[kBundleLanes], facing[kBundleLanes], first[kBundleLanes], second[kBundleLanes],
          third[kBundleLanes];
      store(distance, meeting.distance), store(facing, meeting.facing);
      store(first, passing.first), store(second, passing.second), store(third, passing.third);
      const float before = job_.t[ray];
      float nearest = before;
      for (; bits != 0; bits &= bits - 1) {
        const unsigned i = lowestBit(bits);
        if (!(distance[i] < nearest)) continue;
        const float sum = (first[i] + second[i]) + third[i], b = second[i] / sum, c = third[i] / sum;
        if (!isOpaque(leaf, i, b, c)) continue;
        nearest = distance[i];
        job_.b[ray] = b, job_.c[ray] = c;
        job_.hit[ray] = (kBundleLanes * index + i) | (facing[i] > 0.0f ? kBundleBack : 0u);
      }
      if (!(nearest < before)) continue;
      float* t = job_.t + firstOf(ray);
      store(t, kLane == static_cast<std::int32_t>(ray - firstOf(ray)) ? splat(nearest) : load(t));
      if (job_.block[ray] == shortened) continue;
      if (shortened != kNoBlock) lower(shortened);
      shortened = job_.block[ray];
    }
    if (shortened != kNoBlock) lower(shortened);
  }

  // Test one triangle after the other against the rays of each block that it may cover.
  void crossTriangles(const Box& entry, const BundleLeaf& leaf, std::uint32_t index, const Triangles& triangles,
                      const Vectors& a, const Vectors& b, const Vectors& c) {
    // Project the corners. A triangle that reaches behind the origin may cover all that the leaf covers.
    const float sign = backward_ ? -1.0f : 1.0f;
    const Floats aDepth = along(a, depth_) * sign, bDepth = along(b, depth_) * sign, cDepth = along(c, depth_) * sign;
    const Ints behind = min(aDepth, min(bDepth, cDepth)) <= kMinDepth;
    const Floats perA = 1.0f / aDepth, perB = 1.0f / bDepth, perC = 1.0f / cDepth;
    const Floats ua = along(a, across_) * perA, ub = along(b, across_) * perB, uc = along(c, across_) * perC;
    const Floats va = along(a, up_) * perA, vb = along(b, up_) * perB, vc = along(c, up_) * perC;
    Rectangle r;
    r.u0 = behind ? splat(-2.0f) : min(ua, min(ub, uc)), r.u1 = behind ? splat(2.0f) : max(ua, max(ub, uc));
    r.v0 = behind ? splat(-2.0f) : min(va, min(vb, vc)), r.v1 = behind ? splat(2.0f) : max(va, max(vb, vc));
    // A plane through the origin is never hit. Missing triangles have such planes.
    Ints seen = (max(aDepth, max(bDepth, cDepth)) > 0.0f) & onFace(r) & (triangles.plane != 0.0f);
    if (hemisphere_) {
      const Vectors axis = splat(job_.axis[0], job_.axis[1], job_.axis[2]);
      seen &= max(dot(a, axis), max(dot(b, axis), dot(c, axis))) > 0.0f;
    }
    findBins(r);
    const auto within = [](Ints first, std::uint32_t low, Ints last, std::uint32_t high) {
      return (first <= static_cast<std::int32_t>(high)) & (last >= static_cast<std::int32_t>(low));
    };
    unsigned bits = bitsOf(seen & within(r.x0, entry.x0, r.x1, entry.x1) & within(r.y0, entry.y0, r.y1, entry.y1));
    if (bits == 0) return;
    const auto apart = [](Floats p, Floats q, Floats s) {
      return max(max(min(p, min(q, s)), -max(p, max(q, s))), Floats{});
    };
    const Floats dx = apart(a.x, b.x, c.x), dy = apart(a.y, b.y, c.y), dz = apart(a.z, b.z, c.z);
    alignas(32) float distance2[kBundleLanes];
    store(distance2, ((dx * dx + dy * dy) + dz * dz) * kNearer);

    for (; bits != 0; bits &= bits - 1) {
      const unsigned i = lowestBit(bits);
      const auto edge = [&](int k) {
        const Vectors& e = triangles.edge[k];
        return splat(e.x[i], e.y[i], e.z[i]);
      };
      const Vectors& n = triangles.normal;
      const Triangles one{{edge(0), edge(1), edge(2)}, splat(n.x[i], n.y[i], n.z[i]), splat(triangles.plane[i])};
      const auto first = [](std::int32_t bin, std::uint32_t limit) {
        return (static_cast<std::uint32_t>(bin) > limit ? static_cast<std::uint32_t>(bin) : limit) / kBundleStrip;
      };
      const auto last = [](std::int32_t bin, std::uint32_t limit) {
        return min(static_cast<std::uint32_t>(bin), limit) / kBundleStrip;
      };
      const std::uint32_t x0 = first(r.x0[i], entry.x0), x1 = last(r.x1[i], entry.x1);
      const std::uint32_t y0 = first(r.y0[i], entry.y0), y1 = last(r.y1[i], entry.y1);
      // For rays that hit the triangle, the products with its three edges have the sign of its plane's. Leave out
      // blocks that lie beyond an edge.
      const float facing = triangles.plane[i] < 0.0f ? -1.0f : 1.0f;
      float perU[3], perV[3], constant[3];
      for (int k = 0; k < 3; ++k) {
        const Vectors& e = triangles.edge[k];
        perU[k] = along(e, across_)[i] * facing, perV[k] = along(e, up_)[i] * facing;
        constant[k] = along(e, depth_)[i] * sign * facing;
        constant[k] += kSlack * (magnitude(perU[k]) + magnitude(perV[k]) + magnitude(constant[k]));
      }
      for (std::uint32_t y = y0; y <= y1; ++y) {
        Floats row[3];
        for (int k = 0; k < 3; ++k)
          row[k] = splat(perV[k] * (perV[k] < 0.0f ? edges_.begin : edges_.end)[y] + constant[k]);
        for (std::uint32_t x = x0; x <= x1; x += kBundleLanes) {
          const auto reaches = [&](int k) {
            return load((perU[k] < 0.0f ? edges_.begin : edges_.end) + x) * perU[k] + row[k] >= 0.0f;
          };
          const Floats farthest = load(job_.farthest + y * bins_.blocks + x);
          unsigned blocks = bitsOf((kLane <= static_cast<std::int32_t>(x1 - x)) & (distance2[i] < farthest * farthest) &
                                   reaches(0) & reaches(1) & reaches(2));
          for (; blocks != 0; blocks &= blocks - 1) {
            const std::uint32_t block = y * bins_.blocks + x + lowestBit(blocks);
            if (crossBlock(leaf, index, i, one, block)) lower(block);
          }
        }
      }
    }
  }

  // Whether any ray of a block was shortened.
  bool crossBlock(const BundleLeaf& leaf, std::uint32_t index, unsigned lane, const Triangles& one,
                  std::uint32_t block) {
    const std::uint32_t begin = begin_[block * kBlockBins], end = begin_[(block + 1) * kBlockBins];
    bool any = false;
    for (std::uint32_t i = firstOf(begin); i < end; i += kBundleLanes) {
      const Vectors direction{load(job_.x + i), load(job_.y + i), load(job_.z + i)};
      const Passing passing = pass(one, direction);
      const Ints inside = passing.inside & lanesWithin(i, begin, end);
      if (bitsOf(inside) == 0) continue;
      const Meeting meeting = meet(one, direction);
      const Floats t = load(job_.t + i);
      Ints nearer = inside & (meeting.distance > 0.0f) & (meeting.distance < t);
      unsigned bits = bitsOf(nearer);
      if (bits == 0) continue;
      const Floats sum = (passing.first + passing.second) + passing.third;
      const Floats b = passing.second / sum, c = passing.third / sum;
      if ((leaf.geometry[lane] & kBundleMasked) != 0) {
        unsigned left = 0;
        for (; bits != 0; bits &= bits - 1) {
          const unsigned k = lowestBit(bits);
          if (isOpaque(leaf, lane, b[k], c[k])) {
            left |= 1u << k;
          } else {
            nearer[k] = 0;
          }
        }
        if (left == 0) continue;
      }
      const Ints hit = splatInt(kBundleLanes * index + lane) | (meeting.facing > 0.0f ? splatInt(kBundleBack) : Ints{});
      store(job_.t + i, nearer ? meeting.distance : t);
      store(job_.b + i, nearer ? b : load(job_.b + i));
      store(job_.c + i, nearer ? c : load(job_.c + i));
      store(job_.hit + i, nearer ? hit : loadInts(job_.hit + i));
      any = true;
    }
    return any;
  }

  const BundleJob& job_;
  FaceBins bins_;
  BlockEdges edges_;
  bool hemisphere_;
  std::uint32_t levels_ = 0, levelBegin_[8], levelSide_[8];

  // The face that is walked
  int depth_ = 0, across_ = 1, up_ = 2;  // axes
  bool backward_ = false;                // it faces along -depth
  const std::uint32_t* begin_ = nullptr;
  std::uint32_t* top_ = nullptr;
  std::uint32_t passing_ = 0;  // number of rays in ray_ that may end in the box
  std::uint32_t ray_[kFewBundleRays + 2 * kBundleLanes] = {};
};

}  // namespace
}  // namespace relume
