// SPDX-License-Identifier: MIT
// Would grid caches do better as irradiance vectors summed straight from links than as spherical harmonics that are
// turned into vectors? Error of both against eight bands of the same links, bytes, and time of one thread by loops
// written alike over links that are unpacked. Prints a table of docs/notes/vectors.md.
//   bench_link_vectors BAKE.relume [repetitions]
#include "formats/color.h"
#include "formats/compact_links.h"
#include "formats/octahedron.h"
#include "formats/pack.h"
#include "formats/sh.h"
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "runtime/cpu/grid_vectors.h"
#include "tests/measure/point_basis.h"
#include "tests/measure/traced_light.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <span>
#include <vector>

namespace relume::test {
namespace {

constexpr std::size_t kLanes = 8;
constexpr std::size_t kNormals = 96;
constexpr float kY0 = 0.28209479f;
using Lanes = std::array<float, kLanes>;

// Links of the grid's caches, rows filled up to whole lanes by links without light. Of each the direction, the cone's
// cosine, and Y, Co, Cg of radiosity times transfer.
struct GridLinks {
  std::vector<std::size_t> begin{0};
  std::vector<float> x, y, z, cosine, light[3];
  std::size_t links = 0;          // without those that fill rows
  double luma = 0.0, wide = 0.0;  // light of all links, and of those whose cones have half angles above 45 degrees

  void add(const LinkDirection& to, const glm::vec3& yCoCg) {
    x.push_back(to.direction.x);
    y.push_back(to.direction.y);
    z.push_back(to.direction.z);
    cosine.push_back(to.cosAlpha);
    for (int k = 0; k < 3; ++k) light[k].push_back(yCoCg[k]);
  }
};

// Direction and transfer of a link; false for kinds without a cone.
bool readLink(const Links& links, std::uint32_t i, LinkDirection& to, float& transfer) {
  if (links.kind == LinkKind::cone) {
    const ConeLink& link = links.cone[i];
    to = {unpackOctahedral(link.direction), unpackHalf(link.cosAlpha)};
    transfer = unpackHalf(link.transfer);
    return true;
  }
  if (!linkHasHead(links.kind)) return false;
  transfer = unpackTransfer(links.head[i] >> 20);
  to = links.kind == LinkKind::oct6 ? unpackShape6(links.shape[i / 2] >> (16 * (i % 2))) : unpackShape8(links.shape[i]);
  return true;
}

// asin to 7e-5 (Abramowitz and Stegun 4.4.45).
float arcSine(float x) {
  const float a = std::abs(x);
  const float r =
      1.5707963f - std::sqrt(1.0f - a) * (1.5707288f + a * (-0.2121144f + a * (0.0742610f - a * 0.0187293f)));
  return std::copysign(r, x);
}

template <std::size_t kNumbers>
void sumLanes(const std::array<Lanes, kNumbers>& sums, float* to) {
  for (std::size_t i = 0; i < kNumbers; ++i) {
    to[i] = 0.0f;
    for (const float each : sums[i]) to[i] += each;
  }
}

// kLuma bands of Y, two of Co and Cg (PIC 4.6): f times the ratios of a cone's bands times y / y_0.
template <int kLuma>
void sumSh(const GridLinks& in, std::size_t row, float* to) {
  constexpr std::size_t kCount = std::size_t{kLuma} * kLuma;
  std::array<Lanes, kCount + 8> sums{};
  for (std::size_t at = in.begin[row]; at < in.begin[row + 1]; at += kLanes) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float x = in.x[at + i], y = in.y[at + i], z = in.z[at + i], c = in.cosine[at + i];
      // Z_1 / Z_0 and Z_2 / Z_0 of a cone.
      const float first = 0.5f * (1.0f + c) * 1.7320508f, second = 0.5f * c * (1.0f + c);
      const float b1[] = {first * y, first * z, first * x};
      const float luma = in.light[0][at + i];
      sums[0][i] += luma;
      for (std::size_t k = 0; k < 3; ++k) sums[1 + k][i] += luma * b1[k];
      if constexpr (kLuma > 2) {
        const float b2[] = {3.8729833f * x * y, 3.8729833f * y * z, 1.1180340f * (3.0f * z * z - 1.0f),
                            3.8729833f * x * z, 1.9364917f * (x * x - y * y)};
        for (std::size_t k = 0; k < 5; ++k) sums[4 + k][i] += luma * second * b2[k];
      }
      for (std::size_t chroma = 0; chroma < 2; ++chroma) {
        const float c1 = in.light[1 + chroma][at + i];
        sums[kCount + 4 * chroma][i] += c1;
        for (std::size_t k = 0; k < 3; ++k) sums[kCount + 4 * chroma + 1 + k][i] += c1 * b1[k];
      }
    }
  }
  sumLanes(sums, to);
}

