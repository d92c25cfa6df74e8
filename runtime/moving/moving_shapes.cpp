// SPDX-License-Identifier: MIT
// See relume/moving_shapes.h and moving_shape.h.
#include "relume/moving_shapes.h"

#include "formats/decimal.h"
#include "formats/limits.h"
#include "runtime/moving/moving_shape.h"
#include "runtime/voxels/check_geometry.h"
#include "runtime/voxels/overlap.h"
#include "runtime/voxels/snap_triangles.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <new>
#include <string>
#include <utility>
#include <vector>

namespace relume {

namespace {

std::uint64_t newId() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace

struct MovingShapes::State {
  std::uint64_t id = newId();
  std::vector<MovingShape> shape;
};

namespace {

Error refused(std::size_t mesh, const std::string& what) {
  return Error{ErrorCode::usage, "moving mesh " + std::to_string(mesh) + ": " + what};
}

// Spans that have one element for all triangles, or one for each.
bool fits(std::size_t size, std::size_t triangles) { return size == 1 || size == triangles; }
const glm::vec3& ofTriangle(std::span<const glm::vec3> values, std::size_t t) {
  return values.size() == 1 ? values[0] : values[t];
}

Status checkMesh(const MovingMesh& mesh, std::size_t index) {
  const std::size_t triangles = mesh.triangle.size();
  if (triangles == 0) return refused(index, "has no triangles");
  if (!fits(mesh.albedo.size(), triangles))
    return refused(index, std::to_string(mesh.albedo.size()) + " albedos, expected 1 or one for each of " +
                              std::to_string(triangles) + " triangles");
  if (!mesh.emission.empty() && !fits(mesh.emission.size(), triangles))
    return refused(index, std::to_string(mesh.emission.size()) + " emissions, expected none, 1 or one for each of " +
                              std::to_string(triangles) + " triangles");
  return done();
}

// The mesh as the voxeliser takes it: a surface for each triangle.
struct Surfaces {
  std::vector<VoxelSurface> surface;
  std::vector<std::uint32_t> ofTriangle;

