// SPDX-License-Identifier: MIT
// What few bands of spherical harmonics cost: irradiance from the first bands of every cache of a bake against that
// from eight, by receivers of many normals, for plain series, windowed ones, and zonal bands (ZH3); and what irradiance
// vectors of all eight bands cost. Prints tables of docs/notes/bands.md and docs/notes/vectors.md.
//   bench_band_error LEVEL.glb BAKE.relume [threads]
#include "bake/import/check_mesh.h"
#include "bake/rays/ray_tracer.h"
#include "bake/reference/path_tracer.h"
#include "formats/color.h"
#include "formats/irradiance_vector.h"
#include "formats/sh.h"
#include "relume/bake/options.h"
#include "relume/bake_file.h"
#include "relume/relighter.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <vector>

namespace relume {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
using Coefficients = std::array<float, kMaxCoefficients>;

// Evenly spread unit directions.
std::vector<glm::vec3> spread(int count) {
  std::vector<glm::vec3> d;
  for (int i = 0; i < count; ++i) {
    const float z = 1.0f - (2.0f * static_cast<float>(i) + 1.0f) / static_cast<float>(count);
    const float phi = static_cast<float>(i) * 2.39996323f, r = std::sqrt(1.0f - z * z);
    d.emplace_back(r * std::cos(phi), r * std::sin(phi), z);
  }
  return d;
}

// A receiver's cache, shading normal and the cache's normal (zero: of the grid).
struct Receiver {
  const Coefficients* c;
  glm::vec3 n, cacheNormal;
};

float plain(int bands, const Receiver& r) { return irradianceClamped(bands, *r.c, r.n); }
// The clamped form, with the guessed third band of two.
float clamped(int bands, const Receiver& r) {
  const Coefficients& c = *r.c;
  return plain(bands, r) + (bands == 2 ? zonalIrradiance(c[0], {c[3], c[1], c[2]}, r.n) : 0.0f);
}

// As the runtime resolves: on the light map the linear form near the cache's normal (formats/sh.h, surfaceLobe()). The
// receiver's plane is the cache's.
float shipped(int bands, const Receiver& r) {
  const float present = glm::dot(r.cacheNormal, r.cacheNormal);
  if (bands < 2) return (1.0f + present) * plain(1, r);
  if (!(present > 0.0f)) return clamped(bands, r);
  const SurfaceLobe lobe = surfaceLobe(glm::dot(r.n, r.cacheNormal), 1.0f);
  return lobe.linear * irradianceLinear(*r.c, r.n) + lobe.clamped * clamped(bands, r);
}

// A share of each band.
float windowed(int bands, const Receiver& r, const std::array<float, kMaxBands>& window) {
  Coefficients c{};
  for (int l = 0; l < bands; ++l) {
    for (int i = l * l; i < (l + 1) * (l + 1); ++i) {
      c[static_cast<std::size_t>(i)] = window[static_cast<std::size_t>(l)] * (*r.c)[static_cast<std::size_t>(i)];
    }
  }
  return irradianceClamped(bands, c, r.n);
}

float hann(int bands, const Receiver& r) {
  std::array<float, kMaxBands> w{};
  for (int l = 0; l < bands; ++l)
    w[static_cast<std::size_t>(l)] = 0.5f * (1.0f + std::cos(kPi * static_cast<float>(l) / static_cast<float>(bands)));
  return windowed(bands, r, w);
}

float lanczos(int bands, const Receiver& r) {
  std::array<float, kMaxBands> w{1.0f};
  for (int l = 1; l < bands; ++l) {
    const float x = kPi * static_cast<float>(l) / static_cast<float>(bands);
    w[static_cast<std::size_t>(l)] = std::sin(x) / x;
  }
  return windowed(bands, r, w);
}

// The runtime's option: the Laplacian's penalty with one lambda for all.
template <int kLambda1000>
float penalised(int bands, const Receiver& r) {
  std::array<float, kMaxBands> w{};
  for (int l = 0; l < bands; ++l) {
    w[static_cast<std::size_t>(l)] =
        1.0f / (1.0f + 1e-3f * kLambda1000 * static_cast<float>(l * l * (l + 1) * (l + 1)));
  }
  return windowed(bands, r, w);
}

// The least lambda of the Laplacian's penalty, window 1 / (1 + lambda l² (l+1)²), that leaves no negative irradiance in
// any direction (Sloan 2017). Kept for the cache it was found for.
float minWindow(int bands, const Receiver& r) {
  static const std::vector<glm::vec3> directions = spread(128);
  static const Coefficients* last = nullptr;
  static int lastBands = 0;
  static std::array<float, kMaxBands> window;
  if (r.c != last || bands != lastBands) {
    last = r.c;
    lastBands = bands;
    const auto make = [&](float lambda) {
      for (int l = 0; l < bands; ++l) {
        const auto laplacian = static_cast<float>(l * l * (l + 1) * (l + 1));
        window[static_cast<std::size_t>(l)] = 1.0f / (1.0f + lambda * laplacian);
      }
    };
    const auto negative = [&](float lambda) {
      make(lambda);
      return std::any_of(directions.begin(), directions.end(), [&](const glm::vec3& d) {
        return windowed(bands, {r.c, d, r.cacheNormal}, window) < 0.0f;
      });
    };
    float low = 0.0f, high = 0.0f;
    if (negative(0.0f)) {
      for (high = 1e-3f; high < 10.0f && negative(high);) low = high, high *= 4.0f;
      for (int step = 0; step < 12; ++step) (negative(0.5f * (low + high)) ? low : high) = 0.5f * (low + high);
    }
    make(high);
  }
  return windowed(bands, r, window);
}

// ZH3 (Roughton et al. 2024): two bands and the zonal coefficient of the third around the second one's direction;
// stored, or guessed from the ratio of the two bands by the paper's own fit.
float zh3(const Receiver& r, bool stored) {
  const Coefficients& c = *r.c;
  const glm::vec3 linear(c[3], c[1], c[2]);
  const float length = glm::length(linear);
  float e = irradianceClamped(2, c, r.n);
  if (!(length > 0.0f) || !(c[0] > 0.0f)) return e;
  const glm::vec3 axis = linear / length;
  float zonal;
  if (stored) {
    Coefficients y;
    evaluateSh(3, axis, y);
    zonal = 0.0f;
    for (std::size_t i = 4; i < 9; ++i) zonal += c[i] * y[i];
    zonal *= std::sqrt(4.0f * kPi / 5.0f);
  } else {
    const float ratio = length / c[0];
    zonal = c[0] * (0.08f + 0.6f * ratio) * ratio;
  }
  const float cosine = glm::dot(axis, r.n);
  e += 0.25f * kPi * zonal * std::sqrt(5.0f / (16.0f * kPi)) * (3.0f * cosine * cosine - 1.0f);
  return e;
}

// Vectors of the eight bands, kept for the cache they were made for.
const SixVectors& vectors(const Receiver& r) {
  static const Coefficients* last = nullptr;
  static SixVectors vectors;
  if (r.c != last) vectors = vectorsFromSh(kMaxBands, *r.c);
  last = r.c;
  return vectors;
}

template <int kCross1000>
float vectorsWith(const Receiver& r) {
  return irradianceFromVectors(vectors(r), r.n, DirectionWeights::corrected, 1e-3f * kCross1000);
}

// The kappa with the least error on receivers: E is linear in it.
double bestCrossWeight(const std::vector<Receiver>& receivers) {
  double above = 0.0, below = 0.0;
  for (const Receiver& r : receivers) {
    const float own = irradianceFromVectors(vectors(r), r.n, DirectionWeights::corrected, 0.0f);
    const float cross = irradianceFromVectors(vectors(r), r.n, DirectionWeights::corrected, 1.0f) - own;
    above += static_cast<double>(cross) * static_cast<double>(plain(kMaxBands, r) - own);
    below += static_cast<double>(cross) * static_cast<double>(cross);
  }
  return above / std::max(below, 1e-30);
}

struct Method {
  const char* name;
  int coefficients;
  float (*irradiance)(const Receiver&);
};
const Method kMethods[] = {
    {"1 band", 1, [](const Receiver& r) { return shipped(1, r); }},
    {"2 bands, clamped cosine", 4, [](const Receiver& r) { return plain(2, r); }},
    {"2 bands, as shipped", 4, [](const Receiver& r) { return shipped(2, r); }},
    {"2 bands, Hann", 4, [](const Receiver& r) { return hann(2, r); }},
    {"2 bands, least window", 4, [](const Receiver& r) { return minWindow(2, r); }},
    {"ZH3 by the paper's fit", 4, [](const Receiver& r) { return zh3(r, false); }},
    {"ZH3, stored coefficient", 5, [](const Receiver& r) { return zh3(r, true); }},
    {"3 bands, clamped cosine", 9, [](const Receiver& r) { return plain(3, r); }},
    {"3 bands, as shipped", 9, [](const Receiver& r) { return shipped(3, r); }},
    {"3 bands, Hann", 9, [](const Receiver& r) { return hann(3, r); }},
    {"3 bands, lambda 0.005", 9, [](const Receiver& r) { return penalised<5>(3, r); }},
    {"3 bands, lambda 0.02", 9, [](const Receiver& r) { return penalised<20>(3, r); }},
    {"3 bands, Lanczos", 9, [](const Receiver& r) { return lanczos(3, r); }},
    {"3 bands, least window", 9, [](const Receiver& r) { return minWindow(3, r); }},
    {"5 bands, clamped cosine", 25, [](const Receiver& r) { return plain(5, r); }},
    {"5 bands, least window", 25, [](const Receiver& r) { return minWindow(5, r); }},
    {"ambient cube", 6, [](const Receiver& r) { return vectorsWith<0>(r); }},
    {"vectors, as printed", 18,
     [](const Receiver& r) { return irradianceFromVectors(vectors(r), r.n, DirectionWeights::printed); }},
    {"vectors, kappa 0.65", 18, [](const Receiver& r) { return vectorsWith<650>(r); }},
    {"vectors, kappa 2/3", 18, [](const Receiver& r) { return irradianceFromVectors(vectors(r), r.n); }},
    {"vectors, kappa 0.7", 18, [](const Receiver& r) { return vectorsWith<700>(r); }},
};

struct Score {
  double error = 0.0, square = 0.0, negative = 0.0, total = 0.0, given = 0.0;
  std::size_t negatives = 0, count = 0;
};

Score score(const Method& method, const std::vector<Receiver>& receivers) {
  Score s;
  for (const Receiver& r : receivers) {
    // What the cache's own plane receives is known exactly: links' cones match band 1.
    const float exact = r.n == r.cacheNormal ? irradianceLinear(*r.c, r.n) : plain(kMaxBands, r);
    const float truth = std::max(exact, 0.0f), raw = method.irradiance(r);
    const double error = std::max(raw, 0.0f) - truth;
    s.error += error * error;
    s.square += static_cast<double>(truth) * truth;
    s.total += truth;
    s.given += std::max(raw, 0.0f);
    if (raw < 0.0f) {
      s.negatives += 1;
      s.negative -= raw;
    }
    s.count += 1;
  }
  return s;
}

// How the chroma of six vectors is kept: the vectors of each channel whole; two numbers a half beside the luma vector,
// by IVG's print, by projections on it, or of the axis alone.
enum class ColorForm { whole, printed, projected, axis };

// Irradiance as R, G, B of Y, Co and Cg's vectors.
glm::vec3 colorOf(ColorForm form, const std::array<SixVectors, 3>& v, const glm::vec3& n) {
  if (form == ColorForm::whole) {
    return yCoCgToRgb({irradianceFromVectors(v[0], n), irradianceFromVectors(v[1], n), irradianceFromVectors(v[2], n)});
  }
  glm::vec3 sum(0.0f), cube(0.0f);
  std::array<glm::vec3, 3> luma;
  for (int a = 0; a < 3; ++a) luma[static_cast<std::size_t>(a)] = v[0][halfOf(n, a)];
  const glm::vec3 parts = axisParts(luma, n);
  for (int a = 0; a < 3; ++a) {
    const std::size_t half = halfOf(n, a);
    const glm::vec3 y = v[0][half], co = v[1][half], cg = v[2][half];
    if (form == ColorForm::axis) {
      cube += n[a] * n[a] * (n[a] < 0.0f ? -1.0f : 1.0f) * glm::vec3(y[a], co[a], cg[a]);
      continue;
    }
    const float length2 = glm::dot(y, y);
    if (!(length2 > 0.0f)) continue;
    if (form == ColorForm::projected) {
      sum += parts[a] * glm::vec3(1.0f, glm::dot(co, y) / length2, glm::dot(cg, y) / length2);
      continue;
    }
    std::array<glm::vec3, 3> rgb;
    for (int b = 0; b < 3; ++b) {
      const glm::vec3 c = yCoCgToRgb({y[b], co[b], cg[b]});
      for (std::size_t k = 0; k < 3; ++k) rgb[k][b] = c[static_cast<int>(k)];
    }
    rgb = unpackVectors(VectorPacking::printed, half, packVectors(VectorPacking::printed, half, rgb, 1.0f));
    for (int k = 0; k < 3; ++k) {
      const auto at = static_cast<std::size_t>(k);
      std::array<glm::vec3, 3> one{};
      one[static_cast<std::size_t>(a)] = rgb[at];
      const glm::vec3 e = axisParts(one, n);
      sum[k] += e[a];
    }
  }
  if (form == ColorForm::printed) return sum;
  if (form == ColorForm::axis) {
    const float y = parts.x + parts.y + parts.z;
    sum = cube.x > 0.0f ? y * glm::vec3(1.0f, cube.y / cube.x, cube.z / cube.x) : glm::vec3(0.0f);
  }
  return yCoCgToRgb(sum);
}

// RMSE in % of the root mean square of R, G, B, of each form, over the grid's caches and many normals.
std::array<double, 4> colorErrors(const Bake& bake, const std::vector<float>& all, std::size_t stride) {
  const std::vector<glm::vec3> directions = spread(96);
  std::array<double, 4> error{};
  double square = 0.0;
  for (std::size_t i = 0; i < bake.caches.count(); ++i) {
    if (bake.caches.normal[i] != glm::vec3(0.0f)) continue;
    std::array<SixVectors, 3> v;
    const std::span<const float> c(all.data() + i * stride, stride);
    for (std::size_t k = 0; k < 3; ++k)
      v[k] = vectorsFromSh(kMaxBands, c.subspan(k * kMaxCoefficients, kMaxCoefficients));
    for (const glm::vec3& n : directions) {
      glm::vec3 truth;
      for (int k = 0; k < 3; ++k)
        truth[k] = irradianceClamped(kMaxBands, c.subspan(static_cast<std::size_t>(k) * kMaxCoefficients), n);
      truth = glm::max(yCoCgToRgb(truth), glm::vec3(0.0f));
      square += static_cast<double>(glm::dot(truth, truth));
      for (std::size_t form = 0; form < 4; ++form) {
        const glm::vec3 d = glm::max(colorOf(static_cast<ColorForm>(form), v, n), glm::vec3(0.0f)) - truth;
        error[form] += static_cast<double>(glm::dot(d, d));
      }
    }
  }
  for (double& e : error) e = 100.0 * std::sqrt(e / std::max(square, 1e-30));
  return error;
}

// Luminance of every cache, eight bands, under one of the level's lights, first bounce to the last.
std::vector<Coefficients> relight(const Bake& bake, const RayTracer& tracer, const std::vector<SceneLight>& lights,
                                  std::array<double, 4>& color) {
  RelightOptions options;
  options.lumaBands = kMaxBands;
  options.chromaBands = kMaxBands;
  Result<Relighter> relighter = Relighter::create(bake, options);
  if (!relighter) return {};
  std::vector<glm::vec3> irradiance;
  for (std::uint32_t i = 0; i < bake.surfels.count(); ++i) {
    irradiance.push_back(directIrradiance(tracer, lights, bake.surfels.positionWorld[i], bake.surfels.normal[i]));
  }
  LightSetup setup;
  setup.surfelIrradiance = irradiance;
  setup.emissionScale = glm::vec3(lights.empty() ? 1.0f : 0.0f);
  if (!relightUntilConverged(*relighter, setup)) return {};
  const std::vector<float> all = relighter->cacheCoefficients();
  const auto stride = static_cast<std::size_t>(relighter->coefficientsPerCache());
  color = colorErrors(bake, all, stride);
  std::vector<Coefficients> caches(bake.caches.count());
  for (std::size_t i = 0; i < caches.size(); ++i)
    std::copy_n(all.data() + i * stride, kMaxCoefficients, caches[i].begin());
  return caches;
}

int run(const char* level, const char* file, int threads) {
  Context context;
  context.threads = threads;
  Result<Scene> scene = importGltf(level, context);
  if (!scene) return std::fprintf(stderr, "%s\n", scene.error().message.c_str()), 1;
  repairMeshes(*scene, context);
  const Result<Bake> bake = readBake(file);
  if (!bake) return std::fprintf(stderr, "%s\n", bake.error().message.c_str()), 1;
  auto tracer = RayTracer::create(*scene, BakeOptions{}.embreeIsa, context);
  if (!tracer) return std::fprintf(stderr, "%s\n", tracer.error().message.c_str()), 1;

  std::vector<std::pair<std::string, std::vector<SceneLight>>> lightings;
  for (const SceneLight& light : scene->lights) lightings.push_back({light.name, {light}});
  const std::vector<glm::vec3> directions = spread(96);
  for (const auto& [name, lights] : lightings) {
    std::array<double, 4> color{};
    const std::vector<Coefficients> caches = relight(*bake, *tracer, lights, color);
    // Grid: every normal. Light map: normals up to 60 degrees from the cache's, as normal maps have them.
    std::vector<Receiver> grid, own, bent;
    for (std::size_t i = 0; i < caches.size(); ++i) {
      const glm::vec3 m = bake->caches.normal[i];
      if (m == glm::vec3(0.0f)) {
        for (const glm::vec3& d : directions) grid.push_back({&caches[i], d, m});
        continue;
      }
      own.push_back({&caches[i], m, m});
      for (const glm::vec3& d : directions) {
        if (const float cosine = glm::dot(d, m); cosine > 0.5f && cosine < 0.99f) bent.push_back({&caches[i], d, m});
      }
    }
    std::printf(
        "\n%s:\n\n| | coefficients | grid: RMSE %% | energy %% | negative %% | their light %% | own normal: RMSE %% | "
        "bent normal: RMSE %% | negative %% |\n",
        name.c_str());
    std::printf("|---|---:|---:|---:|---:|---:|---:|---:|---:|\n");
    for (const Method& method : kMethods) {
      const Score g = score(method, grid), o = score(method, own), b = score(method, bent);
      const auto rmse = [](const Score& s) { return 100.0 * std::sqrt(s.error / std::max(s.square, 1e-30)); };
      const auto share = [](const Score& s) {
        return 100.0 * static_cast<double>(s.negatives) / static_cast<double>(std::max<std::size_t>(s.count, 1));
      };
      std::printf("| %s | %d | %.2f | %+.2f | %.2f | %.3f | %.2f | %.2f | %.2f |\n", method.name, method.coefficients,
                  rmse(g), 100.0 * (g.given / std::max(g.total, 1e-30) - 1.0), share(g),
                  100.0 * g.negative / std::max(g.total, 1e-30), rmse(o), rmse(b), share(b));
    }
    std::printf("\nColour of vectors, RMSE %%: whole %.2f, as printed %.2f, projected %.2f, of the axes %.2f\n",
                color[0], color[1], color[2], color[3]);
    std::printf("\nVectors: kappa %.4f has the least error on the grid.\n", bestCrossWeight(grid));
  }
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "usage: bench_band_error LEVEL.glb BAKE.relume [threads]\n"), 1;
  return relume::run(argv[1], argv[2], argc > 3 ? std::atoi(argv[3]) : 0);
}
