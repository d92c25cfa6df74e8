// SPDX-License-Identifier: MIT
// Bases of points at equal bytes, the points counted in: as many points as fit on a lattice over the play space, each
// lit by rays to the surfels of a relit bake, read trilinearly by receivers anywhere and held against traced paths.
#include "bake/caches/grid/place_grid.h"
#include "bake/caches/grid/see_depths.h"
#include "bake/links/directions.h"
#include "formats/color.h"
#include "formats/pack.h"
#include "relume/relighter.h"
#include "runtime/shared/grid_texture.h"
#include "runtime/shared/resolve.h"
#include "runtime/shared/stencil.h"
#include "tests/measure/grid_receivers.h"
#include "tests/measure/point_basis.h"
#include "tests/measure/spline_prefilter.h"
#include "tools/render/hit_light.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace relume::test {
namespace {

constexpr std::uint32_t kPointRays = 1024;
constexpr std::size_t kTimedReceivers = 57600;
// What a cache of the shipped grid takes besides its coefficients: how far it sees, and its place in the lattice.
constexpr std::size_t kDepthBytes = 4 * kDepthWords + 4;

// Radiance that comes along rays, as R, G, B.
using Incident = std::function<void(std::span<const Ray> rays, std::span<glm::vec3> radiance)>;

// Reads of the lattice: between 8 points; the same, with points behind the receiver's plane weighed down; by a cubic
// B-spline over 64; by the spline that passes through the points.
enum class Reading { trilinear, wrap, spline, prefiltered };

SphereLight lightAround(const Incident& incident, const glm::vec3& position, std::uint64_t item) {
  const DirectionStrata strata(kPointRays);
  DirectionStrata::Sequence sequence(strata, glm::vec3(0.0f), RandomStream(5, 0x62797465, item));
  std::array<DirectionStrata::Sample, DirectionStrata::kBlock> samples;
  std::array<Ray, DirectionStrata::kBlock> rays;
  std::array<glm::vec3, DirectionStrata::kBlock> radiance;
  SphereLight light;
  for (std::uint32_t block = 0; block < strata.count() / DirectionStrata::kBlock; ++block) {
    sequence.next(samples);
    for (std::size_t i = 0; i < rays.size(); ++i) rays[i] = {position, 0.0f, samples[i].direction};
    incident(rays, radiance);
    for (std::size_t i = 0; i < rays.size(); ++i)
      light.add(samples[i].direction, radiance[i], kPathPi * samples[i].weight);
  }
  return light;
}

// Irradiance by the same light without any lattice: what no basis can be better than.
glm::vec3 irradianceThere(const Incident& incident, const TracedReceiver& receiver, std::uint64_t item) {
  const DirectionStrata strata(4 * kPointRays, 0.0f);
  DirectionStrata::Sequence sequence(strata, receiver.normal, RandomStream(6, 0x62797465, item));
  std::array<DirectionStrata::Sample, DirectionStrata::kBlock> samples;
  std::array<Ray, DirectionStrata::kBlock> rays;
  std::array<glm::vec3, DirectionStrata::kBlock> radiance;
  glm::vec3 sum(0.0f);
  for (std::uint32_t block = 0; block < strata.count() / DirectionStrata::kBlock; ++block) {
    sequence.next(samples);
    for (std::size_t i = 0; i < rays.size(); ++i) rays[i] = {receiver.position, 0.0f, samples[i].direction};
    incident(rays, radiance);
    for (std::size_t i = 0; i < rays.size(); ++i) sum += kPathPi * samples[i].weight * samples[i].cosine * radiance[i];
  }
  return sum;
}

struct Lattice {
  PlacedGrid placed;
  std::vector<SphereLight> light;  // [Size placed.position]
  std::size_t points() const { return placed.grid.cache.size(); }
};

// The densest lattice of about cubic cells within so many points.
glm::uvec3 fitPoints(const glm::vec3& extent, std::size_t points) {
  const auto at = [&](float spacing) { return glm::max(glm::uvec3(extent / spacing) + 1u, glm::uvec3(2)); };
  float low = 1e-3f * std::max({extent.x, extent.y, extent.z}), high = 1e3f * low;
  for (int step = 0; step < 60; ++step) {
    const float middle = 0.5f * (low + high);
    const glm::uvec3 r = at(middle);
    (std::size_t{r.x} * r.y * r.z > points ? low : high) = middle;
  }
  return at(high);
}

Result<Lattice> makeLattice(const GridLevel& opened, const glm::uvec3& resolution, const Incident& incident,
                            Context& context) {
  CacheOptions options = opened.options.caches;
  options.gridResolution = resolution;
  options.gridCaches = 0;
  auto placed = placeGrid(*opened.tracer, opened.playSpace, options, context);
  if (!placed) return placed.error();
  Lattice lattice{std::move(*placed), {}};
  lattice.light.resize(lattice.placed.position.size());
  parallelChunks(context, "", lattice.light.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) lattice.light[i] = lightAround(incident, lattice.placed.position[i], i);
  });
  return lattice;
}

