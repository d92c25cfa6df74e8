// SPDX-License-Identifier: MIT
// See grid_texture.h.
#include "runtime/shared/grid_texture.h"

#include "formats/color.h"
#include "formats/limits.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/interpolate.h"
#include "runtime/shared/receivers.h"
#include "runtime/shared/stencil.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace relume {
namespace {

constexpr std::uint32_t kHalves = 6;
// Corner weights that caches must see of a position, for it to count.
constexpr float kMinSeen = 0.01f;
// [spacings] how far along each axis from a point the positions are whose mean it is. Deviation from a quarter, the
// dual cell's middle: nearer ones blur less, and open more cells.
constexpr float kReach = 0.125f;
// Share of a texel's weight that may be of caches which another corner of its cell does not see.
constexpr float kMaxHidden = 0.05f;

// The caches around a position, before it is known which way a receiver faces.
struct Around {
  std::array<std::uint32_t, 16> cache;
  std::array<float, 16> weight;      // corner times visibility
  std::array<glm::vec3, 16> toward;  // unit, or zero at the cache itself
  std::size_t count = 0;
  float total = 0.0f;
};

Around lookAround(const PackedCaches& caches, const glm::vec3& position) {
  Around around;
  visitGridPoints(caches, position, [&](std::uint32_t cache, float corner, float visible, const glm::vec3& toward) {
    const float distance = glm::length(toward);
    around.cache[around.count] = cache;
    around.weight[around.count] = corner * visible;
    around.toward[around.count] = distance > 0.0f ? toward / distance : glm::vec3(0.0f);
    around.total += corner * visible;
    ++around.count;
  });
  return around;
}

// Weights of a receiver with that normal, adding up to 1; false where it sees nothing.
bool weigh(const Around& around, const glm::vec3& normal, std::array<float, 16>& weight) {
  if (!(around.total > kMinSeen)) return false;
  float total = 0.0f;
  for (std::size_t k = 0; k < around.count; ++k) {
    const bool here = around.toward[k] == glm::vec3(0.0f);
    const float wrap = wrapWeight(here ? 1.0f : glm::dot(around.toward[k], normal));
    weight[k] = around.weight[k] * wrap;
    total += weight[k];
  }
  for (std::size_t k = 0; k < around.count; ++k) weight[k] /= total;
  return total > 0.0f;
}

// Four normals of a half, with the mean squared cosine to its axis that n² gives, so that they count alike.
std::array<glm::vec3, 4> normalsOf(std::uint32_t half) {
  const int a = static_cast<int>(half / 2), b = (a + 1) % 3, c = (a + 2) % 3;
  std::array<glm::vec3, 4> normals;
  for (std::size_t k = 0; k < 4; ++k) {
    glm::vec3 n;
    n[a] = half % 2 == 0 ? 0.77459667f : -0.77459667f;
    n[b] = k % 2 == 0 ? 0.44721360f : -0.44721360f;
    n[c] = k < 2 ? 0.44721360f : -0.44721360f;
    normals[k] = n;
  }
  return normals;
}

glm::uvec3 gridPoint(std::uint32_t index, const glm::uvec3& size) {
  return {index % size.x, index / size.x % size.y, index / size.x / size.y};
}

// Caches of one point and their weights in each half.
struct PointCaches {
  static constexpr std::size_t kMax = 8 * 16;
  std::array<std::uint32_t, kMax> cache;
  std::array<std::array<float, kHalves>, kMax> weight;
  std::size_t count = 0;

