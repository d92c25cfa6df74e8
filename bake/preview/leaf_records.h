// SPDX-License-Identifier: MIT
// Records that can be relit: each keeps which leaves of the hierarchy its rays hit, and what a leaf's radiance adds to
// its sums, so that under other lights it is summed anew without a ray. As to light it is a cache of the bake whose
// links are all to leaves (PIC 3.3 without the cut), and has a gradient as well.
//
// In: receivers, a function from hits to leaves, and the leaves' radiance. Out: records, as RecordGatherer makes them
// without a second look.
#pragma once

#include "bake/preview/gather.h"
#include "bake/preview/receiver.h"
#include "bake/preview/record.h"
#include "bake/rays/ray_tracer.h"
#include "bake/scene/sky.h"
#include "relume/bake/context.h"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace relume {

// Write the leaf that each hit lies on; kNone, which all are at first, where no light comes from. Those of
// LeafRecords::kMaxLeaves and beyond are taken for kNone. Called from many threads at once. [Size rays = hits = leaf]
using HitLeaf =
    std::function<void(std::span<const Ray> rays, std::span<const Hit> hits, std::span<std::uint32_t> leaf)>;

// Keeps the tracer by reference. Functions are called from one thread at a time, and run on the context's.
class LeafRecords {
 public:
  static constexpr std::uint32_t kMaxRays = 16384, kMaxLeaves = 1u << 26;
  struct Options {
    std::uint32_t rays = 1024;  // [16..kMaxRays] a record casts; the strata of a fan
    std::uint64_t seed = 1;
    bool fixedReach = false;  // relight() leaves R_k as it was in the light that the record was gathered in
  };
  LeafRecords(const RayTracer& tracer, HitLeaf leafOf, const Sky& sky, const Options& options);

  // Append a record for each of some receivers, in the radiance of the last relight(): black before it. The random
  // stream of a record is its receiver's index. Fewer when cancelled.
  void gather(std::span<const PixelReceiver> receivers, std::span<const std::uint32_t> chosen, Context& context);

  // Sum all records anew: reflected light, the noise of it, and how far they reach. Light straight from the sky stays.
  // radiance [W/m²/sr] that leaves send out. [Size leaves] Indices that leafOf() gives beyond it count as dark.
  void relight(std::span<const glm::vec3> radiance, Context& context);
  // Adapt R_k to the light of the last relight(), where Options::fixedReach has kept it.
  void adaptReach(Context& context);

  // Remove the records whose mark is 0. [Size records]
  void keep(std::span<const std::uint8_t> marks);

  // Terms side by side: what the rays that hit a leaf add, 14 bytes. Those that fill up the last block have shares of
  // 0.
  static constexpr std::size_t kBlock = 16;
  struct Block {
    std::array<std::uint32_t, kBlock> leaf;
    // In the frame of the record: rays that hit the leaf; Int omega d omega in the tangent plane, x and y
    // [1/32767 Leaves::alongScale]; of the gradient of translation, x and y [1/32767 Leaves::slopeScale]
    std::array<std::array<std::int16_t, kBlock>, 5> shares;
  };

  // In the order in which they were gathered. Callers may set Record::footprint and Record::limit.
  std::vector<Record>& records() { return records_; }
  const std::vector<Record>& records() const { return records_; }
  std::size_t sizeBytes() const;  // of all that is kept
  std::size_t terms() const;      // leaves of all records together

 private:
  // Two neighbouring cells with unlike leaves, as indices into the terms; their count for a cell without a leaf.
  struct Pair {
    std::uint16_t a, b;
  };
  struct Leaves {
    glm::vec3 tangent{0.0f}, bitangent{0.0f};
    float seenDistance = 0.0f;                   // [m] R_k by distances alone
    float alongScale = 0.0f, slopeScale = 0.0f;  // [sr], [sr/m]
    std::uint32_t terms = 0;
    std::vector<Block> blocks;
    std::vector<Pair> pairs;  // for the noise
  };
  struct Term {
    std::uint32_t leaf;
    std::array<float, 5> shares;
  };
  struct Scratch {
    RecordGatherer::Scratch gather;
    std::vector<std::uint32_t> leaf, order, term;  // [Size cells]
    std::vector<glm::vec2> slope;                  // [sr/m] [Size cells]
    std::vector<glm::vec4> sums;                   // of leaves: along, slope
    std::vector<Term> terms;
    std::vector<float> luminance;
  };

  Leaves leavesOf(Scratch& scratch) const;
  void sumFrom(std::size_t first, bool fixedReach, Context& context);
  void sum(const Leaves& leaves, bool fixedReach, std::vector<float>& luminance, Record& record) const;
  std::unique_ptr<Scratch> borrow();
  void giveBack(std::unique_ptr<Scratch> scratch);

  HitLeaf leafOf_;
  HitRadiance dark_;
  Sky sky_;
  RecordGatherer gatherer_;
  bool fixedReach_;
  std::vector<glm::vec3> radiance_;  // [W/m²/sr] [Size leaves, and any that a record has, and one]
  std::uint32_t leafCount_ = 1;      // beyond all leaves of records, and that of the ends of blocks
  std::vector<Record> records_;
  std::vector<Leaves> leaves_;  // [Size records]
  std::mutex mutex_;            // of idle_
  std::vector<std::unique_ptr<Scratch>> idle_;
};

}  // namespace relume
