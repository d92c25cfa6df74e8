// SPDX-License-Identifier: MIT
// See emitter_footprints.h. A surfel's cell may be of any shape, lie across a seam of the texture coordinates, or
// across the edge of a repeated image. So its footprint is not a box but a few points: the points drawn in the cell, in
// order along a Morton curve over their coordinates, are cut into kFootprintTaps runs of equal length, and each run
// gives its middle. As points are even over the emitter, taps are even over the image, and an image keeps its power.
#include "bake/surfels/emitter_footprints.h"

#include "bake/base/parallel.h"
#include "formats/pack.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace relume {
namespace {

constexpr std::size_t kPointsPerSurfel = 32;
constexpr std::size_t kMaxPoints = 1u << 21;
constexpr std::size_t kPointsAtOnce = 16384;
constexpr std::uint32_t kSalt = 2;  // of the points; 0 and 1 are the candidates' and the footprints'
constexpr float kSeam = 4.0f;       // a run that is wider than so many taps lies across a seam

std::uint32_t materialOf(const Scene& scene, const SurfaceSample& sample) {
  return scene.meshes[scene.instances[sample.point.instance].mesh].material;
}

struct ImagePlace {
  glm::vec2 at{0.0f};      // before the image is repeated or clamped
  float areaRatio = 0.0f;  // [1/m²] of the image's area per area of the surface
};

ImagePlace placeOnImage(const Scene& scene, const SurfacePoint& p) {
  const Instance& instance = scene.instances[p.instance];
  const Mesh& mesh = scene.meshes[instance.mesh];
  const TextureRef& texture = scene.materials[mesh.material].emissionTexture;
  const std::vector<glm::vec2>& uv = mesh.uv[texture.texcoord];
  if (uv.empty()) return {};
  glm::uvec3 v = mesh.triangle[p.triangle];
  if (instance.flipped) std::swap(v.y, v.z);
  const auto& t = texture.transform;
  const auto transformed = [&t](const glm::vec2& c) {
    return glm::vec2(t[0] * c.x + t[1] * c.y + t[2], t[3] * c.x + t[4] * c.y + t[5]);
  };
  const glm::vec2 a = transformed(uv[v.x]), b = transformed(uv[v.y]) - a, c = transformed(uv[v.z]) - a;
  const std::array<glm::vec3, 3> corner = scene.corners(instance, p.triangle);
  const float world = glm::length(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
  return {a + p.barycentric.x * b + p.barycentric.y * c, std::fabs(b.x * c.y - b.y * c.x) / world};
}

// A coordinate within the image: repeated, mirrored or clamped; 0 where it is nothing a texture can be read at.
float wrapped(float x, Wrap wrap) {
  if (!(std::fabs(x) < 1e7f)) return 0.0f;
  if (wrap == Wrap::repeat) x -= std::floor(x);
  if (wrap == Wrap::mirror) {
    x -= 2.0f * std::floor(0.5f * x);
    if (x > 1.0f) x = 2.0f - x;
  }
  return glm::clamp(x, 0.0f, 1.0f);
}

std::uint32_t mortonOf(const glm::vec2& unit) {
  const auto spread = [](float x) {
    auto v = static_cast<std::uint32_t>(glm::clamp(x, 0.0f, 1.0f) * 65535.0f);
    v = (v | v << 8) & 0x00FF00FFu;
    v = (v | v << 4) & 0x0F0F0F0Fu;
    v = (v | v << 2) & 0x33333333u;
    return (v | v << 1) & 0x55555555u;
  };
  return spread(unit.x) | spread(unit.y) << 1;
}

struct Bounds2 {
  glm::vec2 low{INFINITY}, high{-INFINITY};
  void add(const glm::vec2& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
};

// The taps of a surfel from the places drawn in its cell, at least one. `tapWidth`: of each.
std::array<glm::vec2, kFootprintTaps> chooseTaps(std::span<const glm::vec2> places, float tapWidth) {
  Bounds2 bounds;
  for (const glm::vec2& p : places) bounds.add(p);
  const glm::vec2 size = glm::max(bounds.high - bounds.low, glm::vec2(1e-20f));
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order(places.size());
  for (std::uint32_t i = 0; i < places.size(); ++i) order[i] = {mortonOf((places[i] - bounds.low) / size), i};
  std::sort(order.begin(), order.end());

  std::array<glm::vec2, kFootprintTaps> taps;
  for (std::size_t k = 0; k < taps.size(); ++k) {
    const std::size_t begin = k * places.size() / taps.size();
    const std::size_t end = std::max(begin + 1, (k + 1) * places.size() / taps.size());
    Bounds2 run;
    glm::vec2 sum(0.0f);
    for (std::size_t i = begin; i < end; ++i) {
      run.add(places[order[i].second]);
      sum += places[order[i].second];
    }
    const glm::vec2 extent = run.high - run.low;
    const bool seam = std::max(extent.x, extent.y) > kSeam * tapWidth;
    taps[k] = seam ? places[order[(begin + end) / 2].second] : sum / static_cast<float>(end - begin);
  }
  return taps;
}

// Points of each emitting surfel's cell on its material's image, one surfel after the other.
struct CellPlaces {
  std::vector<std::size_t> begin;  // [Size n_S + 1]
  std::vector<glm::vec2> at;
  std::vector<double> areaRatio;  // [Size n_S] sums
};

CellPlaces findPlaces(const Scene& scene, const SurfelMap& map, std::span<const SurfaceSample> surfels,
                      std::span<const SurfaceSample> points, Context& context) {
  std::vector<ImagePlace> place(points.size());
  std::vector<std::uint32_t> surfel(points.size(), kNone);
  parallelChunks(context, "", points.size(), kPointsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t s = map.at(points[i].side, points[i].point.barycentric);
      if (s == kNone || surfels[s].emitter == kReflector) continue;
      if (materialOf(scene, surfels[s]) != materialOf(scene, points[i])) continue;
      surfel[i] = s;
      place[i] = placeOnImage(scene, points[i].point);
    }
  });
  CellPlaces cells;
  cells.begin.assign(surfels.size() + 1, 0);
  cells.areaRatio.assign(surfels.size(), 0.0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (surfel[i] == kNone) continue;
    ++cells.begin[surfel[i] + 1];
    cells.areaRatio[surfel[i]] += static_cast<double>(place[i].areaRatio);
  }
  for (std::size_t s = 0; s < surfels.size(); ++s) cells.begin[s + 1] += cells.begin[s];
  cells.at.resize(cells.begin.back());
  std::vector<std::size_t> next(cells.begin.begin(), cells.begin.end() - 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (surfel[i] != kNone) cells.at[next[surfel[i]]++] = place[i].at;
  }
  return cells;
}

// Whether every mesh of a material that emits has the coordinates.
bool isTextured(const Scene& scene, std::uint32_t material) {
  const std::uint32_t set = scene.materials[material].emissionTexture.texcoord;
  return std::none_of(scene.instances.begin(), scene.instances.end(), [&](const Instance& instance) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    return instance.baked() && mesh.material == material && mesh.uv[set].empty() && !mesh.triangle.empty();
  });
}

}  // namespace

