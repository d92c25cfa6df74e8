// SPDX-License-Identifier: MIT
// See leaf_records.h. With cells of equal projected solid angle, N of them, and over the leaves j that a record sees:
//   E = pi / N sum of n_j L_j,  I = (sum of a_j L_j, E),  gradient = sum of g_j L_j
// n_j: rays that hit leaf j; a_j: sum of Int omega d omega over its cells, the part in the plane; g_j: sum over its
// cells' borders of +- Int cos theta m ds / min(r_a, r_b), + where the border leads to the cell (gather.h).
#include "bake/preview/leaf_records.h"

#include "bake/base/parallel.h"
#include "bake/base/wide_clones.h"
#include "formats/color.h"
#include "simd/vectors.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

namespace relume {
namespace {

constexpr float kMaxShare = 32767.0f;  // of Term::along and Term::slope
constexpr int kMostHalvings = 8;
constexpr std::size_t kMoreTerms = 16;  // one more for so many leaves, at most
constexpr std::size_t kRecordsPerChunk = 64;

constexpr std::size_t kBlock = LeafRecords::kBlock;
constexpr std::size_t kAhead = 6;  // blocks that are fetched before they are needed

std::int16_t shareOf(float v, float scale) {
  return static_cast<std::int16_t>(scale > 0.0f ? std::lround(kMaxShare * v / scale) : 0);
}

// What a change of each cell's radiance does to the gradient.
void findSlopes(const HemisphereCells& cells, std::span<const float> distance, std::vector<glm::vec2>& slope) {
  slope.assign(cells.count(), glm::vec2(0.0f));
  const auto border = [&](std::uint32_t a, std::uint32_t b, const glm::vec2& arc) {
    const float r = std::min(distance[a], distance[b]);
    if (r < 0.0f || r == std::numeric_limits<float>::infinity()) return;
    const glm::vec2 g = arc / std::max(r, 1e-12f);
    slope[a] -= g;
    slope[b] += g;
  };
  for (std::uint32_t j = 0, cell = 0; j < cells.rows; ++j) {
    for (std::uint32_t i = 0; i < cells.columns; ++i, ++cell) {
      if (i + 1 < cells.columns) border(cell, cell + 1, cells.toNextColumn[cell]);
      if (j + 1 < cells.rows) border(cell, cell + cells.columns, cells.toNextRow[cell]);
    }
  }
}

// Terms that a leaf's slope takes at a scale.
std::size_t partsOf(const glm::vec4& sums, float scale) {
  const float most = std::max(std::abs(sums.z), std::abs(sums.w));
  return scale > 0.0f ? std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(most / scale))) : 1;
}

// What is close has slopes many times those of the rest, which would be left with few bits: the largest are cut into
// several terms, as long as these are few.
float slopeScaleOf(std::span<const glm::vec4> sums) {
  float scale = 0.0f;
  for (const glm::vec4& s : sums) scale = std::max({scale, std::abs(s.z), std::abs(s.w)});
  for (int halvings = 0; halvings < kMostHalvings && scale > 0.0f; ++halvings) {
    std::size_t more = 0;
    for (const glm::vec4& s : sums) more += partsOf(s, 0.5f * scale) - 1;
    if (more > sums.size() / kMoreTerms) break;
    scale *= 0.5f;
  }
  return scale;
}

using Eight = FloatsOf<8>;

// R, G and B of four leaves, one vector each, from what lies in memory a leaf after the other.
__attribute__((always_inline)) inline Vectors3<Float4> loadLight(const glm::vec3* radiance, const std::uint32_t* leaf) {
  const auto a = load<Float4>(radiance + leaf[0]), b = load<Float4>(radiance + leaf[1]),
             c = load<Float4>(radiance + leaf[2]), d = load<Float4>(radiance + leaf[3]);
  const Float4 ab = __builtin_shufflevector(a, b, 0, 4, 1, 5), cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const Float4 abEnd = __builtin_shufflevector(a, b, 2, 6, 3, 7), cdEnd = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  return {__builtin_shufflevector(ab, cd, 0, 1, 4, 5), __builtin_shufflevector(ab, cd, 2, 3, 6, 7),
          __builtin_shufflevector(abEnd, cdEnd, 0, 1, 4, 5)};
}

