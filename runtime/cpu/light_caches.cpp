// SPDX-License-Identifier: MIT
// See light_caches.h; the kernel is light_caches_kernel.h.
#include "runtime/cpu/light_caches.h"

#include "formats/compact_links.h"
#include "formats/sh.h"
#include "runtime/cpu/chunks.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <vector>

namespace relume::cpu {
namespace {

constexpr std::uint32_t kGrain = 64;

// The cone kernel works with monic polynomials: y_l^m = K q_l^|m|(z) Re or Im (x + i y)^|m| with q's leading factor 1,
// and band ratios without their constant r_l. scale = r_l K / y_0^0 makes up for both at the end of a cache's sum:
//   K = sqrt((2l+1)/(4 pi) (l-|m|)!/(l+|m|)!) sqrt(2 if m != 0) (2l-1)!!/(l-|m|)!
std::array<float, kMaxCoefficients> makeConeScale() {
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

// Steps of sh8 links' bytes: sqrt(2l+1) / 127 (formats/compact_links.h).
std::array<float, kMaxCoefficients> makeSh8Scale() {
  std::array<float, kMaxCoefficients> scale{};
  for (int l = 0; l < kMaxBands; ++l) {
    for (int i = l * l; i < (l + 1) * (l + 1); ++i) {
      scale[static_cast<std::size_t>(i)] = std::sqrt(static_cast<float>(2 * l + 1)) / 127.0f;
    }
  }
  return scale;
}

// What an oct6 link stands for, by its code of direction and of cone, for f = 1 and four bands.
struct Oct6Tables {
  // A cache line each.
  struct alignas(64) Row {
    std::array<float, 16> c{};
  };
  std::vector<Row> direction = std::vector<Row>(4096);
  std::array<Row, 16> cone{};

  Oct6Tables() {
    for (std::uint32_t code = 0; code < 4096; ++code) {
      std::array<float, 16>& y = direction[code].c;
      evaluateSh(4, unpackShape6(code).direction, y);
      const float y0 = y[0];
      for (float& each : y) each /= y0;
    }
    for (std::uint32_t code = 0; code < 16; ++code) {
      std::array<float, 4> ratio;
      coneBandRatios(4, unpackShape6(code << 12).cosAlpha, ratio);
      for (std::size_t l = 0; l < 4; ++l) {
        for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i) cone[code].c[i] = ratio[l];
      }
    }
  }
};

bool processorHas(Simd simd) {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_cpu_init();
  if (simd == Simd::avx2) return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (simd == Simd::avx512) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512dq") && processorHas(Simd::avx2);
  }
#endif
  return simd == Simd::baseline;
}

}  // namespace

LightCachesKernel lightCachesKernel(Simd simd) {
  if (simd == Simd::best) {
    for (const Simd each : {Simd::avx512, Simd::avx2}) {
      if (LightCachesKernel kernel = lightCachesKernel(each)) return kernel;
    }
    return lightCachesBaseline;
  }
  if (!processorHas(simd)) return nullptr;
#if defined(RELUME_X86_KERNELS)
  if (simd == Simd::avx512) return lightCachesAvx512;
  if (simd == Simd::avx2) return lightCachesAvx2;
#endif
  return simd == Simd::baseline ? lightCachesBaseline : nullptr;
}

void lightCaches(LightCachesKernel kernel, const Links& links, std::span<const glm::vec4> node, int lumaBands,
                 int chromaBands, std::span<float> coefficients, const ParallelFor& parallelFor) {
  static const std::array<float, kMaxCoefficients> kConeScale = makeConeScale(), kSh8Scale = makeSh8Scale();
  LightCachesJob job;
  job.node = reinterpret_cast<const float*>(node.data());
  job.rowBegin = links.rowBegin.data();
  job.kind = static_cast<std::uint32_t>(links.kind);
  job.cone = reinterpret_cast<const std::uint32_t*>(links.cone.data());
  job.shNode = links.shNode.data();
  job.shCoefficients = links.shCoefficients.data();
  job.shHalfCount = links.shCoefficients.size();
  job.shStride = links.bands * links.bands;
  job.head = links.head.data();
  job.shape = links.shape.data();
  job.shapeBytes = 4 * links.shape.size();
  job.gridLinks = static_cast<std::uint32_t>(links.kind == LinkKind::irradiance ? links.shape.size() : 0);
  job.lumaBands = lumaBands;
  job.chromaBands = chromaBands;
  job.coneScale = kConeScale.data();
  job.sh8Scale = kSh8Scale.data();
  if (links.kind == LinkKind::oct6 && lumaBands <= 4) {
    static const Oct6Tables kTables;
    job.directionTable = kTables.direction[0].c.data();
    job.coneTable = kTables.cone[0].c.data();
  }
  job.coefficients = coefficients.data();
  if (links.count() == 0) {
    std::fill(coefficients.begin(), coefficients.end(), 0.0f);
    return;
  }
  forChunks(parallelFor, links.cacheCount(), kGrain,
            [&](std::uint32_t begin, std::uint32_t end) { kernel(job, begin, end); });
}

}  // namespace relume::cpu
