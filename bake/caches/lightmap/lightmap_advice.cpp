// SPDX-License-Identifier: MIT
// See lightmap_advice.h.
#include "bake/caches/lightmap/lightmap_advice.h"

#include "formats/decimal.h"
#include "relume/bake/context.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

// Most nodes named in each kind of warning, and the smallest share of all seen surface that is worth one.
constexpr std::size_t kMaxNamed = 10, kMaxSmooth = 5;
constexpr double kMinShare = 1e-3;
// The advised density gives caches to this share of a node's surface in small pieces.
constexpr double kMended = 0.9;
// The largest extras.relume.texelDensity.
constexpr double kMaxDensity = 100.0;
// Smooth parts that would need more than this factor of density are so small that no warning is given.
constexpr double kMaxFollowed = 16.0;
// A smooth part shows its texels when its normals turn by this multiple of kMaxTurn from texel to texel.
constexpr float kVisibleTurn = 1.5f;

// A density as a person would write it, rounded up to two digits.
std::string rounded(double density) {
  const double unit = std::pow(10.0, std::floor(std::log10(density)) - 1.0);
  return decimalGeneral(std::ceil(density / unit - 1e-6) * unit, 6);
}

std::string number(double value) { return decimalGeneral(value, 3); }

// How thick a mesh is in the mean, if it is closed, each edge being walked as often one way as the other, and its
// fronts face outward; 0 otherwise. [m] in its own axes
double thickness(const Mesh& mesh) {
  using Point = std::array<float, 3>;
  std::map<Point, std::uint32_t> numbers;
  const auto vertexAt = [&](const glm::vec3& p) {
    const glm::vec3 q = p + 0.0f;  // -0 is 0
    return numbers.try_emplace(Point{q.x, q.y, q.z}, static_cast<std::uint32_t>(numbers.size())).first->second;
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  double volume = 0.0, area = 0.0;
  for (const glm::uvec3& t : mesh.triangle) {
    const std::array<glm::vec3, 3> corner = {mesh.position[t.x], mesh.position[t.y], mesh.position[t.z]};
    const glm::dvec3 origin = mesh.position[mesh.triangle[0].x];
    const glm::dvec3 cross = glm::cross(glm::dvec3(corner[1] - corner[0]), glm::dvec3(corner[2] - corner[0]));
    volume += glm::dot(glm::dvec3(corner[0]) - origin, cross) / 6.0;
    area += glm::length(cross) / 2.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = vertexAt(corner[k]), b = vertexAt(corner[(k + 1) % 3]);
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  const auto even = [](const auto& edge) { return edge.second == 0; };
  return area > 0.0 && std::all_of(balance.begin(), balance.end(), even) ? std::max(2.0 * volume / area, 0.0) : 0.0;
}

// The seen surface of a node that reads the grid, and its fronts.
struct Unlit {
  double fronts = 0.0;  // [m²] all that is seen, lit or not
  double backs = 0.0;   // [m²] backs of one-sided faces
  double buried = 0.0;  // [m²] behind or inside something
  double small = 0.0;   // [m²] too small for a cache
  // Of each small patch: the density that gives it a cache of its own, and its area. [m²]
  std::vector<std::pair<double, double>> wanted;
};

// The density at which most of a node's surface in small pieces gets caches.
double mendingDensity(Unlit& unlit) {
  std::sort(unlit.wanted.begin(), unlit.wanted.end());
  double lit = 0.0;
  for (const auto& [density, area] : unlit.wanted) {
    lit += area;
    if (lit >= kMended * unlit.small) return density;
  }
  return unlit.wanted.empty() ? 1.0 : unlit.wanted.back().first;
}

class Adviser {
 public:
  Adviser(const Scene& scene, const PatchSet& set, const PatchTexels& texels, const SharedCaches& shared,
          const CacheOptions& options, Context& context)
      : scene_(scene), set_(set), texels_(texels), shared_(shared), options_(options), context_(context) {}

  void run() {
    std::vector<Unlit> unlit(scene_.instances.size());
    double total = 0.0;
    for (std::uint32_t p = 0; p < set_.patches.size(); ++p) {
      total += addPatch(p, unlit[set_.patches[p].instance]);
      if (set_.patches[p].side == 0) unlit[set_.patches[p].instance].fronts += set_.patches[p].area;
    }
    for (std::uint32_t i = 0; i < unlit.size(); ++i) {
      if (isThin(i, unlit[i])) unlit[i].backs = 0.0;
    }
    context_.figure("grid_lit_area_share", total / set_.areaSeen);
    forLargest(
        kMaxNamed, [&](std::uint32_t i) { return unlit[i].small; }, [&](std::uint32_t i) { warnSmall(i, unlit[i]); });
    forLargest(
        kMaxNamed, [&](std::uint32_t i) { return unlit[i].buried; }, [&](std::uint32_t i) { warnBuried(i, unlit[i]); });
    forLargest(
        kMaxNamed, [&](std::uint32_t i) { return unlit[i].backs; }, [&](std::uint32_t i) { warnBacks(i, unlit[i]); });
    adviseSmooth();
  }

 private:
  std::string nameOf(std::uint32_t instance) const { return "node \"" + scene_.instances[instance].node + "\""; }

  // Add a patch without any cache to its node's surface. Returns its area [m²], or 0 for a patch that has a cache.
  double addPatch(std::uint32_t p, Unlit& unlit) const {
    bool buried = false;
    for (std::uint32_t c = texels_.firstTexel[p]; c < texels_.firstTexel[p + 1]; ++c) {
      if (shared_.cacheOfTexel[c] != kNoCache) return 0.0;
      buried = buried || shared_.buried[c] != 0;
    }
    const Patch& patch = set_.patches[p];
    const double area = patch.area;
    // A texel gets a cache of its own from minTexels full texels of surface on: area (density / texel size)² =
    // minTexels.
    const double minTexels = ownCacheTexels(options_), texel = texels_.texelSize;
    const double wanted = std::sqrt(minTexels * texel * texel / std::max(area, 1e-30));
    if (buried || wanted <= static_cast<double>(patch.density)) {
      const Instance& instance = scene_.instances[patch.instance];
      const Chart& chart = set_.meshes[instance.mesh].charts[patch.chart];
      (patch.side == 1 && !scene_.bothSides(instance, chart.triangle[0]) ? unlit.backs : unlit.buried) += area;
      return area;
    }
    // Keep the part of the density that does not come from the level.
    const double others = patch.density / scene_.instances[patch.instance].texelDensity;
    unlit.small += area;
    unlit.wanted.emplace_back(wanted / others, area);
    return area;
  }

  // Where a plate is thinner than what the play space tells apart, its backs count as seen with the fronts before them.
  // A room whose faces were not turned over is closed as well, but is no plate.
  bool isThin(std::uint32_t instance, const Unlit& unlit) const {
    if (!(unlit.backs > kMinShare * set_.areaSeen) || !(unlit.fronts > 0.5 * unlit.backs)) return false;
    const Instance& placed = scene_.instances[instance];
    const double scale = std::cbrt(std::abs(glm::determinant(glm::dmat3(placed.toWorld))));
    const double thick = scale * thickness(scene_.meshes[placed.mesh]);
    return thick > 0.0 && thick < static_cast<double>(texels_.texelSize);
  }

  // Visit the nodes with the most of some kind of surface, as far as that is worth a warning.
  void forLargest(std::size_t maxCount, const std::function<double(std::uint32_t)>& area,
                  const std::function<void(std::uint32_t)>& warn) const {
    std::vector<std::uint32_t> order(scene_.instances.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return area(a) > area(b); });
    for (std::size_t i = 0; i < std::min(maxCount, order.size()); ++i) {
      if (!(area(order[i]) > kMinShare * set_.areaSeen)) break;
      warn(order[i]);
    }
  }

  void warnSmall(std::uint32_t instance, Unlit& unlit) const {
    const double density = mendingDensity(unlit);
    const std::string what = nameOf(instance) + ": " + number(unlit.small) +
                             " m² of seen surface are in pieces too small for texels of " + number(texels_.texelSize) +
                             " m and read the grid; ";
    if (density <= kMaxDensity)
      context_.message(Severity::warning, what + "raise extras.relume.texelDensity of " + nameOf(instance) + " from " +
                                              number(scene_.instances[instance].texelDensity) + " to " +
                                              rounded(density) +
                                              ", ask for more light-map caches (--lightmap-caches), or mark it "
                                              "extras.relume.bake: \"dynamic\" if it may neither block nor send light");
    else
      context_.message(Severity::warning, what + "join the pieces of " + nameOf(instance) +
                                              ", or mark it extras.relume.bake: \"dynamic\" if it may neither block "
                                              "nor send light: no texelDensity up to 100 gives them caches");
  }

  void warnBacks(std::uint32_t instance, const Unlit& unlit) const {
    context_.message(Severity::warning, nameOf(instance) + ": " + number(unlit.backs) +
                                            " m² of what is seen of it are backs of its one-sided faces, which read "
                                            "the grid; if they are not the inside of something, turn the faces of " +
                                            nameOf(instance) + " over or make their material doubleSided");
  }

  void warnBuried(std::uint32_t instance, const Unlit& unlit) const {
    context_.message(Severity::warning,
                     nameOf(instance) + ": " + number(unlit.buried) +
                         " m² of seen surface read the grid, for from every place on them one sees mostly backs of "
                         "one-sided faces, or touches others; move " +
                         nameOf(instance) +
                         " out of what it lies in, delete its hidden faces, or make the material of the faces around "
                         "it doubleSided");
  }

  // Warn of small smooth parts to which followCurvature() could not give enough texels.
  void adviseSmooth() const {
    std::vector<double> area(scene_.instances.size(), 0.0), density(scene_.instances.size(), 0.0);
    for (const SmoothPart& part : set_.parts) {
      const float texel = texels_.texelSize / part.density, turn = part.curvature * texel;
      if (!isFollowed(part, texels_.texelSize) || turn / part.factor < kVisibleTurn * kMaxTurn) continue;
      const double factor = turn / kMaxTurn;
      if (factor > kMaxFollowed) continue;
      area[part.instance] += part.area;
      density[part.instance] += factor * scene_.instances[part.instance].texelDensity * part.area;
    }
    forLargest(
        kMaxSmooth, [&](std::uint32_t i) { return area[i]; },
        [&](std::uint32_t i) {
          const double wanted = std::min(density[i] / area[i], kMaxDensity);
          context_.message(Severity::info,
                           nameOf(i) + ": " + number(area[i]) + " m² of smooth surface are curved too tightly " +
                               "for texels of " + number(texels_.texelSize) +
                               " m, which may show as facets and seams; extras.relume.texelDensity of " +
                               rounded(wanted) + " follows it (now " + number(scene_.instances[i].texelDensity) + ")");
        });
  }

  const Scene& scene_;
  const PatchSet& set_;
  const PatchTexels& texels_;
  const SharedCaches& shared_;
  const CacheOptions& options_;
  Context& context_;
};

}  // namespace

void warnAboutLightmap(const Scene& scene, const PatchSet& set, const PatchTexels& texels, const SharedCaches& shared,
                       const CacheOptions& options, Context& context) {
  Adviser(scene, set, texels, shared, options, context).run();
}

}  // namespace relume