__attribute__((always_inline)) inline Eight join(Float4 low, Float4 high) {
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}

// Sums over terms, of R, G, B, a sum for each array of shares. leafLuminance: of each term's leaf. Lanes are terms:
// what a leaf sends is read as it lies, and turned. A float behind the last radiance is read as well.
RELUME_WIDE_CLONES
void sumTerms(const LeafRecords::Block* blocks, std::size_t count, const glm::vec3* radiance, float* leafLuminance,
              glm::vec3* sums) {
  std::array<std::array<Eight, 3>, 5> sum{};
  for (std::size_t b = 0; b < count; ++b) {
    const char* ahead = reinterpret_cast<const char*>(blocks + b + kAhead);
    for (std::size_t line = 0; line < sizeof(LeafRecords::Block); line += 64) __builtin_prefetch(ahead + line);
    // Halves are joined in registers: from memory they would wait for both to be written.
    std::array<std::array<Eight, 3>, kBlock / 8> light;
    for (std::size_t i = 0; i < kBlock; i += 8) {
      const Vectors3<Float4> low = loadLight(radiance, blocks[b].leaf.data() + i),
                             high = loadLight(radiance, blocks[b].leaf.data() + i + 4);
      std::array<Eight, 3>& each = light[i / 8];
      each = {join(low.x, high.x), join(low.y, high.y), join(low.z, high.z)};
      store(leafLuminance + kBlock * b + i, luminance(each[0], each[1], each[2]));
    }
    alignas(64) float share[5][kBlock];
    for (std::size_t k = 0; k < 5; ++k) {
      for (std::size_t i = 0; i < kBlock; ++i) share[k][i] = static_cast<float>(blocks[b].shares[k][i]);
    }
    for (std::size_t k = 0; k < 5; ++k) {
      for (std::size_t i = 0; i < kBlock; i += 8) {
        const auto shares = load<Eight>(share[k] + i);
        for (std::size_t c = 0; c < 3; ++c) sum[k][c] += shares * light[i / 8][c];
      }
    }
  }
  for (std::size_t k = 0; k < 5; ++k) sums[k] = {sumLanes(sum[k][0]), sumLanes(sum[k][1]), sumLanes(sum[k][2])};
}

RecordGatherer::Options gatherOptions(const LeafRecords::Options& o) {
  RecordGatherer::Options options;
  options.rays = std::clamp(o.rays, 16u, LeafRecords::kMaxRays);
  options.seed = o.seed;
  options.secondLook = false;
  return options;
}

}  // namespace

LeafRecords::LeafRecords(const RayTracer& tracer, HitLeaf leafOf, const Sky& sky, const Options& options)
    : leafOf_(std::move(leafOf)),
      dark_([](std::uint64_t, float, std::span<const Ray>, std::span<const Hit>, std::span<glm::vec3>) {}),
      sky_(sky),
      gatherer_(tracer, dark_, sky_, gatherOptions(options)),
      fixedReach_(options.fixedReach) {}

