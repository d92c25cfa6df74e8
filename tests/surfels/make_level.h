// SPDX-License-Identifier: MIT
// Small levels for the tests of surfels, made in memory.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/surfels/surface_sampler.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/scene.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <optional>
#include <vector>

namespace relume {

class Level {
 public:
  // A new mesh with a material of its own; what is added next belongs to it.
  Material& begin(const char* name) {
    Mesh mesh;
    mesh.name = name;
    mesh.material = static_cast<std::uint32_t>(scene_.materials.size());
    scene_.materials.emplace_back();
    scene_.materials.back().albedo = glm::vec3(0.5f);
    Instance instance;
    instance.node = name;
    instance.mesh = static_cast<std::uint32_t>(scene_.meshes.size());
    instance.firstTriangle = scene_.triangleCount();
    scene_.meshes.push_back(mesh);
    scene_.instances.push_back(instance);
    return scene_.materials.back();
  }

  void addTriangle(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    Mesh& mesh = scene_.meshes.back();
    const auto first = static_cast<std::uint32_t>(mesh.position.size());
    for (const glm::vec3& p : {a, b, c}) mesh.position.push_back(p);
    mesh.triangle.emplace_back(first, first + 1, first + 2);
  }

  // Two triangles whose front faces cross(u, v).
  void addRectangle(const glm::vec3& corner, const glm::vec3& u, const glm::vec3& v) {
    addTriangle(corner, corner + u, corner + u + v);
    addTriangle(corner, corner + u + v, corner + v);
  }

  // The inner faces of a box.
  void addRoom(const glm::vec3& s) {
    addRectangle({0, 0, 0}, {0, 0, s.z}, {s.x, 0, 0});
    addRectangle({0, s.y, 0}, {s.x, 0, 0}, {0, 0, s.z});
    addRectangle({0, 0, 0}, {s.x, 0, 0}, {0, s.y, 0});
    addRectangle({0, 0, s.z}, {0, s.y, 0}, {s.x, 0, 0});
    addRectangle({0, 0, 0}, {0, s.y, 0}, {0, 0, s.z});
    addRectangle({s.x, 0, 0}, {0, 0, s.z}, {0, s.y, 0});
  }

  Scene& scene() { return scene_; }

  // Sides for which sees(side) holds are seen all over.
  template <class Sees>
  PlaySpace playSpace(const Sees& sees) const {
    PlaySpace space;
    const std::uint32_t sides = 2 * scene_.triangleCount();
    space.seenArea = SideArray<float>(sides);
    space.flags = SideArray<std::uint8_t>(sides);
    for (std::uint32_t side = 0; side < sides; ++side) {
      const Instance& instance = scene_.instances[scene_.instanceOf(side / 2)];
      const auto c = scene_.corners(instance, side / 2 - instance.firstTriangle);
      const float area = 0.5f * glm::length(glm::cross(c[1] - c[0], c[2] - c[0]));
      space.total += area;
      if (!sees(side)) continue;
      space.seenArea.set(side, area);
      space.flags.set(side, PlaySpace::kVisible);
      space.seenTotal += area;
    }
    return space;
  }
  PlaySpace fronts() const {
    return playSpace([](std::uint32_t side) { return side % 2 == 0; });
  }
  PlaySpace bothSides() const {
    return playSpace([](std::uint32_t) { return true; });
  }

  RayTracer tracer(Context& context) const {
    Result<RayTracer> tracer = RayTracer::create(scene_, "avx2", context);
    EXPECT_TRUE(tracer);
    return std::move(*tracer);
  }

 private:
  Scene scene_;
};

// Surfels at random on the seen sides.
inline std::vector<SurfaceSample> scatter(const Level& constLevel, const PlaySpace& space, std::size_t count) {
  Level& level = const_cast<Level&>(constLevel);
  Context context;
  const RayTracer tracer = level.tracer(context);
  const SurfaceSampler sampler(tracer, space, static_cast<std::uint32_t>(count), 4, context);
  return sampler.draw(count, 3, 0, context);
}

// A seed as the placements see it.
inline SurfaceSample sampleOf(const Scene& scene, std::uint32_t side, const glm::vec2& barycentric) {
  return sampleAt(scene, scene.instanceOf(side / 2), side, barycentric);
}

}  // namespace relume
