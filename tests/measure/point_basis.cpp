// SPDX-License-Identifier: MIT
// See point_basis.h.
#include "tests/measure/point_basis.h"

#include "formats/color.h"
#include "formats/sh.h"
#include "runtime/shared/interpolate.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>

namespace relume::test {
namespace {

template <int kLuma, int kChroma>
void keepSh(const SphereLight& light, std::span<float> numbers) {
  auto to = numbers.begin();
  for (std::size_t k = 0; k < 3; ++k) {
    const int bands = k == 0 ? kLuma : kChroma;
    to = std::copy_n(light.sh[k].begin(), bands * bands, to);
  }
}

// As the runtime's receivers read a grid cache (runtime/shared/resolve.cpp).
template <int kLuma, int kChroma>
glm::vec3 readSh(std::span<const float> numbers, const glm::vec3& n) {
  const CacheBands bands{kLuma, kChroma};
  const auto co = numbers.subspan(bands.lumaCount()), cg = co.subspan(bands.chromaCount());
  glm::vec3 e(irradianceClamped(kLuma, numbers, n), irradianceClamped(kChroma, co, n),
              irradianceClamped(kChroma, cg, n));
  FirstBands first;
  first.add(bands, numbers.data(), 1.0f);
  if constexpr (kLuma > 1 && kChroma == 1) {
    if (first.constant.x > 0.0f) {
      e.y = e.x * first.constant.y / first.constant.x;
      e.z = e.x * first.constant.z / first.constant.x;
    }
  }
  if constexpr (kChroma == 2) {
    const float upper =
        kLuma == 2 ? zonalIrradiance(first.constant.x, first.linear[0], n) : e.x - irradianceClamped(2, numbers, n);
    if (kLuma == 2) e.x += upper;
    const glm::vec2 chroma = upper * chromaOverLuma(first);
    e += glm::vec3(0.0f, chroma.x, chroma.y);
  }
  return yCoCgToRgb(e);
}

// Irradiance of the six axes.
void keepCube(const SphereLight& light, std::span<float> numbers) {
  for (std::size_t half = 0; half < 6; ++half) {
    const int a = static_cast<int>(half / 2);
    for (std::size_t k = 0; k < 3; ++k)
      numbers[3 * half + k] = (half % 2 == 0 ? 1.0f : -1.0f) * light.vectors[k][half][a];
  }
}

glm::vec3 readCube(std::span<const float> numbers, const glm::vec3& n) {
  glm::vec3 e(0.0f);
  for (std::size_t a = 0; a < 3; ++a) {
    const float weight = n[static_cast<int>(a)] * n[static_cast<int>(a)];
    e += weight * glm::vec3(numbers[3 * a], numbers[3 * a + 1], numbers[3 * a + 2]);
  }
  return yCoCgToRgb(e);
}

std::array<glm::vec3, 3> channelsOf(const SphereLight& light, std::size_t half) {
  return {light.vectors[0][half], light.vectors[1][half], light.vectors[2][half]};
}

// As a texel of the grid's texture, without its share.
void keepVectors(const SphereLight& light, std::span<float> numbers) {
  for (std::size_t half = 0; half < 6; ++half) {
    const auto [y, co, cg] = channelsOf(light, half);
    const ColorVector color = makeColorVector(half, y, co, cg);
    const float kept[] = {color.luma.x, color.luma.y, color.luma.z, color.axisCo, color.axisCg};
    std::copy(std::begin(kept), std::end(kept), numbers.begin() + static_cast<std::ptrdiff_t>(5 * half));
  }
}

glm::vec3 readVectors(std::span<const float> numbers, const glm::vec3& n) {
  std::array<ColorVector, 3> halves;
  for (std::size_t a = 0; a < 3; ++a) {
    const float* v = &numbers[5 * a];
    halves[a] = {glm::vec3(v[0], v[1], v[2]), v[3], v[4]};
  }
  return yCoCgToRgb(irradianceYCoCg(halves, n));
}

// IVG 4.2: norms of the vectors of R, G, B, and the unit direction of their sum.
void keepPrinted(const SphereLight& light, std::span<float> numbers) {
  for (std::size_t half = 0; half < 6; ++half) {
    const std::array<glm::vec3, 3> channels = channelsOf(light, half);
    std::array<glm::vec3, 3> rgb;
    for (int b = 0; b < 3; ++b) {
      const glm::vec3 c = yCoCgToRgb({channels[0][b], channels[1][b], channels[2][b]});
      for (std::size_t k = 0; k < 3; ++k) rgb[k][b] = c[static_cast<int>(k)];
    }
    const glm::vec3 sum = rgb[0] + rgb[1] + rgb[2];
    const float length = glm::length(sum);
    for (std::size_t k = 0; k < 3; ++k) {
      numbers[6 * half + k] = glm::length(rgb[k]);
      numbers[6 * half + 3 + k] = length > 0.0f ? sum[static_cast<int>(k)] / length : 0.0f;
    }
  }
}

glm::vec3 readPrinted(std::span<const float> numbers, const glm::vec3& n) {
  glm::vec3 e(0.0f);
  for (std::size_t a = 0; a < 3; ++a) {
    const float* v = &numbers[6 * a];
    const float weight = n[static_cast<int>(a)] * n[static_cast<int>(a)] * glm::dot(glm::vec3(v[3], v[4], v[5]), n);
    e += weight * glm::vec3(v[0], v[1], v[2]);
  }
  return e;
}

// Twelve of luma: I, the vector of the whole sphere, and for each axis J_a, the difference of its two halves.
void keepTwelve(const SphereLight& light, std::span<float> numbers) {
  const SixVectors& y = light.vectors[0];
  for (int b = 0; b < 3; ++b) {
    numbers[static_cast<std::size_t>(b)] = y[0][b] + y[1][b];
    for (std::size_t a = 0; a < 3; ++a)
      numbers[3 + 3 * a + static_cast<std::size_t>(b)] = y[2 * a][b] - y[2 * a + 1][b];
  }
}

float readTwelve(std::span<const float> numbers, const glm::vec3& n) {
  const glm::vec3 whole(numbers[0], numbers[1], numbers[2]);
  std::array<glm::vec3, 3> halves;
  for (std::size_t a = 0; a < 3; ++a) {
    const float sign = n[static_cast<int>(a)] < 0.0f ? -1.0f : 1.0f;
    halves[a] = 0.5f * (whole + sign * glm::vec3(numbers[3 + 3 * a], numbers[4 + 3 * a], numbers[5 + 3 * a]));
  }
  const glm::vec3 parts = axisParts(halves, n);
  return parts.x + parts.y + parts.z;
}

// The whole sphere's vector of Co and Cg besides: chroma in proportion to luma, as the vectors are.
void keepEighteen(const SphereLight& light, std::span<float> numbers) {
  keepTwelve(light, numbers);
  for (std::size_t k = 1; k < 3; ++k) {
    const glm::vec3 whole = light.vectors[k][0] + light.vectors[k][1];
    for (int b = 0; b < 3; ++b) numbers[9 + 3 * k + static_cast<std::size_t>(b)] = whole[b];
  }
}

glm::vec3 readEighteen(std::span<const float> numbers, const glm::vec3& n) {
  const glm::vec3 y(numbers[0], numbers[1], numbers[2]), co(numbers[12], numbers[13], numbers[14]),
      cg(numbers[15], numbers[16], numbers[17]);
  const float e = readTwelve(numbers, n), length2 = glm::dot(y, y);
  if (!(length2 > 0.0f)) return yCoCgToRgb({e, 0.0f, 0.0f});
  return yCoCgToRgb({e, e * std::clamp(glm::dot(co, y) / length2, -2.0f, 2.0f),
                     e * std::clamp(glm::dot(cg, y) / length2, -1.0f, 1.0f)});
}

// Two bands of Co and Cg besides.
void keepTwenty(const SphereLight& light, std::span<float> numbers) {
  keepTwelve(light, numbers);
  for (std::size_t k = 1; k < 3; ++k)
    std::copy_n(light.sh[k].begin(), 4, numbers.begin() + static_cast<std::ptrdiff_t>(8 + 4 * k));
}

glm::vec3 readTwenty(std::span<const float> numbers, const glm::vec3& n) {
  return yCoCgToRgb({readTwelve(numbers, n), irradianceClamped(2, numbers.subspan(12), n),
                     irradianceClamped(2, numbers.subspan(16), n)});
}

constexpr PointBasis kBases[] = {
    {"1 band, Y1Co1Cg1", 8, 3, false, keepSh<1, 1>, readSh<1, 1>},
    {"2 bands, Y2Co2Cg2", 24, 12, false, keepSh<2, 2>, readSh<2, 2>},
    {"3 bands, Y3Co1Cg1", 24, 11, false, keepSh<3, 1>, readSh<3, 1>},
    {"3 bands, Y3Co2Cg2", 40, 17, false, keepSh<3, 2>, readSh<3, 2>},
    {"4 bands, Y4Co2Cg2", 48, 24, false, keepSh<4, 2>, readSh<4, 2>},
    {"5 bands, Y5Co2Cg2", 72, 33, false, keepSh<5, 2>, readSh<5, 2>},
    {"ambient cube", 36, 18, true, keepCube, readCube},
    {"vectors, 18 numbers", 36, 18, false, keepEighteen, readEighteen},
    {"vectors, 12 of luma, two bands of chroma", 40, 20, false, keepTwenty, readTwenty},
    {"vectors, six slabs", 72, 30, true, keepVectors, readVectors},
    {"vectors, six slabs as printed", 72, 36, true, keepPrinted, readPrinted},
};

}  // namespace

void SphereLight::add(const glm::vec3& direction, const glm::vec3& rgb, float solidAngle) {
  const glm::vec3 light = solidAngle * rgbToYCoCg(rgb);
  std::array<float, kBands * kBands> y;
  evaluateSh(kBands, direction, y);
  for (std::size_t k = 0; k < 3; ++k) {
    const float flux = light[static_cast<int>(k)];
    for (std::size_t i = 0; i < y.size(); ++i) sh[k][i] += flux * y[i];
    for (int a = 0; a < 3; ++a) vectors[k][halfOf(direction, a)] += flux * direction;
  }
}

std::span<const PointBasis> pointBases() { return kBases; }

}  // namespace relume::test