// The leaves of the record that was gathered last.
LeafRecords::Leaves LeafRecords::leavesOf(Scratch& s) const {
  const HemisphereCells& cells = gatherer_.cells();
  const std::uint32_t count = cells.count();
  s.leaf.assign(count, kNone);
  leafOf_(s.gather.rays, s.gather.hits, s.leaf);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!s.gather.hits[i] || s.leaf[i] >= kMaxLeaves) s.leaf[i] = kNone;
  }
  findSlopes(cells, s.gather.distance, s.slope);

  // Cells by leaf, and the sums of each
  s.order.resize(count);
  std::iota(s.order.begin(), s.order.end(), 0u);
  std::sort(s.order.begin(), s.order.end(),
            [&s](std::uint32_t a, std::uint32_t b) { return s.leaf[a] != s.leaf[b] ? s.leaf[a] < s.leaf[b] : a < b; });
  Leaves made;
  s.sums.clear();
  s.terms.clear();
  s.term.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t cell = s.order[i], leaf = s.leaf[cell];
    if (leaf == kNone) break;
    if (i == 0 || leaf != s.leaf[s.order[i - 1]]) {
      s.terms.push_back({leaf, {}});
      s.sums.emplace_back(0.0f);
    }
    s.term[cell] = static_cast<std::uint32_t>(s.terms.size() - 1);
    s.terms.back().shares[0] += 1.0f;
    s.sums.back() += glm::vec4(cells.integral[cell].x, cells.integral[cell].y, s.slope[cell].x, s.slope[cell].y);
  }
  for (const glm::vec4& sums : s.sums)
    made.alongScale = std::max({made.alongScale, std::abs(sums.x), std::abs(sums.y)});
  made.slopeScale = slopeScaleOf(s.sums);
  for (std::size_t t = 0; t < s.sums.size(); ++t) {
    const glm::vec4& sums = s.sums[t];
    glm::vec2 left(sums.z, sums.w);
    const float step = made.slopeScale / kMaxShare;
    for (std::size_t parts = partsOf(sums, made.slopeScale), to = t; parts > 0; --parts) {
      // What rounding takes from one part is handed on to the next.
      const glm::vec2 part =
          step > 0.0f ? step * glm::round(left / (step * static_cast<float>(parts))) : glm::vec2(0.0f);
      left -= part;
      s.terms[to].shares[3] = part.x;
      s.terms[to].shares[4] = part.y;
      if (parts == 1) break;
      to = s.terms.size();
      s.terms.push_back({s.terms[t].leaf, {}});
    }
    s.terms[t].shares[1] = sums.x;
    s.terms[t].shares[2] = sums.y;
  }
  made.terms = static_cast<std::uint32_t>(s.terms.size());
  made.blocks.assign((s.terms.size() + kBlock - 1) / kBlock, Block{});
  for (std::size_t t = 0; t < s.terms.size(); ++t) {
    const Term& term = s.terms[t];
    Block& block = made.blocks[t / kBlock];
    block.leaf[t % kBlock] = term.leaf;
    const std::array<float, 5> scale{kMaxShare, made.alongScale, made.alongScale, made.slopeScale, made.slopeScale};
    for (std::size_t k = 0; k < 5; ++k) block.shares[k][t % kBlock] = shareOf(term.shares[k], scale[k]);
  }

  // The pairs of cells whose difference is the noise: varianceOf()
  const std::uint32_t none = made.terms;
  for (std::uint32_t cell = 0; cell + 1 < count; cell += 2) {
    const std::uint32_t a = s.leaf[cell] == kNone ? none : s.term[cell],
                        b = s.leaf[cell + 1] == kNone ? none : s.term[cell + 1];
    if (a != b) made.pairs.push_back({static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b)});
  }
  made.pairs.shrink_to_fit();
  made.tangent = s.gather.frame[0];
  made.bitangent = s.gather.frame[1];
  made.seenDistance = s.gather.seenDistance;
  return made;
}

void LeafRecords::sum(const Leaves& leaves, bool fixedReach, std::vector<float>& luminance, Record& record) const {
  luminance.resize(kBlock * leaves.blocks.size() + 1);
  std::array<glm::vec3, 5> sums;
  sumTerms(leaves.blocks.data(), leaves.blocks.size(), radiance_.data(), luminance.data(), sums.data());
  luminance[leaves.terms] = 0.0f;
  const float share = std::numbers::pi_v<float> / static_cast<float>(gatherer_.cells().count()),
              along = leaves.alongScale / kMaxShare, slope = leaves.slopeScale / kMaxShare;
  for (int c = 0; c < 3; ++c) {
    record.reflected.vector[c] =
        along * (sums[1][c] * leaves.tangent + sums[2][c] * leaves.bitangent) + share * sums[0][c] * record.normal;
    record.reflected.gradient[c] = slope * (sums[3][c] * leaves.tangent + sums[4][c] * leaves.bitangent);
  }
  // Four sums, none of which waits for the others.
  std::array<float, 4> variance{};
  const std::size_t pairs = leaves.pairs.size();
  for (std::size_t i = 0; i + 4 <= pairs; i += 4) {
    for (std::size_t k = 0; k < 4; ++k) {
      const float apart = luminance[leaves.pairs[i + k].a] - luminance[leaves.pairs[i + k].b];
      variance[k] += apart * apart;
    }
  }
  for (std::size_t i = pairs / 4 * 4; i < pairs; ++i) {
    const float apart = luminance[leaves.pairs[i].a] - luminance[leaves.pairs[i].b];
    variance[0] += apart * apart;
  }
  record.noise = share * std::sqrt((variance[0] + variance[1]) + (variance[2] + variance[3]));

  const float before = record.distance;
  record.distance = leaves.seenDistance;
  limitBySlope(record);
  if (!fixedReach) return;
  // A light that changes faster now than the record reaches must not be extrapolated to nothing.
  if (before > record.distance) record.reflected.gradient *= record.distance / before;
  record.distance = before;
  limitChannels(record);
}