// A basis on a lattice, as a texture has it: a weight, 1 where the point has light, and its numbers, of each of six
// halves or of all, rounded to 16 bits.
class PointTexture {
 public:
  PointTexture(const Lattice& lattice, const PointBasis& basis, Reading reading)
      : lattice_(lattice),
        basis_(basis),
        reading_(reading),
        groups_(basis.halves ? 6 : 1),
        size_(basis.numbers / groups_ + 1),
        values_(groups_ * size_ * lattice.points(), 0.0f) {
    std::vector<float> kept(basis.numbers);
    for (std::size_t p = 0; p < lattice.points(); ++p) {
      const std::uint32_t cache = lattice.placed.grid.cache[p];
      if (cache == kNoCache) continue;
      basis.keep(lattice.light[cache], kept);
      for (std::size_t g = 0; g < groups_; ++g) {
        float* to = &values_[(p * groups_ + g) * size_];
        to[0] = 1.0f;
        for (std::size_t i = 0; i + 1 < size_; ++i) to[i + 1] = unpackHalf(packClampedHalf(kept[g * (size_ - 1) + i]));
      }
    }
    if (reading == Reading::prefiltered) prefilterSpline(values_, lattice.placed.grid.resolution, groups_ * size_);
  }

  glm::vec3 read(const glm::vec3& position, const glm::vec3& n) const {
    const CacheGrid& grid = lattice_.placed.grid;
    const glm::uvec3 r = grid.resolution;
    const glm::vec3 p = glm::clamp((position - grid.originWorld) / grid.spacing, glm::vec3(0.0f), glm::vec3(r - 1u));
    const glm::uvec3 cell = glm::min(glm::uvec3(p), r - 2u);
    const glm::vec3 f = p - glm::vec3(cell);
    std::array<float, 3 * 40> sum{};
    const std::size_t used = basis_.halves ? 3 : 1;
    const auto add = [&](const glm::uvec3& at, float w) {
      const std::size_t point = (std::size_t{at.z} * r.y + at.y) * r.x + at.x;
      if (reading_ == Reading::wrap) {
        const std::uint32_t cache = grid.cache[point];
        if (cache == kNoCache) return;
        const glm::vec3 toward = lattice_.placed.position[cache] - position;
        const float distance = glm::length(toward);
        w *= wrapWeight(distance > 0.0f ? glm::dot(toward, n) / distance : 1.0f);
      }
      for (std::size_t a = 0; a < used; ++a) {
        const float* from = &values_[(point * groups_ + (basis_.halves ? halfOf(n, static_cast<int>(a)) : 0)) * size_];
        for (std::size_t i = 0; i < size_; ++i) sum[a * size_ + i] += w * from[i];
      }
    };
    if (reading_ == Reading::trilinear || reading_ == Reading::wrap) {
      const std::array<float, 8> weight = relume::trilinear(f);
      for (std::uint32_t c = 0; c < 8; ++c) add(cell + cornerOffset(c), weight[c]);
    } else {
      const std::array<float, 4> x = splineWeights(f.x), y = splineWeights(f.y), z = splineWeights(f.z);
      for (std::uint32_t k = 0; k < 64; ++k) {
        const glm::uvec3 offset(k & 3, k >> 2 & 3, k >> 4);
        const glm::uvec3 at = glm::min(glm::max(cell + offset, glm::uvec3(1)) - 1u, r - 1u);
        add(at, x[offset.x] * y[offset.y] * z[offset.z]);
      }
    }
    if (!(sum[0] > 1e-3f)) return glm::vec3(0.0f);
    std::array<float, 3 * 40> numbers;
    for (std::size_t a = 0; a < used; ++a) {
      for (std::size_t i = 1; i < size_; ++i) numbers[a * (size_ - 1) + i - 1] = sum[a * size_ + i] / sum[0];
    }
    return glm::max(basis_.read({numbers.data(), basis_.readNumbers()}, n), glm::vec3(0.0f));
  }

 private:
  const Lattice& lattice_;
  const PointBasis& basis_;
  Reading reading_;
  std::size_t groups_, size_;
  std::vector<float> values_;
};