  explicit Surfaces(const MovingMesh& mesh) {
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      VoxelSurface s;
      s.albedo = relume::ofTriangle(mesh.albedo, t);
      if (!mesh.emission.empty()) s.emission = relume::ofTriangle(mesh.emission, t);
      surface.push_back(s);
      ofTriangle.push_back(t);
    }
  }
};

// A sphere around the triangles: about the middle of their box, which is a ball's own centre.
void boundSphere(const VoxelMesh& mesh, const glm::vec3& low, const glm::vec3& high, MovingShape& shape) {
  shape.centre = 0.5f * (low + high);
  forCorners(mesh, [&](const glm::vec3& p) { shape.radius = std::max(shape.radius, glm::distance(p, shape.centre)); });
}

// Set the bits of what the triangles pass, and sum their surfaces by box and facing.
void voxelise(const std::vector<SnappedTriangle>& triangles, const std::vector<VoxelSurface>& surfaces,
              MovingShape& shape) {
  for (const SnappedTriangle& t : triangles) {
    const TriangleOverlap overlap(t);
    const glm::vec3 normal = glm::normalize(glm::vec3(t.normal[0], t.normal[1], t.normal[2]));
    const VoxelSurface& surface = surfaces[t.surface];
    overlap.visit(shape.grid, [&](const glm::ivec3& v) {
      shape.bits[shape.grid.cellOf(v)] |= std::uint64_t{1} << brickBit(v);
      std::uint32_t& index = shape.patchOf[shape.firstPatch(v) + facingOf(normal)];
      if (index == kNoPatch) {
        index = static_cast<std::uint32_t>(shape.patch.size());
        shape.patch.emplace_back();
      }
      // The share of the triangle in this voxel, and so little of what only touches it that it counts alone.
      const float area = static_cast<float>(overlap.covered(v)) + 0x1p-10f;
      ShapePatch& patch = shape.patch[index];
      patch.area += area;
      patch.position += area * (glm::vec3(v) + 0.5f);
      patch.normal += area * normal;
      patch.albedo += area * surface.albedo;
      patch.emission += area * surface.emission;
    });
  }
  for (ShapePatch& patch : shape.patch) {
    const float scale = 1.0f / patch.area;
    patch.position = shape.grid.toWorld(scale * patch.position);
    patch.normal = glm::normalize(patch.normal);
    patch.albedo *= scale;
    patch.emission *= scale;
  }
}

Result<MovingShape> makeShape(const MovingMesh& mesh, std::size_t index) {
  if (Status ok = checkMesh(mesh, index); !ok) return ok.error();
  const Surfaces surfaces(mesh);
  const bool isOneColor = mesh.albedo.size() == 1 && mesh.emission.size() <= 1;
  for (std::size_t t = 0; t < (isOneColor ? 1 : surfaces.surface.size()); ++t) {
    if (Status ok = checkVoxelSurface(surfaces.surface[t]); !ok)
      return refused(index, (isOneColor ? "" : "triangle " + std::to_string(t) + ": ") + ok.error().message);
  }
  const VoxelMesh voxelMesh{mesh.position, mesh.triangle, surfaces.ofTriangle};
  if (Status ok = checkVoxelMesh(voxelMesh, surfaces.surface.size()); !ok) return refused(index, ok.error().message);
  glm::vec3 low = mesh.position[mesh.triangle[0].x], high = low;
  forCorners(voxelMesh, [&](const glm::vec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  });
  MovingShape shape;
  boundSphere(voxelMesh, low, high, shape);
  shape.grid = fitGrid(low, high, kShapeBricks);
  shape.bits.assign(shape.grid.cellCount(), 0);
  shape.boxes = (shape.grid.cells + (kPatchBricks - 1)) / kPatchBricks;
  shape.patchOf.assign(kPatchFacings * static_cast<std::size_t>(shape.boxes.x * shape.boxes.y * shape.boxes.z),
                       kNoPatch);
  std::vector<SnappedTriangle> triangles;
  SnapCounts counts;
  if (!snapTriangles(shape.grid, SnapBox::of(shape.grid), voxelMesh, glm::mat4x3(1.0f), triangles, counts))
    return refused(index, "makes too many triangles of at most 8 voxels");
  voxelise(triangles, surfaces.surface, shape);
  shape.emits =
      std::any_of(mesh.emission.begin(), mesh.emission.end(), [](const glm::vec3& e) { return e != glm::vec3(0.0f); });
  makeViews(shape);
  return shape;
}

}  // namespace

MovingShapes::MovingShapes(std::unique_ptr<State> state) : state_(std::move(state)) {}
MovingShapes::MovingShapes(MovingShapes&&) noexcept = default;
MovingShapes& MovingShapes::operator=(MovingShapes&&) noexcept = default;
MovingShapes::~MovingShapes() = default;

Result<MovingShapes> MovingShapes::create(std::span<const MovingMesh> meshes) {
  try {
    auto state = std::make_unique<State>();
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      Result<MovingShape> shape = makeShape(meshes[i], i);
      if (!shape) return shape.error();
      state->shape.push_back(std::move(*shape));
    }
    return MovingShapes(std::move(state));
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::memory, "moving shapes: memory ran out; fewer triangles take less"};
  }
}

std::size_t MovingShapes::count() const { return state_->shape.size(); }

std::size_t MovingShapes::bytes() const {
  const auto bytes = [](const auto& v) { return v.size() * sizeof(v[0]); };
  std::size_t sum = bytes(state_->shape);
  for (const MovingShape& s : state_->shape) sum += bytes(s.bits) + bytes(s.patchOf) + bytes(s.patch) + bytes(s.view);
  return sum;
}

const MovingShape& MovingShapes::shape(std::uint32_t index) const { return state_->shape[index]; }

std::uint64_t MovingShapes::id() const { return state_->id; }

}  // namespace relume