  std::size_t find(std::uint32_t wanted) {
    const auto end = cache.begin() + static_cast<std::ptrdiff_t>(count);
    const auto at = static_cast<std::size_t>(std::find(cache.begin(), end, wanted) - cache.begin());
    if (at == count) {
      cache[count] = wanted;
      weight[count].fill(0.0f);
      ++count;
    }
    return at;
  }
};

// Write the largest shares of a half, which add up to `known` [0..1]; returns how many.
std::uint32_t writeShares(const PointCaches& caches, std::uint32_t half, float known, std::uint32_t* to) {
  std::array<std::uint32_t, kMaxTexelCaches> best;
  std::size_t kept = 0;
  const auto weightOf = [&](std::uint32_t k) { return caches.weight[k][half]; };
  for (std::uint32_t k = 0; k < caches.count; ++k) {
    std::size_t at = kept < kMaxTexelCaches ? kept++ : kMaxTexelCaches;
    while (at > 0 && weightOf(best[at - 1]) < weightOf(k)) {
      if (at < kMaxTexelCaches) best[at] = best[at - 1];
      --at;
    }
    if (at < kMaxTexelCaches) best[at] = k;
  }
  float total = 0.0f;
  for (std::size_t k = 0; k < kept; ++k) total += weightOf(best[k]);
  // Diffuse the rounding error from one to the next, so that the shares add up.
  float wanted = 0.5f;
  std::uint32_t count = 0;
  for (std::size_t k = 0; k < kept && total > 0.0f; ++k) {
    wanted += weightOf(best[k]) * known * static_cast<float>(kMaxShare) / total;
    const auto share = static_cast<std::uint32_t>(wanted);
    wanted -= static_cast<float>(share);
    if (share > 0) to[count++] = caches.cache[best[k]] | share << kCacheBits;
  }
  return count;
}

// Shares of the six texels of a point.
void sharePoint(const PackedCaches& caches, const GridTexture& texture, std::uint32_t point,
                const std::array<std::array<glm::vec3, 4>, kHalves>& normals, std::uint32_t* shares,
                std::uint32_t* counts) {
  const glm::vec3 at(gridPoint(point, texture.resolution)), last(texture.resolution - 1u);
  PointCaches sum;
  float seen = 0.0f;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const glm::vec3 offset = kReach * (2.0f * glm::vec3(cornerOffset(corner)) - 1.0f);
    const glm::vec3 place = glm::clamp(at + offset, glm::vec3(0.0f), last);
    const Around around = lookAround(caches, texture.originWorld + place * texture.spacing);
    if (!(around.total > kMinSeen)) continue;
    seen += 1.0f / 8.0f;
    std::array<std::size_t, 16> slot;
    for (std::size_t k = 0; k < around.count; ++k) slot[k] = sum.find(around.cache[k]);
    std::array<float, 16> weight;
    for (std::uint32_t half = 0; half < kHalves; ++half) {
      for (const glm::vec3& normal : normals[half]) {
        if (!weigh(around, normal, weight)) continue;
        for (std::size_t k = 0; k < around.count; ++k) sum.weight[slot[k]][half] += weight[k];
      }
    }
  }
  for (std::uint32_t half = 0; half < kHalves; ++half)
    counts[half] = writeShares(sum, half, seen, shares + kMaxTexelCaches * half);
}

// A receiver within a cell: its place in units of the cell, and its normal.
struct Probe {
  glm::vec3 place, normal;
};

// Spread by the R3 sequence (Roberts 2018) and on Fibonacci's sphere, in an order of their own.
std::array<Probe, kProbes> makeProbes() {
  std::array<Probe, kProbes> probes;
  for (std::uint32_t i = 0; i < kProbes; ++i) {
    const auto k = static_cast<float>(i) + 0.5f;
    const glm::vec3 place = glm::fract(k * glm::vec3(0.81917251f, 0.67104360f, 0.54970048f));
    const auto turn = static_cast<float>(i * 29 % kProbes);
    const float z = 1.0f - (2.0f * turn + 1.0f) / static_cast<float>(kProbes), r = std::sqrt(1.0f - z * z);
    probes[i] = {place, {r * std::cos(2.39996323f * turn), r * std::sin(2.39996323f * turn), z}};
  }
  return probes;
}

// The eight corners of a cell and their weights for a place in it.
struct Corners {
  std::array<std::uint32_t, 8> point;
  std::array<float, 8> weight;
};

