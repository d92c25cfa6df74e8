// SPDX-License-Identifier: MIT
// See receivers_in_sight.h.
#include "bake/caches/receivers_in_sight.h"

#include "bake/base/parallel.h"
#include "bake/caches/cache_in_sight.h"
#include "formats/pack.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <array>
#include <cstddef>
#include <limits>
#include <optional>

namespace relume {
namespace {

constexpr std::size_t kSeedsPerChunk = 1024;
constexpr float kLeastWeight = 1e-3f;  // of a texel that counts as read
constexpr float kAround = 2.0f;        // [texel] how far away other texels are looked for
constexpr float kSameWay = 0.7f;       // cosine between the surfel's normal and that of a cache found there

// The light map as one surfel may read it. Places are in texels: their centres have whole numbers.
class ReadsInSight {
 public:
  ReadsInSight(const RayTracer& tracer, const PlacedCaches& caches, const SurfelSeed& seed)
      : tracer_(tracer),
        caches_(caches),
        seed_(seed),
        last_(glm::vec2(caches.lightmap.width, caches.lightmap.height) - 1.0f) {}

  // Where to read in place of `place`; empty where all that is read there is in sight, or nothing around is.
  std::optional<glm::vec2> instead(const glm::vec2& place) const {
    const glm::vec2 low = glm::floor(place), high = glm::min(low + 1.0f, last_), f = place - low;
    const std::array<glm::vec2, 4> texel{low, {high.x, low.y}, {low.x, high.y}, high};
    std::array<float, 4> weight{(1.0f - f.x) * (1.0f - f.y), f.x * (1.0f - f.y), (1.0f - f.x) * f.y, f.x * f.y};
    std::array<bool, 4> hidden{};
    bool any = false;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t cache = cacheOf(texel[k]);
      if (cache == kNoCache) weight[k] = 0.0f;
      hidden[k] = weight[k] > kLeastWeight && !sees(cache);
      any |= hidden[k];
    }
    if (!any) return std::nullopt;

    float most = kLeastWeight;
    std::optional<glm::vec2> found;
    const auto offer = [&](std::size_t a, std::size_t b, const glm::vec2& at) {
      const float sum = weight[a] + (a == b ? 0.0f : weight[b]);
      if (hidden[a] || hidden[b] || !(sum > most)) return;
      most = sum;
      found = at;
    };
    offer(0, 2, {low.x, place.y});
    offer(1, 3, {high.x, place.y});
    offer(0, 1, {place.x, low.y});
    offer(2, 3, {place.x, high.y});
    for (std::size_t k = 0; k < 4; ++k) offer(k, k, texel[k]);
    return found ? found : nearest(glm::floor(place + 0.5f));
  }

 private:
  std::uint32_t cacheOf(const glm::vec2& texel) const {
    const Lightmap& map = caches_.lightmap;
    return map.cache[static_cast<std::size_t>(texel.y) * map.width + static_cast<std::size_t>(texel.x)];
  }
  bool sees(std::uint32_t cache) const { return seesCache(tracer_, caches_, cache, seed_.positionWorld, seed_.normal); }
  std::optional<glm::vec2> nearest(const glm::vec2& middle) const {
    const glm::vec2 low = glm::max(middle - kAround, glm::vec2(0.0f)), high = glm::min(middle + kAround, last_);
    float least = std::numeric_limits<float>::infinity();
    std::optional<glm::vec2> found;
    for (glm::vec2 texel = low; texel.y <= high.y; ++texel.y) {
      for (texel.x = low.x; texel.x <= high.x; ++texel.x) {
        const std::uint32_t cache = cacheOf(texel);
        if (cache == kNoCache || glm::dot(caches_.normal[cache], seed_.normal) < kSameWay) continue;
        const float distance = glm::distance(caches_.positionWorld[cache], seed_.positionWorld);
        if (!(distance < least) || !sees(cache)) continue;
        least = distance;
        found = texel;
      }
    }
    return found;
  }

  const RayTracer& tracer_;
  const PlacedCaches& caches_;
  const SurfelSeed& seed_;
  glm::vec2 last_;  // the last column and row
};

}  // namespace

void keepReceiversInSight(const RayTracer& tracer, const PlacedCaches& caches, std::span<const SurfelSeed> seeds,
                          std::span<std::uint32_t> receivers, Context& context) {
  const glm::vec2 size(caches.lightmap.width, caches.lightmap.height);
  parallelChunks(context, "", seeds.size(), kSeedsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (receivers[i] == kGridReceiver) continue;
      const glm::vec2 place = glm::clamp(unpackUnorm16x2(receivers[i]) * size - 0.5f, glm::vec2(0.0f), size - 1.0f);
      if (const auto found = ReadsInSight(tracer, caches, seeds[i]).instead(place))
        receivers[i] = packUnorm16x2((*found + 0.5f) / size);
    }
  });
}

}  // namespace relume