Emitters findEmitterFootprints(const Scene& scene, const SurfelMap& map, std::span<const SurfaceSample> surfels,
                               const SurfaceSampler& sampler, float spacing, std::uint64_t seed, Context& context) {
  // The surfels of each material.
  std::vector<std::vector<std::uint32_t>> ofMaterial(scene.materials.size());
  std::size_t count = 0;
  for (std::uint32_t s = 0; s < surfels.size(); ++s) {
    if (surfels[s].emitter == kReflector) continue;
    ofMaterial[materialOf(scene, surfels[s])].push_back(s);
    ++count;
  }
  if (count == 0) return {};

  // Their places on its image.
  const std::size_t wanted = std::min(kPointsPerSurfel * count, kMaxPoints);
  const std::vector<SurfaceSample> points = sampler.emittersOnly().draw(wanted, seed, kSalt, context);
  if (context.cancelled()) return {};
  const CellPlaces cells = findPlaces(scene, map, surfels, points, context);

  std::vector<DrivableMaterial> materials;
  std::vector<std::uint32_t> surfel, tap;
  std::vector<float> tapWidth;
  for (std::uint32_t m = 0; m < ofMaterial.size(); ++m) {
    if (ofMaterial[m].empty()) continue;
    const Material& material = scene.materials[m];
    const TextureRef& texture = material.emissionTexture;
    materials.push_back({material.name, static_cast<std::uint32_t>(surfel.size()),
                         static_cast<std::uint32_t>(ofMaterial[m].size()), material.drivable, isTextured(scene, m),
                         texture.wrapU != Wrap::repeat, texture.wrapV != Wrap::repeat});
    for (const std::uint32_t s : ofMaterial[m]) {
      // A cell in which no point fell stands for its own.
      const ImagePlace own = placeOnImage(scene, surfels[s].point);
      std::span<const glm::vec2> places(cells.at.data() + cells.begin[s], cells.begin[s + 1] - cells.begin[s]);
      const double ratio = places.empty() ? own.areaRatio : cells.areaRatio[s] / static_cast<double>(places.size());
      if (places.empty()) places = {&own.at, 1};
      // A hexagon of the densest packing has the area √3/2 spacing².
      const double cell = 0.8660254 * spacing * spacing / surfels[s].density;
      const auto width = static_cast<float>(std::sqrt(ratio * cell / kFootprintTaps));
      surfel.push_back(s);
      tapWidth.push_back(width >= 0.0f ? std::min(width, kMaxTapWidth) : 0.0f);
      for (const glm::vec2& at : chooseTaps(places, tapWidth.back()))
        tap.push_back(packUnorm16x2({wrapped(at.x, texture.wrapU), wrapped(at.y, texture.wrapV)}));
    }
  }
  context.figure("emitter_surfels", static_cast<double>(surfel.size()));
  Emitters emitters;
  emitters.materials = std::move(materials);
  emitters.surfel = std::move(surfel);
  emitters.tap = std::move(tap);
  emitters.tapWidth = std::move(tapWidth);
  return emitters;
}