Corners cornersOf(const GridTexture& texture, const glm::uvec3& cell, const glm::vec3& place) {
  const glm::uvec3 r = texture.resolution;
  Corners corners;
  corners.weight = trilinear(place);
  for (std::uint32_t c = 0; c < 8; ++c) {
    const glm::uvec3 at = glm::min(cell + cornerOffset(c), r - 1u);
    corners.point[c] = (at.z * r.y + at.y) * r.x + at.x;
  }
  return corners;
}

// Caches that the texels around a cell have, numbered within the cell.
class CellCaches {
 public:
  CellCaches(const GridTexture& texture, const Corners& corners) {
    for (std::uint32_t c = 0; c < 8; ++c) {
      for (std::uint32_t half = 0; half < kHalves; ++half) {
        const std::size_t texel = std::size_t{kHalves} * corners.point[c] + half;
        Texel& to = texels_[kHalves * c + half];
        for (std::uint32_t k = texture.begin[texel]; k < texture.begin[texel + 1]; ++k) {
          const std::uint32_t share = texture.shares[k];
          to.slot[to.count] = static_cast<std::uint16_t>(find(share & ((1u << kCacheBits) - 1)));
          to.share[to.count] = static_cast<float>(share >> kCacheBits) / static_cast<float>(kMaxShare);
          to.known += to.share[to.count++];
        }
      }
    }
  }

  // Whether any corner sees a cache.
  bool known() const { return count_ > 0; }

  // Half the summed difference of the weights of texture and stencil, 1 where the texture knows nothing; negative where
  // the receiver sees no cache.
  float difference(const Corners& corners, const Around& around, const glm::vec3& normal) {
    std::array<float, 16> wanted;
    if (!weigh(around, normal, wanted)) return -1.0f;
    std::fill_n(weight_.begin(), count_, 0.0f);
    float known = 0.0f;
    for (std::uint32_t c = 0; c < 8; ++c) {
      for (int a = 0; a < 3; ++a) {
        const Texel& texel = texels_[kHalves * c + static_cast<std::uint32_t>(halfOf(normal, a))];
        const float w = corners.weight[c] * normal[a] * normal[a];
        for (std::size_t k = 0; k < texel.count; ++k) {
          weight_[texel.slot[k]] += w * texel.share[k];
          known += w * texel.share[k];
        }
      }
    }
    if (!(known > kMinTexelWeight)) return 1.0f;
    float sum = 0.0f;
    for (std::size_t k = 0; k < count_; ++k) weight_[k] /= known;
    for (std::size_t k = 0; k < around.count; ++k) {
      const auto end = cache_.begin() + static_cast<std::ptrdiff_t>(count_);
      const auto at = std::find(cache_.begin(), end, around.cache[k]);
      if (at == end)
        sum += wanted[k];
      else
        weight_[static_cast<std::size_t>(at - cache_.begin())] -= wanted[k];
    }
    for (std::size_t k = 0; k < count_; ++k) sum += std::abs(weight_[k]);
    return 0.5f * sum;
  }

  // The largest share of a texel's weight that is of caches which another corner of the cell, one that sees any, does
  // not see: whether a wall goes through the cell, however near to its side.
  float hidden(const PackedCaches& caches, const GridTexture& texture, const Corners& corners) const {
    const PackedGrid& grid = caches.grid();
    if (grid.sight.empty()) return 0.0f;
    std::array<float, kMax> unseen;
    float largest = 0.0f;
    for (std::uint32_t from = 0; from < 8; ++from) {
      if (texels_[kHalves * from].known == 0.0f) continue;
      const glm::vec3 corner =
          texture.originWorld + glm::vec3(gridPoint(corners.point[from], texture.resolution)) * texture.spacing;
      for (std::size_t k = 0; k < count_; ++k) {
        unseen[k] = 1.0f - grid.sight.weight(cache_[k], corner - grid.positionWorld[cache_[k]]);
      }
      for (const Texel& texel : texels_) {
        float sum = 0.0f;
        for (std::size_t k = 0; k < texel.count; ++k) sum += texel.share[k] * unseen[texel.slot[k]];
        if (texel.known > 0.0f) largest = std::max(largest, sum / texel.known);
      }
    }
    return largest;
  }

