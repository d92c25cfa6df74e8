// SPDX-License-Identifier: MIT
// See voxel_scene.h.
#include "tools/render/voxel_scene.h"

#include "bake/base/parallel.h"
#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/split_edges.h"

#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <array>
#include <atomic>
#include <limits>
#include <utility>

namespace relume {
namespace {

struct PieceCorner {
  glm::vec3 position{0.0f};     // [m] in the axes of the mesh
  glm::vec2 barycentric{0.0f};  // weighs corners 1 and 2 of the mesh's triangle
};
using Piece = std::array<PieceCorner, 3>;

struct SplitWide {
  glm::mat3 toWorld;
  float width2;
  bool isLong(const PieceCorner& a, const PieceCorner& b) const {
    const glm::vec3 d = toWorld * (b.position - a.position);
    return glm::dot(d, d) > width2;
  }
  PieceCorner middle(const PieceCorner& a, const PieceCorner& b) const {
    return {0.5f * (a.position + b.position), 0.5f * (a.barycentric + b.barycentric)};
  }
};

// Whether a piece lies at one side of the box, grown by `margin`.
bool isOutside(const Piece& piece, const glm::mat4& toWorld, const SceneBounds& box, float margin) {
  glm::vec3 low(std::numeric_limits<float>::max()), high = -low;
  for (const PieceCorner& corner : piece) {
    const glm::vec3 p(toWorld * glm::vec4(corner.position, 1.0f));
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return glm::any(glm::greaterThan(low, box.max + margin)) || glm::any(glm::lessThan(high, box.min - margin));
}

glm::vec2 placeOn(const Piece& piece, float a, float b, float c) {
  return a * piece[0].barycentric + b * piece[1].barycentric + c * piece[2].barycentric;
}

// What a piece reflects and emits, and how much of it is there.
VoxelSurface surfaceOf(const Scene& scene, std::uint32_t instance, std::uint32_t triangle, const Piece& piece,
                       float width) {
  constexpr std::array<std::array<float, 3>, 4> kPlaces{{{1 / 3.0f, 1 / 3.0f, 1 / 3.0f},
                                                         {2 / 3.0f, 1 / 6.0f, 1 / 6.0f},
                                                         {1 / 6.0f, 2 / 3.0f, 1 / 6.0f},
                                                         {1 / 6.0f, 1 / 6.0f, 2 / 3.0f}}};
  const Instance& part = scene.instances[instance];
  const bool isMask = scene.material(part).alphaMode == AlphaMode::mask;
  VoxelSurface surface;
  surface.doubleSided = scene.bothSides(part, triangle);
  if (isMask) surface.coverage = 0.0f;
  for (const auto& [a, b, c] : kPlaces) {
    glm::vec2 at = placeOn(piece, a, b, c);
    if (part.flipped) std::swap(at.x, at.y);  // SurfacePoint counts corners in the world's winding
    const SurfacePoint point{instance, triangle, at};
    if (surface.coverage == 0.0f || !isMask) {
      surface.albedo = glm::clamp(albedoAt(scene, point, width), 0.0f, 1.0f);
      surface.emission = glm::max(emissionAt(scene, point, width), glm::vec3(0.0f));
    }
    if (!isMask) break;
    if (opaqueAt(scene, point)) surface.coverage += 0.25f;
  }
  return surface;
}

}  // namespace

Result<VoxelScene> VoxelScene::create(const Scene& scene, float pieceWidth, Context& context, const SceneBounds* box) {
  VoxelScene made;
  const auto instances = static_cast<std::uint32_t>(scene.instances.size());
  made.pieces_.resize(instances);
  std::vector<std::vector<VoxelSurface>> surfaces(instances);
  std::atomic<std::size_t> total{0};
  parallelChunks(context, "voxel pieces", instances, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<Piece> stack;
    for (std::size_t i = begin; i < end; ++i) {
      const Instance& instance = scene.instances[i];
      const Mesh& mesh = scene.meshes[instance.mesh];
      const SplitWide split{glm::mat3(instance.toWorld), pieceWidth * pieceWidth};
      Pieces& pieces = made.pieces_[i];
      for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
        const glm::uvec3& v = mesh.triangle[t];
        stack.push_back({PieceCorner{mesh.position[v.x], {0, 0}}, PieceCorner{mesh.position[v.y], {1, 0}},
                         PieceCorner{mesh.position[v.z], {0, 1}}});
        while (!stack.empty() && total.load(std::memory_order_relaxed) <= kMaxSnapped) {
          const Piece piece = stack.back();
          stack.pop_back();
          const bool isKept = box != nullptr && isOutside(piece, instance.toWorld, *box, pieceWidth);
          if (!isKept && splitOnce(split, piece, stack)) continue;
          const auto first = static_cast<std::uint32_t>(pieces.position.size());
          for (const PieceCorner& corner : piece) pieces.position.push_back(corner.position);
          pieces.triangle.push_back({first, first + 1, first + 2});
          surfaces[i].push_back(surfaceOf(scene, static_cast<std::uint32_t>(i), t, piece, 0.5f * pieceWidth));
          total.fetch_add(1, std::memory_order_relaxed);
        }
        stack.clear();
      }
    }
  });
  if (context.cancelled()) return Error{ErrorCode::failed, "cancelled"};
  if (total > kMaxSnapped)
    return Error{ErrorCode::failed, "the level makes more than " + std::to_string(kMaxSnapped) + " pieces of " +
                                        std::to_string(pieceWidth) + " m; use fewer cells"};
  for (std::uint32_t i = 0; i < instances; ++i) {
    Pieces& pieces = made.pieces_[i];
    const auto first = static_cast<std::uint32_t>(made.surfaces_.size());
    made.surfaces_.insert(made.surfaces_.end(), surfaces[i].begin(), surfaces[i].end());
    for (std::uint32_t k = 0; k < surfaces[i].size(); ++k) pieces.surface.push_back(first + k);
    made.meshes_.push_back({pieces.position, pieces.triangle, pieces.surface});
    made.parts_.push_back({i, glm::mat4x3(scene.instances[i].toWorld), !scene.instances[i].baked()});
  }
  return made;
}

}  // namespace relume