std::unique_ptr<LeafRecords::Scratch> LeafRecords::borrow() {
  const std::lock_guard lock(mutex_);
  if (idle_.empty()) return std::make_unique<Scratch>();
  auto scratch = std::move(idle_.back());
  idle_.pop_back();
  return scratch;
}

void LeafRecords::giveBack(std::unique_ptr<Scratch> scratch) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(scratch));
}

void LeafRecords::gather(std::span<const PixelReceiver> receivers, std::span<const std::uint32_t> chosen,
                         Context& context) {
  const std::size_t first = records_.size();
  records_.resize(first + chosen.size());
  leaves_.resize(first + chosen.size());
  parallelChunks(context, "", chosen.size(), 4, [&](std::size_t begin, std::size_t end) {
    std::unique_ptr<Scratch> scratch = borrow();
    for (std::size_t i = begin; i < end && !context.cancelled(); ++i) {
      records_[first + i] = gatherer_.gather(receivers[chosen[i]], chosen[i], scratch->gather);
      leaves_[first + i] = leavesOf(*scratch);
    }
    giveBack(std::move(scratch));
  });
  // Which of them were made before a cancel depends on the threads: none counts.
  if (context.cancelled()) {
    records_.resize(first);
    leaves_.resize(first);
  }
  for (std::size_t i = first; i < leaves_.size(); ++i) {
    for (const Block& block : leaves_[i].blocks) {
      for (const std::uint32_t leaf : block.leaf) leafCount_ = std::max(leafCount_, leaf + 1);
    }
  }
  sumFrom(first, false, context);
}

void LeafRecords::relight(std::span<const glm::vec3> radiance, Context& context) {
  radiance_.assign(radiance.begin(), radiance.end());
  radiance_.emplace_back(0.0f);
  sumFrom(0, fixedReach_, context);
}

void LeafRecords::adaptReach(Context& context) { sumFrom(0, false, context); }

// Sum the records from `first` on.
void LeafRecords::sumFrom(std::size_t first, bool fixedReach, Context& context) {
  if (radiance_.size() <= leafCount_) radiance_.resize(leafCount_ + 1, glm::vec3(0.0f));
  parallelChunks(context, "", leaves_.size() - first, kRecordsPerChunk, [&](std::size_t begin, std::size_t end) {
    std::unique_ptr<Scratch> scratch = borrow();
    for (std::size_t i = first + begin; i < first + end; ++i)
      sum(leaves_[i], fixedReach, scratch->luminance, records_[i]);
    giveBack(std::move(scratch));
  });
}

void LeafRecords::keep(std::span<const std::uint8_t> marks) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < records_.size(); ++i) {
    if (marks[i] == 0) continue;
    if (kept != i) {
      records_[kept] = records_[i];
      leaves_[kept] = std::move(leaves_[i]);
    }
    ++kept;
  }
  records_.resize(kept);
  leaves_.resize(kept);
}

std::size_t LeafRecords::terms() const {
  std::size_t count = 0;
  for (const Leaves& leaves : leaves_) count += leaves.terms;
  return count;
}

std::size_t LeafRecords::sizeBytes() const {
  std::size_t bytes = records_.capacity() * sizeof(Record) + leaves_.capacity() * sizeof(Leaves);
  for (const Leaves& leaves : leaves_)
    bytes += leaves.blocks.capacity() * sizeof(Block) + leaves.pairs.capacity() * sizeof(Pair);
  return bytes;
}

}  // namespace relume
