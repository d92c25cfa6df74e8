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

// Write the leaf that each hit lies on; kNone, which all are at first, where no light comes from. Called from many
// threads at once. [Size rays = hits = leaf]
using HitLeaf =
    std::function<void(std::span<const Ray> rays, std::span<const Hit> hits, std::span<std::uint32_t> leaf)>;

// Keeps the tracer by reference. Functions are called from one thread at a time, and run on the context's.
class LeafRecords {
 public:
  static constexpr std::uint32_t kMaxRays = 16384;
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

  // In the order in which they were gathered. Callers may set Record::footprint and Record::limit.
  std::vector<Record>& records() { return records_; }
  const std::vector<Record>& records() const { return records_; }
  std::size_t sizeBytes() const;  // of all that is kept
  std::size_t terms() const;      // leaves of all records together

 private:
  // What the rays that hit one leaf add: in the frame of the record, as shares of its scales.
  struct Term {
    std::array<std::uint16_t, 2> leaf;  // low and high half
    std::uint16_t rays;                 // that hit it
    std::array<std::int16_t, 2> along;  // [1/32767 alongScale] Int omega d omega, its part in the tangent plane
    std::array<std::int16_t, 2> slope;  // [1/32767 slopeScale] of the gradient of translation
  };
  static_assert(sizeof(Term) == 14);
  // Two neighbouring cells with unlike leaves, as indices into the terms; their count for a cell without a leaf.
  struct Pair {
    std::uint16_t a, b;
  };
  struct Leaves {
    glm::vec3 tangent{0.0f}, bitangent{0.0f};
    float seenDistance = 0.0f;                   // [m] R_k by distances alone
    float alongScale = 0.0f, slopeScale = 0.0f;  // [sr], [sr/m]
    std::vector<Term> terms;
    std::vector<Pair> pairs;  // for the noise
  };
  struct Scratch {
    RecordGatherer::Scratch gather;
    std::vector<std::uint32_t> leaf, order, term;  // [Size cells]
    std::vector<glm::vec2> slope;                  // [sr/m] [Size cells]
    std::vector<glm::vec4> sums;                   // of terms: along, slope
    std::vector<float> luminance;
  };

  static void sumTerms(const Term* terms, std::size_t count, const glm::vec4* radiance, std::size_t leaves,
                       float* luminance, glm::vec4* sums);
  Leaves leavesOf(Scratch& scratch) const;
  void sumAll(bool fixedReach, Context& context);
  void sum(const Leaves& leaves, bool fixedReach, std::vector<float>& luminance, Record& record) const;
  std::unique_ptr<Scratch> borrow();
  void giveBack(std::unique_ptr<Scratch> scratch);

  HitLeaf leafOf_;
  HitRadiance dark_;
  Sky sky_;
  RecordGatherer gatherer_;
  bool fixedReach_;
  std::vector<glm::vec4> radiance_;  // [W/m²/sr], and its luminance [Size leaves]
  std::vector<Record> records_;
  std::vector<Leaves> leaves_;  // [Size records]
  std::mutex mutex_;            // of idle_
  std::vector<std::unique_ptr<Scratch>> idle_;
};

}  // namespace relume