 private:
  static constexpr std::size_t kMax = 8 * kHalves * kMaxTexelCaches;
  struct Texel {
    std::array<std::uint16_t, kMaxTexelCaches> slot;
    std::array<float, kMaxTexelCaches> share;
    float known = 0.0f;
    std::size_t count = 0;
  };
  std::size_t find(std::uint32_t wanted) {
    const auto end = cache_.begin() + static_cast<std::ptrdiff_t>(count_);
    const auto at = static_cast<std::size_t>(std::find(cache_.begin(), end, wanted) - cache_.begin());
    if (at == count_) cache_[count_++] = wanted;
    return at;
  }

  std::array<Texel, 8 * kHalves> texels_;
  std::array<std::uint32_t, kMax> cache_;
  std::array<float, kMax> weight_;
  std::size_t count_ = 0;
};

// Whether the mean difference of a cell's receivers is below `trust`; not where none sees a cache.
bool isOpen(const PackedCaches& caches, const GridTexture& texture, const glm::uvec3& cell,
            const std::array<Probe, kProbes>& probes, float trust) {
  const Corners ends = cornersOf(texture, cell, glm::vec3(0.0f));
  CellCaches own(texture, ends);
  if (!own.known()) return false;
  float sum = 0.0f, count = 0.0f;
  for (std::uint32_t i = 0; i < kProbes; ++i) {
    const glm::vec3 at = glm::min(glm::vec3(cell) + probes[i].place, glm::vec3(texture.resolution - 1u));
    const Around around = lookAround(caches, texture.originWorld + at * texture.spacing);
    const float difference = own.difference(cornersOf(texture, cell, at - glm::vec3(cell)), around, probes[i].normal);
    if (difference >= 0.0f) {
      sum += difference;
      count += 1.0f;
    }
    // Nothing that follows can open it, or it is within something.
    if (sum >= trust * static_cast<float>(kProbes)) return false;
    if (count == 0.0f && i >= kProbes / 2) return false;
  }
  return count > 0.0f && sum < trust * count && own.hidden(caches, texture, ends) <= kMaxHidden;
}

// Take the shares off points that no open cell has as a corner: nothing reads them.
void dropUnread(GridTexture& texture) {
  const glm::uvec3 cells = texture.cells();
  std::uint32_t kept = 0, first = 0;
  for (std::uint32_t point = 0; point < texture.points(); ++point) {
    const glm::uvec3 at = gridPoint(point, texture.resolution), low = glm::max(at, glm::uvec3(1)) - 1u,
                     high = glm::min(at, cells - 1u);
    bool read = false;
    for (std::uint32_t z = low.z; z <= high.z; ++z) {
      for (std::uint32_t y = low.y; y <= high.y; ++y) {
        for (std::uint32_t x = low.x; x <= high.x; ++x)
          read = read || texture.open[(std::size_t{z} * cells.y + y) * cells.x + x] != 0;
      }
    }
    for (std::size_t texel = std::size_t{kHalves} * point; texel < std::size_t{kHalves} * (point + 1); ++texel) {
      const std::uint32_t end = texture.begin[texel + 1];
      texture.begin[texel] = kept;
      if (read) {
        std::uint32_t* const shares = texture.shares.data();
        std::copy(shares + first, shares + end, shares + kept);
        kept += end - first;
      }
      first = end;
    }
  }
  texture.begin.back() = kept;
  texture.shares.resize(kept);
  texture.shares.shrink_to_fit();
}