// The whole sphere's vector of Y, the three differences of halves of Y, the whole sphere's vectors of Co and Cg. A cone
// of half angle alpha about d that the plane of axis a cuts at x of its radius adds S d to the first, and to the second
//   S (sigma(x) d + 4 / (3 pi) sin(alpha) (1 - x²)^(3/2) e),  sigma = 2 / pi (x sqrt(1 - x²) + asin x),
// where e is the axis' part across d, unit: a flat disc's share on either side, and its centroid.
void sumVectors(const GridLinks& in, std::size_t row, float* to) {
  std::array<Lanes, 18> sums{};
  for (std::size_t at = in.begin[row]; at < in.begin[row + 1]; at += kLanes) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float d[] = {in.x[at + i], in.y[at + i], in.z[at + i]}, c = in.cosine[at + i];
      const float scale = 0.5f * (1.0f + c) / kY0, sine = std::sqrt(std::max(1.0f - c * c, 1e-8f));
      const float s = scale * in.light[0][at + i];
      for (std::size_t k = 0; k < 3; ++k) {
        sums[k][i] += s * d[k];
        sums[12 + k][i] += scale * in.light[1][at + i] * d[k];
        sums[15 + k][i] += scale * in.light[2][at + i] * d[k];
      }
      for (std::size_t a = 0; a < 3; ++a) {
        const float across = std::sqrt(std::max(1.0f - d[a] * d[a], 1e-8f));
        const float x = std::min(std::max(d[a] / (sine * across), -1.0f), 1.0f);
        const float rest = std::max(1.0f - x * x, 0.0f), root = std::sqrt(rest);
        const float sigma = 0.63661977f * (x * root + arcSine(x)), lift = 0.42441318f * sine * rest * root / across;
        for (std::size_t k = 0; k < 3; ++k)
          sums[3 + 3 * a + k][i] += s * ((sigma - lift * d[a]) * d[k] + (k == a ? lift : 0.0f));
      }
    }
  }
  sumLanes(sums, to);
}

// The same cone of Y, Co and Cg cut exactly: its vector is S d as well. Those wider than a half of the sphere are cut
// as halves.
void splitCone(const LinkDirection& to, const glm::vec3& light, std::array<SixVectors, 3>& vectors) {
  const float c = std::clamp(to.cosAlpha, 0.0f, 0.9999f);
  const float scale = 0.5f * (1.0f + to.cosAlpha) / (kY0 * kPathPi * (1.0f - c * c));
  for (std::size_t k = 0; k < 3; ++k) addCone(vectors[k], to.direction, c, scale * light[static_cast<int>(k)]);
}

