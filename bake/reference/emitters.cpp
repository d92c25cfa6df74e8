// SPDX-License-Identifier: MIT
// See emitters.h. The probability of a triangle is its area times the luminance of its material's emission factor; all
// triangles of a material thus have one density per area, textures or not, and a hit finds its density by instance.
#include "bake/reference/emitters.h"

#include "formats/color.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {

Emitters::Emitters(const Scene& scene, RayGeometry geometry)
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
    }
    perInstance_[i] = weight;
  }
  // Normalise.
  for (double& c : cumulative_) c /= total;
  for (float& w : perInstance_) w = total > 0.0 ? static_cast<float>(w / total) : 0.0f;
}

EmitterSample Emitters::sample(RandomStream& random) const {
  EmitterSample s;
  if (empty()) return s;
  const double u = (random.bits() + 0.5) * 0x1p-32;
  const auto found = std::lower_bound(cumulative_.begin(), cumulative_.end(), u);
  const auto k = static_cast<std::size_t>(std::min(found, cumulative_.end() - 1) - cumulative_.begin());

  // Uniform in the triangle: b = √u₁ (1 - u₂), c = √u₁ u₂.
  const glm::vec2 v = random.uniform2();
  const float root = std::sqrt(v.x);
  const SurfacePoint p{instance_[k], triangle_[k], {root * (1.0f - v.y), root * v.y}};
  const Instance& instance = scene_.instances[p.instance];
  const auto c = scene_.corners(instance, p.triangle);
  s.position = c[0] + (c[1] - c[0]) * p.barycentric.x + (c[2] - c[0]) * p.barycentric.y;
  s.normal = geometricNormal(scene_, p);
  s.radiance = opaqueAt(scene_, p) ? emissionAt(scene_, p) : glm::vec3(0.0f);
  s.bothSides = scene_.bothSides(instance, p.triangle);
  s.density = perInstance_[p.instance];
  return s;
}

float Emitters::density(const SurfacePoint& p) const { return perInstance_[p.instance]; }

}  // namespace relume
