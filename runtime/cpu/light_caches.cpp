// SPDX-License-Identifier: MIT
// See light_caches.h; the kernel is light_caches_kernel.h.
#include "runtime/cpu/light_caches.h"

#include "formats/sh.h"
#include "runtime/cpu/simd.h"
#include "runtime/shared/bands.h"
#include "runtime/shared/chunks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace relume::cpu {
namespace {

constexpr std::uint32_t kCachesAtOnce = 64;

// The cone kernel works with monic polynomials: y_l^m = K q_l^|m|(z) Re or Im (x + i y)^|m| with q's leading factor 1,
// and band ratios without their constant r_l. r_l K / y_0^0 makes up for both at the end of a cache's sum:
//   K = sqrt((2l+1)/(4 pi) (l-|m|)!/(l+|m|)!) sqrt(2 if m != 0) (2l-1)!!/(l-|m|)!
std::array<float, kMaxCoefficients> makeMonicScale() {
  constexpr std::array<double, kMaxBands> kRatio = {1.0, 0.5, 0.5, 0.125, 0.125, 0.0625, 0.0625, 0.0078125};
  std::array<float, kMaxCoefficients> scale{};
  for (int l = 0; l < kMaxBands; ++l) {
    for (int m = -l; m <= l; ++m) {
      const int a = std::abs(m);
      double k = std::sqrt((2 * l + 1) * (m != 0 ? 2.0 : 1.0));  // over y_0^0 = sqrt(1 / 4 pi)
      for (int i = l - a + 1; i <= l + a; ++i) k /= std::sqrt(static_cast<double>(i));
      for (int i = 2 * l - 1; i > 1; i -= 2) k *= i;
      for (int i = 2; i <= l - a; ++i) k /= i;
      scale[static_cast<std::size_t>(l * l + l + m)] = static_cast<float>(kRatio[static_cast<std::size_t>(l)] * k);
    }
  }
  return scale;
}

// The scales of a cache's sums, which are of 4 Y, 2 Co, 4 Cg.
std::array<float, 3 * kMaxCoefficients> makeConeScale(int lumaBands, int chromaBands) {
  static const std::array<float, kMaxCoefficients> kMonicScale = makeMonicScale();
  std::array<float, 3 * kMaxCoefficients> scale{};
  const auto luma = static_cast<std::size_t>(lumaBands * lumaBands),
             chroma = static_cast<std::size_t>(chromaBands * chromaBands);
  for (std::size_t i = 0; i < luma; ++i) scale[i] = 0.25f * kMonicScale[i];
  for (std::size_t i = 0; i < chroma; ++i) scale[luma + i] = 0.5f * kMonicScale[i];
  for (std::size_t i = 0; i < chroma; ++i) scale[luma + chroma + i] = 0.25f * kMonicScale[i];
  return scale;
}

}  // namespace

LightCachesKernel lightCachesKernel(Simd simd) {
  switch (chooseSimd(simd)) {
#if defined(RELUME_X86_KERNELS)
    case Simd::avx512:
      return lightCachesAvx512;
    case Simd::avx2:
      return lightCachesAvx2;
#endif
    case Simd::baseline:
      return lightCachesBaseline;
    default:
      return nullptr;
  }
}

void lightCaches(LightCachesKernel kernel, const LinkSet& links, std::span<const std::uint32_t> node,
                 StoredLight& light, const ParallelFor& parallelFor, const CacheSteps& steps) {
  const CacheBands& bands = light.bands();
  LightCachesJob grid{links.rows()};
  grid.node = node.data();
  LightCachesJob map = grid;
  grid.lumaBands = bands.lumaBands;
  grid.chromaBands = bands.chromaBands;
  grid.light = light.gridRows();
  map.lumaBands = bands.onMap(bands.lumaBands);
  map.chromaBands = bands.onMap(bands.chromaBands);
  map.light = light.mapRows();
  if (steps.change != nullptr) {
    grid.change = steps.change->gridRows();
    map.change = steps.change->mapRows();
    grid.changeNode = map.changeNode = steps.changeNode;
    grid.changePerLuma = map.changePerLuma = steps.changePerLuma;
  }
  const auto gridScale = makeConeScale(grid.lumaBands, grid.chromaBands),
             mapScale = makeConeScale(map.lumaBands, map.chromaBands);
  grid.coneScale = gridScale.data();
  map.coneScale = mapScale.data();
  if (links.count() == 0) {
    light.clear();
    if (steps.afterwards) steps.afterwards(0, links.cacheCount());
    return;
  }
  forChunks(parallelFor, links.cacheCount(), kCachesAtOnce, [&](std::uint32_t begin, std::uint32_t end) {
    if (steps.before) steps.before(begin, end);
    const std::uint32_t cut = std::clamp(light.firstMapCache(), begin, end);
    if (begin < cut) kernel(grid, begin, cut);
    if (cut < end) kernel(map, cut, end);
    if (steps.afterwards) steps.afterwards(begin, end);
  });
}

}  // namespace relume::cpu