// Least CPU time [ms] of some passes over all rows.
template <class Work>
double timeOf(std::size_t rows, int repetitions, const Work& work) {
  double least = 1e9;
  for (int k = 0; k < repetitions; ++k) {
    const auto begin = std::clock();
    for (std::size_t row = 0; row < rows; ++row) work(row);
    least = std::min(least, 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  return least;
}

struct Score {
  double error = 0.0, square = 0.0, found = 0.0, truth = 0.0, colorError = 0.0, colorSquare = 0.0;

  void add(const glm::vec3& read, const glm::vec3& exact) {
    const glm::vec3 e = glm::max(exact, glm::vec3(0.0f)), d = glm::max(read, glm::vec3(0.0f)) - e;
    const auto luma = [](const glm::vec3& rgb) { return static_cast<double>(rgbToYCoCg(rgb).x); };
    error += luma(d) * luma(d);
    square += luma(e) * luma(e);
    found += luma(d + e);
    truth += luma(e);
    colorError += static_cast<double>(glm::dot(d, d));
    colorSquare += static_cast<double>(glm::dot(e, e));
  }
  void print(const char* name, std::size_t bytes, double ms) const {
    std::printf("| %s | %zu | %.2f | %.2f | %.2f | %.3f |\n", name, bytes, ms, 100.0 * std::sqrt(error / square),
                100.0 * std::sqrt(colorError / colorSquare), found / truth);
  }
};

// Of vectors of Y, Co, Cg in the order of halves.
template <class VectorOf>
glm::vec3 readHalves(const VectorOf& vectorOf, const glm::vec3& n) {
  std::array<ColorVector, 3> halves;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t half = halfOf(n, static_cast<int>(a));
    halves[a] = makeColorVector(half, vectorOf(half, 0), vectorOf(half, 1), vectorOf(half, 2));
  }
  return yCoCgToRgb(irradianceYCoCg(halves, n));
}

glm::vec3 readCacheVectors(const cpu::CacheVectors& vectors, const glm::vec3& n) {
  return readHalves(
      [&](std::size_t half, std::size_t k) {
        const float* v = &vectors[cpu::kVectorFloats * half + 3 * k];
        return glm::vec3(v[0], v[1], v[2]);
      },
      n);
}

int fail(const char* message) { return std::fprintf(stderr, "%s\n", message), 1; }

int run(const char* file, int repetitions) {
  const Result<Bake> bake = readBake(file);
  if (!bake) return fail(bake.error().message.c_str());
  Result<Relighter> relighter = Relighter::create(*bake, {});
  if (!relighter) return fail(relighter.error().message.c_str());
  std::array<Light, 2> lights;
  lights[0].kind = LightKind::directional;
  lights[0].intensity = {30, 28, 25};
  lights[0].direction = glm::normalize(glm::vec3(0.3f, -1, 0.2f));
  lights[1].kind = LightKind::point;
  lights[1].intensity = {40, 20, 5};
  lights[1].positionWorld = bake->caches.positionWorld[bake->caches.count() / 3];
  LightSetup setup;
  setup.lights = lights;
  if (!relightUntilConverged(*relighter, setup)) return fail("the bake cannot be relit");
  const std::vector<glm::vec3> nodes = relighter->nodeRadiosity();

  GridLinks in;
  std::vector<std::array<float, 3 * kMaxCoefficients>> exact;
  std::vector<std::array<SixVectors, 3>> split;
  std::array<float, kMaxCoefficients> c;
  for (std::uint32_t cache = 0; cache < bake->caches.count(); ++cache) {
    if (bake->caches.normal[cache] != glm::vec3(0.0f)) continue;
    exact.emplace_back();
    split.emplace_back();
    for (std::uint32_t i = bake->links.rowBegin[cache]; i < bake->links.rowBegin[cache + 1]; ++i) {
      LinkDirection to;
      float transfer = 0.0f;
      if (!readLink(bake->links, i, to, transfer)) return fail("a bake of links with cones expected");
      const glm::vec3 b = rgbToYCoCg(nodes[bake->links.node(i)]);
      in.add(to, transfer * b);
      ++in.links;
      in.luma += static_cast<double>(transfer * b.x);
      if (to.cosAlpha < 0.70710678f) in.wide += static_cast<double>(transfer * b.x);
      splitCone(to, transfer * b, split.back());
      linkCoefficients(bake->links, i, false, kMaxBands, c);
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t j = 0; j < c.size(); ++j)
          exact.back()[k * kMaxCoefficients + j] += b[static_cast<int>(k)] * c[j];
      }
    }
    while (in.x.size() % kLanes != 0) in.add({}, glm::vec3(0.0f));
    in.begin.push_back(in.x.size());
  }
  if (exact.empty()) return fail("the bake has no grid");

  const std::size_t rows = exact.size();
  std::vector<float> two(12 * rows), three(17 * rows), eighteen(18 * rows);
  std::vector<cpu::CacheVectors> fromTwo(rows), fromThree(rows);
  const double twoMs = timeOf(rows, repetitions, [&](std::size_t r) { sumSh<2>(in, r, &two[12 * r]); });
  const double threeMs = timeOf(rows, repetitions, [&](std::size_t r) { sumSh<3>(in, r, &three[17 * r]); });
  const double vectorsMs = timeOf(rows, repetitions, [&](std::size_t r) { sumVectors(in, r, &eighteen[18 * r]); });
  const double turnTwo = timeOf(rows, repetitions, [&](std::size_t r) {
    cpu::makeCacheVectors({2, 2}, {&two[12 * r], 12}, fromTwo[r]);
  });
  const double turnThree = timeOf(rows, repetitions, [&](std::size_t r) {
    cpu::makeCacheVectors({3, 2}, {&three[17 * r], 17}, fromThree[r]);
  });

  std::array<Score, 7> scores;
  for (std::size_t r = 0; r < rows; ++r) {
    cpu::CacheVectors whole;
    cpu::makeCacheVectors({kMaxBands, kMaxBands}, exact[r], whole);
    for (std::size_t i = 0; i < kNormals; ++i) {
      const float z = 1.0f - (2.0f * static_cast<float>(i) + 1.0f) / static_cast<float>(kNormals);
      const float phi = 2.39996323f * static_cast<float>(i), s = std::sqrt(1.0f - z * z);
      const glm::vec3 n(s * std::cos(phi), s * std::sin(phi), z);
      glm::vec3 truth;
      for (std::size_t k = 0; k < 3; ++k)
        truth[static_cast<int>(k)] = irradianceClamped(kMaxBands, std::span(exact[r]).subspan(k * kMaxCoefficients), n);
      truth = yCoCgToRgb(truth);
      scores[0].add(pointBases()[kTwoBands].read({&two[12 * r], 12}, n), truth);
      scores[1].add(pointBases()[kThreeBands].read({&three[17 * r], 17}, n), truth);
      scores[2].add(readCacheVectors(fromTwo[r], n), truth);
      scores[3].add(readCacheVectors(fromThree[r], n), truth);
      scores[4].add(pointBases()[kEighteenNumbers].read({&eighteen[18 * r], 18}, n), truth);
      scores[5].add(readHalves([&](std::size_t half, std::size_t k) { return split[r][k][half]; }, n), truth);
      scores[6].add(readCacheVectors(whole, n), truth);
    }
  }
  std::printf(
      "%zu caches, %zu links, %.0f %% of the light in cones wider than 45 degrees\n\n| a cache keeps | bytes | ms | "
      "luma: RMSE %% | colour: RMSE %% | energy "
      "|\n|---|---:|---:|---:|---:|---:|\n",
      rows, in.links, 100.0 * in.wide / in.luma);
  scores[0].print("two bands, Y2Co2Cg2, read as such", 24, twoMs);
  scores[1].print("three bands, Y3Co2Cg2, read as such", 40, threeMs);
  scores[2].print("two bands, turned into vectors", 24, twoMs + turnTwo);
  scores[3].print("three bands, turned into vectors", 40, threeMs + turnThree);
  scores[4].print("18 numbers from links", 36, vectorsMs);
  scores[5].print("six vectors of cones cut exactly", 0, 0.0);
  scores[6].print("six vectors of eight bands", 0, 0.0);
  return 0;
}

}  // namespace
}  // namespace relume::test

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: bench_link_vectors BAKE.relume [repetitions]\n"), 1;
  return relume::test::run(argv[1], argc > 2 ? std::atoi(argv[2]) : 20);
}
