// SPDX-License-Identifier: MIT
// Of how many triangles a ray tracer is built: instances of a large level share what their mesh is built of.
#pragma once

#include "bake/rays/ray_tracer.h"

#include <cstdint>

namespace relume {

struct BuiltTriangles {
  std::uint64_t triangles = 0;  // that rays meet, of all instances
  std::uint64_t ofMeshes = 0;   // of their meshes, each once
  std::uint64_t inShared = 0;   // of what is built if instances share: of meshes for each winding, and of the others
  std::uint32_t instances = 0;

  // Whether instances share the structure of their mesh.
  bool isShared() const;
  std::uint64_t built() const { return isShared() ? inShared : triangles; }
};

BuiltTriangles builtTriangles(const Scene& scene, RayGeometry geometry);

}  // namespace relume