struct TimedReceivers {
  std::vector<glm::vec3> positions, normals;
};

// [ns] a read, of one thread: the least of some passes over receivers in the order of the play space's walks.
double readTime(const PointTexture& texture, const TimedReceivers& receivers) {
  double least = 1e9;
  glm::vec3 sum(0.0f);
  for (int pass = 0; pass < 5; ++pass) {
    const auto begin = std::clock();
    for (std::size_t i = 0; i < receivers.positions.size(); ++i)
      sum += texture.read(receivers.positions[i], receivers.normals[i]);
    const double ns = 1e9 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    least = std::min(least, ns / static_cast<double>(receivers.positions.size()));
  }
  // Keeps the reads from being left out.
  if (!(sum.x >= 0.0f)) std::printf("\n");
  return least;
}

void printBasis(const Lattice& lattice, const PointBasis& basis, const std::vector<TracedReceiver>& receivers,
                const TimedReceivers& timed) {
  struct Row {
    Reading reading;
    const char* suffix;
  };
  const Row rows[] = {{Reading::trilinear, ""}, {Reading::spline, ", spline"}, {Reading::prefiltered, ", prefiltered"}};
  for (const Row& row : rows) {
    if (row.reading != Reading::trilinear && &basis != &pointBases()[kSixSlabs]) continue;
    const PointTexture texture(lattice, basis, row.reading);
    const auto by = [&](const PointTexture& t) {
      return compareReceivers(receivers, [&](const glm::vec3& p, const glm::vec3& n) { return t.read(p, n); });
    };
    const GridFigures f = by(texture);
    const glm::uvec3 r = lattice.placed.grid.resolution;
    std::printf("| %s%s | %zu | %u x %u x %u | %.1f | %.1f | %.3f | %.1f | ", basis.name, row.suffix, basis.bytes, r.x,
                r.y, r.z, 100 * f.rmse, 100 * f.trimmed, f.energy, 100 * f.tooBright);
    if (row.reading == Reading::trilinear) {
      const GridFigures wrap = by(PointTexture(lattice, basis, Reading::wrap));
      std::printf("%.1f, %.1f | ", 100 * wrap.rmse, 100 * wrap.trimmed);
    } else {
      std::printf("| ");
    }
    std::printf("%.0f |\n", readTime(texture, timed));
    std::fflush(stdout);
  }
}

// The caches around, as the runtime reads them, their depth maps counted in.
void printCaches(const Lattice& lattice, int bands, const RayTracer& tracer,
                 const std::vector<TracedReceiver>& receivers, const TimedReceivers& timed, Context& context) {
  const PointBasis& basis = pointBases()[bands == 2 ? kTwoBands : kThreeBands];
  Caches caches;
  caches.grid = lattice.placed.grid;
  caches.positionWorld = lattice.placed.position;
  caches.normal = std::vector<glm::vec3>(lattice.placed.position.size(), glm::vec3(0.0f));
  caches.grid.depth = seeDepths(tracer, lattice.placed.position, caches.grid.depthUnit(), context);
  std::vector<float> coefficients(basis.numbers * lattice.light.size());
  for (std::size_t i = 0; i < lattice.light.size(); ++i)
    basis.keep(lattice.light[i], {&coefficients[i * basis.numbers], basis.numbers});
  const CacheLight light{{bands, 2}, coefficients, true};
  const PackedCaches packed(caches, std::pmr::new_delete_resource());
  const GridFigures f = compareReceivers(
      receivers, [&](const glm::vec3& p, const glm::vec3& n) { return irradianceInGrid(packed, light, p, n); });
  double ns = 1e9;
  for (int pass = 0; pass < 3; ++pass) {
    const auto begin = std::clock();
    for (std::size_t i = 0; i < timed.positions.size(); ++i)
      static_cast<void>(irradianceInGrid(packed, light, timed.positions[i], timed.normals[i]));
    ns = std::min(ns, 1e9 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC /
                          static_cast<double>(timed.positions.size()));
  }
  const glm::uvec3 r = caches.grid.resolution;
  std::printf("| %s, wrap and depth maps | %zu | %u x %u x %u | %.1f | %.1f | %.3f | %.1f | | %.0f |\n", basis.name,
              basis.bytes + kDepthBytes, r.x, r.y, r.z, 100 * f.rmse, 100 * f.trimmed, f.energy, 100 * f.tooBright, ns);
  std::fflush(stdout);
}

}  // namespace

