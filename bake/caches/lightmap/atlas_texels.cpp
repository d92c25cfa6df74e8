// SPDX-License-Identifier: MIT
// See atlas_texels.h.
#include "bake/caches/lightmap/atlas_texels.h"

#include "bake/base/parallel.h"
#include "bake/caches/lightmap/snap_corners.h"
#include "bake/caches/lightmap/stitch_seams.h"
#include "formats/pack.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <string>
#include <tuple>

namespace relume {
namespace {

// The cache that all texels of a patch read that have one; kNoCache when none has, or they differ.
std::uint32_t soleCache(const PatchTexels& patchTexels, const SharedCaches& shared, std::size_t patch) {
  std::uint32_t sole = kNoCache;
  for (std::uint32_t c = patchTexels.firstTexel[patch]; c < patchTexels.firstTexel[patch + 1]; ++c) {
    const std::uint32_t cache = shared.cacheOfTexel[c];
    if (cache == kNoCache || cache == sole) continue;
    if (sole != kNoCache) return kNoCache;
    sole = cache;
  }
  return sole;
}

// The caches of a patch's texels, row by row; kNoCache where there is none yet.
std::vector<std::uint32_t> ownTexels(const PatchTexels& patchTexels, const SharedCaches& shared, std::uint32_t patch) {
  const glm::uvec2& size = patchTexels.resolution[patch];
  std::vector<std::uint32_t> texels(std::size_t{size.x} * size.y, kNoCache);
  for (std::uint32_t c = patchTexels.firstTexel[patch]; c < patchTexels.firstTexel[patch + 1]; ++c) {
    const PatchTexel& texel = patchTexels.texels[c];
    texels[std::size_t{texel.y} * size.x + texel.x] = shared.cacheOfTexel[c];
  }
  return texels;
}

// The cache of a filled neighbour, edge neighbours before corner neighbours; kNoCache when none of the eight is filled.
std::uint32_t neighborOf(const glm::uvec2& size, const std::vector<std::uint32_t>& texels, int x, int y) {
  constexpr std::array<std::array<int, 2>, 8> kNeighbors{
      {{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};
  for (const auto& n : kNeighbors) {
    const int nx = x + n[0], ny = y + n[1];
    if (nx < 0 || ny < 0 || nx >= static_cast<int>(size.x) || ny >= static_cast<int>(size.y)) continue;
    const std::uint32_t cache = texels[static_cast<std::size_t>(ny) * size.x + static_cast<std::size_t>(nx)];
    if (cache != kNoCache) return cache;
  }
  return kNoCache;
}

// Dilate over the eight neighbours, ring by ring, until every texel is filled (PIC 4.4). Texels of a ring read earlier
// rings only.
void dilate(const glm::uvec2& size, std::vector<std::uint32_t>& texels, Context& context) {
  // The first ring is the empty texels beside filled ones; each next one is the empty texels beside the ring before.
  std::vector<std::uint32_t> ring, next, found;
  std::vector<std::uint8_t> known(texels.size(), 0);
  for (std::uint32_t i = 0; i < texels.size(); ++i) {
    known[i] = texels[i] != kNoCache;
    if (!known[i] && neighborOf(size, texels, static_cast<int>(i % size.x), static_cast<int>(i / size.x)) != kNoCache)
      ring.push_back(i);
  }
  for (const std::uint32_t i : ring) known[i] = 1;
  while (!ring.empty() && !context.cancelled()) {
    found.clear();
    for (const std::uint32_t i : ring)
      found.push_back(neighborOf(size, texels, static_cast<int>(i % size.x), static_cast<int>(i / size.x)));
    for (std::size_t k = 0; k < ring.size(); ++k) texels[ring[k]] = found[k];
    next.clear();
    for (const std::uint32_t i : ring) {
      for (std::uint32_t k = 0; k < 9; ++k) {
        // An index below zero wraps around, and is then beyond the size.
        const std::uint32_t x = i % size.x + k % 3 - 1, y = i / size.x + k / 3 - 1;
        if (x >= size.x || y >= size.y) continue;
        const std::uint32_t at = y * size.x + x;
        if (known[at]) continue;
        known[at] = 1;
        next.push_back(at);
      }
    }
    ring.swap(next);
  }
}

class Filler {
 public:
  Filler(const Scene& scene, const PatchSet& set, const PatchTexels& patchTexels, const SharedCaches& shared,
         const AtlasRequest& request, const AtlasPlan& plan, std::uint32_t gutter)
      : scene_(scene),
        set_(set),
        patchTexels_(patchTexels),
        shared_(shared),
        request_(request),
        plan_(plan),
        gutter_(gutter),
        texels_(std::size_t{plan.size.x} * plan.size.y, kNoCache),
        share_(texels_.size(), 0.0f),
        home_(shared.caches.size(), glm::uvec2(kNone)) {}

  Result<Lightmap> run(MapCorners& corners, SeamJump& seams, Context& context) {
    placeParts();
    for (std::uint32_t p = 0; p < set_.patches.size() && !context.cancelled(); ++p) {
      if (request_.rectangleOf[p] != kNone) fillRectangle(p, context);
    }
    if (context.cancelled()) return Lightmap{};
    for (std::size_t s = 0; s < request_.single.size(); ++s) {
      const glm::uvec2& at = plan_.single[s];
      texels_[std::size_t{at.y} * plan_.size.x + at.x] = request_.single[s];
      share_[std::size_t{at.y} * plan_.size.x + at.x] = 1.0f;
      home_[request_.single[s]] = at;
    }
    surround();
    corners = writeCorners(false, context);
    if (context.cancelled()) return Lightmap{};
    const Result<SeamJump> stitched = stitchSeams(scene_, set_, shared_, patchTexels_.texelSize,
                                                  {plan_.size, texels_, share_, parts_, corners}, context);
    if (!stitched) return stitched.error();
    seams = *stitched;
    corners = {};
    corners = writeCorners(true, context);
    if (!anyBack_) corners.back = {};

    Lightmap map;
    map.width = plan_.size.x;
    map.height = plan_.size.y;
    map.cache = std::move(texels_);
    map.parts = std::move(parts_);
    return map;
  }

 private:
  void placeParts() {
    std::map<std::tuple<std::string, std::uint32_t, std::uint32_t>, std::uint32_t> seen;
    std::uint64_t corner = 0;
    for (const Instance& instance : scene_.instances) {
      LightmapPart part;
      part.occurrence = seen[{instance.node, instance.primitive, instance.gpuInstance}]++;
      part.primitive = instance.primitive;
      part.gpuInstance = instance.gpuInstance;
      part.triangleCount = static_cast<std::uint32_t>(scene_.meshes[instance.mesh].triangle.size());
      part.firstCorner = corner;
      corner += 3ull * part.triangleCount;
      parts_.push_back(part);
    }
  }

  void fillRectangle(std::uint32_t patch, Context& context) {
    const glm::uvec2 size = patchTexels_.resolution[patch], origin = plan_.rectangle[request_.rectangleOf[patch]];
    std::vector<std::uint32_t> texels = ownTexels(patchTexels_, shared_, patch);
    dilate(size, texels, context);
    if (context.cancelled()) return;
    const float texelSize = patchTexels_.texelSize / set_.patches[patch].density;
    for (std::uint32_t c = patchTexels_.firstTexel[patch]; c < patchTexels_.firstTexel[patch + 1]; ++c) {
      const PatchTexel& texel = patchTexels_.texels[c];
      share_[std::size_t{origin.y + texel.y} * plan_.size.x + origin.x + texel.x] =
          std::min(1.0f, texel.area / (texelSize * texelSize));
    }
    for (std::uint32_t y = 0; y < size.y + gutter_ && origin.y + y < plan_.size.y; ++y) {
      for (std::uint32_t x = 0; x < size.x + gutter_ && origin.x + x < plan_.size.x; ++x) {
        const std::uint32_t cache = texels[std::size_t{std::min(y, size.y - 1)} * size.x + std::min(x, size.x - 1)];
        texels_[std::size_t{origin.y + y} * plan_.size.x + origin.x + x] = cache;
        if (x < size.x && y < size.y && home_[cache] == glm::uvec2(kNone)) home_[cache] = origin + glm::uvec2(x, y);
      }
    }
  }

  // Copy filled texels to the free ones around them: 16-bit coordinates miss a texel's centre by a little.
  void surround() {
    const glm::uvec2 size = plan_.size;
    std::vector<std::uint32_t> ring = texels_;
    for (std::uint32_t y = 0; y < size.y; ++y) {
      for (std::uint32_t x = 0; x < size.x; ++x) {
        std::uint32_t& texel = ring[std::size_t{y} * size.x + x];
        if (texel == kNoCache) texel = neighborOf(size, texels_, static_cast<int>(x), static_cast<int>(y));
      }
    }
    texels_ = std::move(ring);
  }

  std::uint32_t pack(const glm::vec2& texel) const { return packUnorm16x2((texel + 0.5f) / glm::vec2(plan_.size)); }

  // Write where all triangles read, those of some instances at a time. snapped: once the texels have their final
  // caches.
  MapCorners writeCorners(bool snapped, Context& context) {
    constexpr std::size_t kTriangles = 1u << 18;  // at a time, or those of one instance
    MapCorners all;
    std::array<std::vector<TriangleCorners>, 2> sides;
    std::size_t patch = 0, begin = 0;  // begin: the triangle that the sides begin with
    for (std::size_t first = 0, last = 0; first < parts_.size() && !context.cancelled(); first = last) {
      std::size_t triangles = 0;
      for (; last < parts_.size() && (last == first || triangles + parts_[last].triangleCount <= kTriangles); ++last)
        triangles += parts_[last].triangleCount;
      for (std::vector<TriangleCorners>& side : sides) side.resize(side.size() + triangles, kNoCorners);
      std::size_t lastPatch = patch;
      while (lastPatch < set_.patches.size() && set_.patches[lastPatch].instance < last) ++lastPatch;
      parallelChunks(context, "", lastPatch - patch, 16, [&](std::size_t from, std::size_t to) {
        for (std::size_t p = patch + from; p < patch + to; ++p)
          writeCorners(static_cast<std::uint32_t>(p), snapped, begin, sides[set_.patches[p].side]);
      });
      patch = lastPatch;
      // Whole blocks go, the rest waits for what follows.
      const std::size_t whole = last == parts_.size()
                                    ? sides[0].size()
                                    : sides[0].size() / MapCorners::Side::kBlock * MapCorners::Side::kBlock;
      for (std::size_t s = 0; s < 2; ++s) {
        (s == 0 ? all.front : all.back).append(std::span(sides[s]).first(whole));
        sides[s].erase(sides[s].begin(), sides[s].begin() + static_cast<std::ptrdiff_t>(whole));
      }
      begin += whole;
    }
    all.front.shrinkToFit();
    all.back.shrinkToFit();
    return all;
  }

  // Write where the triangles of a patch read. corners: of its side, from the scene-wide triangle `begin` on.
  void writeCorners(std::uint32_t p, bool snapped, std::size_t begin, std::vector<TriangleCorners>& corners) {
    const Patch& patch = set_.patches[p];
    const Instance& instance = scene_.instances[patch.instance];
    const MeshCharts& charts = set_.meshes[instance.mesh];
    const Chart& chart = charts.charts[patch.chart];
    const std::size_t first = static_cast<std::size_t>(parts_[patch.instance].firstCorner / 3) - begin;

    if (request_.rectangleOf[p] == kNone) {
      const std::uint32_t cache = soleCache(patchTexels_, shared_, p);
      if (cache == kNoCache) return;
      const std::uint32_t uv = pack(glm::vec2(home_[cache]));
      for (const std::uint32_t t : chart.triangle) corners[first + t] = {uv, uv, uv};
    } else {
      // Stay a little inside, so that rounding of coordinates and filters does not reach a neighbour's texels.
      const glm::vec2 inset = 1.0f / 512.0f + glm::vec2(plan_.size) / 65535.0f;
      const glm::uvec2 size = patchTexels_.resolution[p];
      const glm::vec2 origin(plan_.rectangle[request_.rectangleOf[p]]);
      glm::vec2 low(0.0f), high(0.0f);
      for (int a = 0; a < 2; ++a) {
        if (size[a] > 1) {
          low[a] = inset[a];
          high[a] = static_cast<float>(size[a] - 1) - inset[a];
        }
      }
      std::vector<glm::vec2> texel;
      for (const auto& uv : chart.uv) {
        for (const glm::vec2& corner : uv)
          texel.push_back(origin + glm::clamp(texelOf(corner, charts.size[patch.chart], size), low, high));
      }
      if (snapped) {
        snapCorners(scene_, patch, chart, shared_, patchTexels_.texelSize / patch.density,
                    {plan_.size, texels_, plan_.rectangle[request_.rectangleOf[p]], size}, origin + low, origin + high,
                    texel);
      }
      for (std::size_t i = 0; i < texel.size(); ++i) corners[first + chart.triangle[i / 3]][i % 3] = pack(texel[i]);
    }
    if (patch.side == 1) anyBack_ = true;
  }

  const Scene& scene_;
  const PatchSet& set_;
  const PatchTexels& patchTexels_;
  const SharedCaches& shared_;
  const AtlasRequest& request_;
  const AtlasPlan& plan_;
  const std::uint32_t gutter_;
  std::vector<std::uint32_t> texels_;
  std::vector<float> share_;      // of a full texel of surface, [0..1]
  std::vector<glm::uvec2> home_;  // [texel] a texel that holds each cache
  std::vector<LightmapPart> parts_;
  std::atomic<bool> anyBack_ = false;
};

}  // namespace

AtlasRequest requestAtlas(const PatchTexels& patchTexels, const SharedCaches& shared) {
  AtlasRequest request;
  const std::size_t patches = patchTexels.resolution.size();
  request.rectangleOf.assign(patches, kNone);
  std::vector<std::uint8_t> onRectangle(shared.caches.size(), 0), wanted(shared.caches.size(), 0);
  for (std::size_t p = 0; p < patches; ++p) {
    if (const std::uint32_t sole = soleCache(patchTexels, shared, p); sole != kNoCache) {
      wanted[sole] = 1;
      continue;
    }
    bool valid = false;
    for (std::uint32_t c = patchTexels.firstTexel[p]; c < patchTexels.firstTexel[p + 1]; ++c) {
      const std::uint32_t cache = shared.cacheOfTexel[c];
      if (cache == kNoCache) continue;
      valid = true;
      onRectangle[cache] = 1;
    }
    if (!valid) continue;
    request.rectangleOf[p] = static_cast<std::uint32_t>(request.rectangle.size());
    request.rectangle.push_back(patchTexels.resolution[p]);
  }
  for (std::uint32_t cache = 0; cache < wanted.size(); ++cache) {
    if (wanted[cache] && !onRectangle[cache]) request.single.push_back(cache);
  }
  return request;
}

Result<Lightmap> fillAtlas(const Scene& scene, const PatchSet& set, const PatchTexels& patchTexels,
                           const SharedCaches& shared, const AtlasRequest& request, const AtlasPlan& plan,
                           std::uint32_t gutter, MapCorners& corners, SeamJump& seams, Context& context) {
  return Filler(scene, set, patchTexels, shared, request, plan, gutter).run(corners, seams, context);
}

}  // namespace relume