// Whether this and all cells around it, as far as there are any, are open.
bool openAround(const GridTexture& texture, const glm::uvec3& cell) {
  const glm::uvec3 cells = texture.cells(), low = glm::max(cell, glm::uvec3(1)) - 1u,
                   high = glm::min(cell + 1u, cells - 1u);
  for (std::uint32_t z = low.z; z <= high.z; ++z) {
    for (std::uint32_t y = low.y; y <= high.y; ++y) {
      for (std::uint32_t x = low.x; x <= high.x; ++x) {
        if ((texture.open[(std::size_t{z} * cells.y + y) * cells.x + x] & kOpenCell) == 0) return false;
      }
    }
  }
  return true;
}

// Place the points as densely as the limits allow; false where they allow none.
bool placePoints(const PackedGrid& grid, const GridTextureLimits& limits, GridTexture& texture) {
  for (const std::uint32_t parts : {4u, 3u, 2u, 1u}) {
    const glm::uvec3 r = (grid.resolution - 1u) * parts + 1u;
    // In floating point no product overflows.
    const double points = static_cast<double>(r.x) * r.y * r.z;
    const std::uint64_t side = std::max<std::uint64_t>({r.x, r.y, textureDepth(r.z)});
    if (points * kTexturePointBytes > static_cast<double>(limits.bytes)) continue;
    if (limits.maxSide != 0 && side > limits.maxSide) continue;
    texture.originWorld = grid.originWorld;
    texture.spacing = grid.spacing / static_cast<float>(parts);
    texture.resolution = r;
    return true;
  }
  return false;
}

// Sum of texels of the three halves that a normal reads.
struct TexelSum {
  const GridTexture& texture;
  const float* texels;
  std::array<std::size_t, 3> half;
  std::array<std::array<float, kTexelFloats>, 3> sum{};

  void add(const glm::uvec3& at, float w) {
    const glm::uvec3 r = texture.resolution;
    const std::size_t point = (std::size_t{at.z} * r.y + at.y) * r.x + at.x;
    for (std::size_t a = 0; a < 3; ++a) {
      const float* texel = texels + kTexelFloats * (kHalves * point + half[a]);
      for (std::size_t k = 0; k < kTexelFloats; ++k) sum[a][k] += w * texel[k];
    }
  }
};

}  // namespace

std::size_t GridTexture::openCells() const {
  return static_cast<std::size_t>(
      std::count_if(open.begin(), open.end(), [](std::uint8_t bits) { return (bits & kOpenCell) != 0; }));
}

GridTexture makeGridTexture(const PackedCaches& caches, const GridTextureLimits& limits, const ParallelFor& parallelFor,
                            std::pmr::memory_resource* memory) {
  GridTexture texture(memory);
  if (caches.grid().cache.empty() || !placePoints(caches.grid(), limits, texture)) return texture;

  // Shares, first where each texel has room for the most.
  const std::uint32_t points = texture.points(), texels = kHalves * points;
  std::array<std::array<glm::vec3, 4>, kHalves> normals;
  for (std::uint32_t half = 0; half < kHalves; ++half) normals[half] = normalsOf(half);
  std::pmr::vector<std::uint32_t> roomy(std::size_t{texels} * kMaxTexelCaches, memory);
  texture.begin.resize(std::size_t{texels} + 1);
  forChunks(parallelFor, points, 32, [&](std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t point = first; point < end; ++point) {
      sharePoint(caches, texture, point, normals, &roomy[std::size_t{kHalves} * kMaxTexelCaches * point],
                 &texture.begin[std::size_t{kHalves} * point + 1]);
    }
  });
  for (std::size_t texel = 0; texel < texels; ++texel) texture.begin[texel + 1] += texture.begin[texel];
  texture.shares.resize(texture.begin.back());
  for (std::size_t texel = 0; texel < texels; ++texel) {
    std::copy_n(&roomy[kMaxTexelCaches * texel], texture.begin[texel + 1] - texture.begin[texel],
                texture.shares.begin() + static_cast<std::ptrdiff_t>(texture.begin[texel]));
  }

  // Trust.
  const glm::uvec3 cells = texture.cells();
  texture.open.resize(std::size_t{cells.x} * cells.y * cells.z);
  const std::array<Probe, kProbes> probes = makeProbes();
  forChunks(
      parallelFor, static_cast<std::uint32_t>(texture.open.size()), 32, [&](std::uint32_t first, std::uint32_t end) {
        for (std::uint32_t i = first; i < end; ++i) {
          const bool open = limits.trust >= 1.0f ||
                            (limits.trust > 0.0f && isOpen(caches, texture, gridPoint(i, cells), probes, limits.trust));
          texture.open[i] = open ? kOpenCell : 0;
        }
      });
  for (std::uint32_t i = 0; i < texture.open.size(); ++i) {
    if (openAround(texture, gridPoint(i, cells))) texture.open[i] |= kOpenAround;
  }
  dropUnread(texture);
  for (const std::uint32_t share : texture.shares)
    texture.cacheCount = std::max(texture.cacheCount, (share & ((1u << kCacheBits) - 1)) + 1);
  return texture;
}