bool printEqualBytes(const GridLevel& opened, const std::string& lights) {
  const TracedLevel& level = *opened.level;
  Context context;
  const auto fail = [](const Error& error) { return std::fprintf(stderr, "%s\n", error.message.c_str()), false; };
  auto baked = bake(level.scene, opened.options, context);
  if (!baked) return fail(baked.error());
  auto relighter = Relighter::create(*baked, {});
  if (!relighter) return fail(relighter.error());
  const std::vector<glm::vec3> direct = shadowedLight(level, baked->surfels);
  LightSetup setup;
  setup.surfelIrradiance = direct;
  setup.emissionScale = glm::vec3(level.emissive ? 1.0f : 0.0f);
  if (const auto lit = relightUntilConverged(*relighter, setup); !lit) return fail(lit.error());

  const auto map = mapSurfels(level.scene, *baked, context);
  const HitLeaf leaves = surfelLeaves(*map);
  const std::vector<glm::vec3> sent = surfelRadiances(*baked, *relighter);
  const Incident incident = [&](std::span<const Ray> rays, std::span<glm::vec3> radiance) {
    std::array<Hit, DirectionStrata::kBlock> hits;
    std::array<std::uint32_t, DirectionStrata::kBlock> leaf;
    leaf.fill(kNone);
    opened.tracer->trace(rays, hits, RayOrder::coherent);
    leaves(rays, hits, leaf);
    for (std::size_t i = 0; i < rays.size(); ++i) radiance[i] = leaf[i] == kNone ? glm::vec3(0.0f) : sent[leaf[i]];
  };

  CacheOptions options = opened.options.caches;
  options.gridResolution = {2, 2, 2};
  options.gridCaches = 0;
  const auto box = placeGrid(*opened.tracer, opened.playSpace, options, context);
  if (!box) return fail(box.error());
  // Walks start at cameras, which may stand outside of what the lattice covers.
  const glm::vec3 low = box->grid.originWorld - 0.5f * box->grid.spacing, high = low + 2.0f * box->grid.spacing;
  const auto inside = [&](const glm::vec3& p) {
    return glm::all(glm::greaterThanEqual(p, low)) && glm::all(glm::lessThanEqual(p, high));
  };
  std::vector<TracedReceiver> receivers;
  for (const TracedReceiver& r : opened.receivers) {
    if (inside(r.position)) receivers.push_back(r);
  }
  TimedReceivers timed;
  RandomStream random(7, 0x62797465, 0);
  for (std::size_t i = 0; timed.positions.size() < kTimedReceivers && !receivers.empty(); ++i) {
    const glm::vec3& p = opened.playSpace.receivers[i % opened.playSpace.receivers.size()];
    if (!inside(p)) continue;
    timed.positions.push_back(p);
    timed.normals.push_back(sphereDirection(random.uniform2()));
  }
  std::vector<glm::vec3> found(receivers.size());
  for (std::size_t i = 0; i < found.size(); ++i) found[i] = irradianceThere(incident, receivers[i], i);
  const TracedError floor = errorOf(receivers, found);
  std::printf("\n%s, %s: %zu receivers; the surfels' light without a lattice: RMSE %.1f, t1 %.1f %%, energy %.3f\n",
              level.scene.name.c_str(), lights.c_str(), receivers.size(), 100 * floor.rmse, 100 * floor.trimmed,
              floor.energy);

  for (const std::size_t bytes : {std::size_t{256} << 10, std::size_t{1} << 20}) {
    std::printf(
        "\n%zu KiB:\n\n| a point keeps | bytes | points | RMSE %% | t1 %% | energy | dark %% | with wrap: RMSE, t1 %% "
        "| read ns |\n|---|---:|---|---:|---:|---:|---:|---|---:|\n",
        bytes >> 10);
    Lattice lattice;
    std::size_t made = 0;
    const auto fit = [&](std::size_t each) {
      if (made == each) return done();
      auto next = makeLattice(opened, fitPoints(box->grid.spacing, bytes / each), incident, context);
      if (!next) return Status(next.error());
      lattice = std::move(*next);
      made = each;
      return done();
    };
    for (const PointBasis& basis : pointBases()) {
      if (const Status ok = fit(basis.bytes); !ok) return fail(ok.error());
      printBasis(lattice, basis, receivers, timed);
    }
    for (const int bands : {2, 3}) {
      if (const Status ok = fit(pointBases()[bands == 2 ? kTwoBands : kThreeBands].bytes + kDepthBytes); !ok)
        return fail(ok.error());
      printCaches(lattice, bands, *opened.tracer, receivers, timed, context);
    }
  }
  return true;
}

}  // namespace relume::test
