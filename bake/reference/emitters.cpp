// SPDX-License-Identifier: MIT
// See emitters.h. The probability of a triangle is its area times the luminance of its material's emission factor; all
// triangles of a material thus have one density per area, textures or not, and a hit finds its density by instance.
#include "bake/reference/emitters.h"

#include "bake/reference/triangle_light.h"
#include "formats/color.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {

EmittingTriangles::EmittingTriangles(const Scene& scene, RayGeometry geometry)
    : scene_(scene), perInstance_(scene.instances.size(), 0.0f) {
  // Sum area x luminance over the emitting triangles.
  double total = 0.0;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    const float weight = luminance(scene.material(instance).emission);
    const bool met = instance.baked() || geometry == RayGeometry::drawn;
    if (!met || !(weight > 0.0f)) continue;
    const auto count = static_cast<std::uint32_t>(scene.meshes[instance.mesh].triangle.size());
    for (std::uint32_t t = 0; t < count; ++t) {
      const auto c = scene.corners(instance, t);
      const float area = 0.5f * glm::length(glm::cross(c[1] - c[0], c[2] - c[0]));
      if (!(area > 0.0f) || !std::isfinite(area)) continue;
      total += static_cast<double>(area) * weight;
      instance_.push_back(i);
      triangle_.push_back(t);
      cumulative_.push_back(total);
      if (few_.size() <= kMaxAimed)
        few_.push_back({(c[0] + c[1] + c[2]) / 3.0f, geometricNormal(scene, {i, t, glm::vec2(1.0f / 3.0f)}), area,
                        area * weight, scene.material(instance).emission, scene.bothSides(instance, t)});
    }
    perInstance_[i] = weight;
  }
  if (few_.size() > kMaxAimed) few_.clear();
  // Normalise.
  for (double& c : cumulative_) c /= total;
  for (float& w : perInstance_) w = total > 0.0 ? static_cast<float>(w / total) : 0.0f;
}

EmitterSample EmittingTriangles::sample(RandomStream& random) const {
  if (empty()) return {};
  const double u = (random.bits() + 0.5) * 0x1p-32;
  return sample(u, random.uniform2());
}

EmitterSample EmittingTriangles::sample(double u, const glm::vec2& v) const {
  if (empty()) return {};
  const auto found = std::lower_bound(cumulative_.begin(), cumulative_.end(), u);
  return pointOn(static_cast<std::size_t>(std::min(found, cumulative_.end() - 1) - cumulative_.begin()), v);
}

EmitterSample EmittingTriangles::pointOn(std::size_t k, const glm::vec2& v) const {
  // Uniform in the triangle: b = √u₁ (1 - u₂), c = √u₁ u₂.
  EmitterSample s;
  const float root = std::sqrt(v.x);
  const SurfacePoint p{instance_[k], triangle_[k], {root * (1.0f - v.y), root * v.y}};
  const Instance& instance = scene_.instances[p.instance];
  const auto c = scene_.corners(instance, p.triangle);
  s.position = c[0] + (c[1] - c[0]) * p.barycentric.x + (c[2] - c[0]) * p.barycentric.y;
  s.normal = geometricNormal(scene_, p);
  s.emission = scene_.material(instance).emission;
  s.radiance = opaqueAt(scene_, p) ? emissionAt(scene_, p) : glm::vec3(0.0f);
  s.bothSides = scene_.bothSides(instance, p.triangle);
  s.density = perInstance_[p.instance];
  return s;
}

// Power x cosines / d² of a triangle's middle. Neither cosines nor distance are taken for less than the triangle's
// other points may have, so that none is left out that could send light.
void EmittingTriangles::aim(const glm::vec3& positionWorld, const glm::vec3& normal,
                            std::vector<float>& chances) const {
  constexpr float kLeastCosine = 0.1f;
  chances.clear();
  float sum = 0.0f;
  for (const Triangle& t : few_) {
    const glm::vec3 to = t.center - positionWorld;
    const float height = -glm::dot(to, t.normal), squared = glm::dot(to, to), radius = std::sqrt(2.0f * t.area);
    const float distance = std::sqrt(squared), reach = std::max(squared, t.area);
    const float cosine = std::max(glm::dot(to, normal), kLeastCosine * distance) / std::max(distance, radius);
    const float cosEmitter = std::max(std::abs(height), kLeastCosine * distance) / std::max(distance, radius);
    if (height > 0.0f || t.bothSides) sum += t.power * std::max(cosine * cosEmitter, 1e-4f) / reach;
    chances.push_back(sum);
  }
  if (!(sum > 0.0f)) chances.clear();
  for (float& c : chances) c /= sum;
}

EmitterSample EmittingTriangles::sample(std::span<const float> chances, double u, const glm::vec2& v) const {
  if (few_.empty()) return sample(u, v);
  if (chances.empty()) return {};
  const auto found = std::lower_bound(chances.begin(), chances.end(), static_cast<float>(u));
  const auto k = static_cast<std::size_t>(std::min(found, chances.end() - 1) - chances.begin());
  EmitterSample s = pointOn(k, v);
  s.density = (chances[k] - (k > 0 ? chances[k - 1] : 0.0f)) / few_[k].area;
  return s;
}

glm::vec3 EmittingTriangles::openIrradiance(const glm::vec3& positionWorld, const glm::vec3& shading,
                                            const glm::vec3& geometric) const {
  glm::vec3 sum(0.0f);
  for (std::size_t k = 0; k < few_.size(); ++k) {
    const Triangle& t = few_[k];
    if (!t.bothSides && glm::dot(positionWorld - t.center, t.normal) <= 0.0f) continue;
    auto corners = scene_.corners(scene_.instances[instance_[k]], triangle_[k]);
    for (glm::vec3& corner : corners) corner -= positionWorld;
    sum += t.emission * openTriangleLight(corners, shading, geometric);
  }
  return sum;
}

float EmittingTriangles::density(const SurfacePoint& p) const { return perInstance_[p.instance]; }

float EmitterConnection::solidAngle() const {
  return cosine > 0.0f ? cosine * cosEmitter / (distance * distance * density) : 0.0f;
}

glm::vec3 EmitterConnection::irradiance() const { return radiance * solidAngle(); }

glm::vec3 EmitterConnection::openIrradiance() const { return emission * solidAngle(); }

EmitterConnection connectEmitter(const RayTracer& tracer, const EmitterSample& s, const glm::vec3& origin,
                                 const glm::vec3& shading, const glm::vec3& geometric) {
  EmitterConnection c;
  if (!(s.density > 0.0f)) return c;
  const bool behind = glm::dot(s.position - origin, s.normal) > 0.0f;
  if (behind && !s.bothSides) return c;
  const glm::vec3 facing = behind ? -s.normal : s.normal;
  const glm::vec3 target = s.position + facing * tracer.epsilonAt(s.position);
  const glm::vec3 path = target - origin;
  c.distance = glm::length(path);
  if (!(c.distance > 0.0f)) return c;
  const glm::vec3 direction = path / c.distance;
  const float cosine = glm::dot(shading, direction);
  c.cosEmitter = -glm::dot(facing, direction);
  if (cosine <= 0.0f || c.cosEmitter <= 0.0f || glm::dot(geometric, direction) <= 0.0f) return c;
  c.cosine = cosine;
  c.density = s.density;
  c.emission = s.emission;
  if (!tracer.occluded({origin, 0.0f, direction, c.distance})) c.radiance = s.radiance;
  return c;
}

}  // namespace relume
