// SPDX-License-Identifier: MIT
// relume.h over the C++ API: shapes that move through a level.
#include "runtime/c_handles.h"
#include "runtime/c_setup.h"

#include <string>
#include <vector>

namespace {

using relume::Result;
using relume::Status;
using namespace relume::c;

static_assert(sizeof(glm::uvec3) == 3 * sizeof(unsigned int));

Status readMesh(const relume_moving_mesh& from, std::size_t index, relume::MovingMesh& mesh) {
  const std::string name = "meshes[" + std::to_string(index) + "].";
  if (from.positions == nullptr && from.position_count > 0) return nullPointer(name + "positions");
  if (from.triangles == nullptr && from.triangle_count > 0) return nullPointer(name + "triangles");
  if (from.albedo == nullptr && from.albedo_count > 0) return nullPointer(name + "albedo");
  if (from.emission == nullptr && from.emission_count > 0) return nullPointer(name + "emission");
  mesh.position = vectors(from.positions, from.position_count);
  mesh.triangle = {reinterpret_cast<const glm::uvec3*>(from.triangles), from.triangle_count};
  mesh.albedo = vectors(from.albedo, from.albedo_count);
  mesh.emission = vectors(from.emission, from.emission_count);
  return relume::done();
}

}  // namespace

relume_status relume_moving_shapes_create(relume_context* context, const relume_moving_mesh* meshes, size_t mesh_count,
                                          relume_moving_shapes** shapes) {
  return runToMake(context, shapes, "shapes", [&]() -> Status {
    if (meshes == nullptr && mesh_count > 0) return nullPointer("meshes");
    std::vector<relume::MovingMesh> read(mesh_count);
    for (std::size_t i = 0; i < mesh_count; ++i) {
      if (Status ok = readMesh(meshes[i], i, read[i]); !ok) return ok;
    }
    Result<relume::MovingShapes> made = relume::MovingShapes::create(read);
    if (!made) return made.error();
    *shapes = makeHandle<relume_moving_shapes>(context->host, std::move(*made)).release();
    return relume::done();
  });
}
void relume_moving_shapes_destroy(relume_moving_shapes* shapes) { destroyHandle(shapes); }