std::optional<glm::vec3> readGridTexture(const GridTexture& texture, std::span<const float> texels,
                                         const glm::vec3& positionWorld, const glm::vec3& normal, bool smooth) {
  if (texture.empty() || !isWithin(positionWorld, std::numeric_limits<float>::max()) || !canShade(normal))
    return std::nullopt;
  const float length2 = glm::dot(normal, normal);
  if (!(length2 > 0.0f)) return std::nullopt;
  const glm::vec3 n = normal / std::sqrt(length2), last(texture.resolution - 1u);
  const glm::vec3 near = glm::clamp(positionWorld, -kMaxCoordinate, kMaxCoordinate);
  const glm::vec3 wanted = (near - texture.originWorld) / glm::max(texture.spacing, glm::vec3(1e-20f));
  const glm::vec3 p = glm::clamp(wanted, glm::vec3(0.0f), last), outside = glm::abs(wanted - p);
  if (!(std::max({outside.x, outside.y, outside.z}) <= 0.5f)) return std::nullopt;
  const glm::uvec3 cells = texture.cells(), r = texture.resolution, cell = glm::min(glm::uvec3(p), cells - 1u);
  const std::uint8_t open = texture.open[(std::size_t{cell.z} * cells.y + cell.y) * cells.x + cell.x];
  if ((open & kOpenCell) == 0) return std::nullopt;

  TexelSum sum{texture, texels.data(), {halfOf(n, 0), halfOf(n, 1), halfOf(n, 2)}};
  const glm::vec3 f = p - glm::vec3(cell);
  if (smooth && (open & kOpenAround) != 0) {
    const std::array<float, 4> x = splineWeights(f.x), y = splineWeights(f.y), z = splineWeights(f.z);
    const auto at = [&](int axis, std::uint32_t k) {
      return std::min(std::max(cell[axis] + k, 1u) - 1u, r[axis] - 1u);
    };
    for (std::uint32_t k = 0; k < 64; ++k) {
      const std::uint32_t i = k & 3, j = k >> 2 & 3, l = k >> 4;
      sum.add({at(0, i), at(1, j), at(2, l)}, x[i] * y[j] * z[l]);
    }
  } else {
    const std::array<float, 8> weight = trilinear(f);
    for (std::uint32_t c = 0; c < 8; ++c) sum.add(glm::min(cell + cornerOffset(c), r - 1u), weight[c]);
  }
  const float known = sum.sum[0][3];
  if (!(known > kMinTexelWeight)) return std::nullopt;
  std::array<ColorVector, 3> halves;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::array<float, kTexelFloats>& t = sum.sum[a];
    halves[a] = {glm::vec3(t[0], t[1], t[2]), t[4], t[5]};
  }
  return glm::max(yCoCgToRgb(irradianceYCoCg(halves, n)) / known, glm::vec3(0.0f));
}

}  // namespace relume