std::vector<glm::vec3> shineMarked(const Scene& scene, std::span<const SurfaceSample> surfels,
                                   std::vector<glm::vec3>& emission) {
  // Of each material: its surface, and the light it sends as baked, but for a factor that all share.
  struct Sums {
    double area = 0.0, power = 0.0;
  };
  std::vector<Sums> ofMaterial(scene.materials.size());
  float brightest = 0.0f;
  for (std::size_t s = 0; s < surfels.size(); ++s) {
    if (surfels[s].emitter == kReflector) continue;
    const glm::vec3& e = emission[s];
    Sums& sums = ofMaterial[materialOf(scene, surfels[s])];
    const double area = 1.0 / static_cast<double>(surfels[s].density);
    sums.area += area;
    sums.power += area * static_cast<double>(e.x + e.y + e.z) / 3.0;
    brightest = std::max({brightest, e.x, e.y, e.z});
  }
  double strongest = 0.0;
  for (const Sums& sums : ofMaterial) strongest = std::max(strongest, sums.power);

  std::vector<glm::vec3> before;
  for (std::size_t s = 0; s < surfels.size(); ++s) {
    if (surfels[s].emitter == kReflector) continue;
    const std::uint32_t m = materialOf(scene, surfels[s]);
    if (!scene.materials[m].drivable) continue;
    if (before.empty()) before = emission;
    const auto even = static_cast<float>(strongest / ofMaterial[m].area);
    emission[s] = glm::vec3(even > 0.0f ? std::min(even, brightest) : 1.0f);
  }
  return before;
}

}  // namespace relume
