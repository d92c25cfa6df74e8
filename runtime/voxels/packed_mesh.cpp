// SPDX-License-Identifier: MIT
// See packed_mesh.h.
#include "runtime/voxels/packed_mesh.h"

#include "runtime/shared/chunks.h"

#include <glm/common.hpp>

#include <algorithm>
#include <bit>
#include <cstring>

namespace relume {
namespace {

// The vertices of a run, each once: a table of hashes as large as a byte counts.
class RunVertices {
 public:
  void clear() { slot_.fill(kEmpty); }

  // The vertex's number in its run, which is appended where the run has none of its bits.
  std::uint8_t numberOf(const glm::vec3& vertex, std::size_t first, std::vector<glm::vec3>& vertices) {
    std::uint32_t bits[3];
    std::memcpy(bits, &vertex, sizeof(bits));
    std::uint32_t hash =
        bits[0] * 2654435769u ^ std::rotl(bits[1] * 2246822519u, 11) ^ std::rotl(bits[2] * 3266489917u, 22);
    hash ^= hash >> 16;
    for (auto at = static_cast<std::uint8_t>(hash ^ hash >> 8);; ++at) {
      std::uint8_t& slot = slot_[at];
      if (slot == kEmpty) {
        slot = static_cast<std::uint8_t>(vertices.size() - first);
        vertices.push_back(vertex);
        return slot;
      }
      if (std::memcmp(&vertices[first + slot], &vertex, sizeof(vertex)) == 0) return slot;
    }
  }

 private:
  static constexpr std::uint8_t kEmpty = 255;
  static_assert(3 * kTrianglesOfRun < kEmpty);
  std::array<std::uint8_t, 256> slot_{};
};

bool isSame(const VoxelSurface& a, const VoxelSurface& b) {
  return a.albedo == b.albedo && a.emission == b.emission && a.doubleSided == b.doubleSided;
}

// `surface`: of each run's surfaces, a number among those that the host has handed over.
PackedMesh pack(const VoxelMesh& mesh, std::span<const VoxelSurface> surfaces, std::vector<std::uint32_t>& surface) {
  PackedMesh packed;
  packed.triangle.reserve(mesh.triangle.size());
  RunVertices vertices;
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    const VoxelSurface& own = surfaces[mesh.surface[t]];
    if (!isThere(own.coverage, t)) continue;
    const glm::uvec3& index = mesh.triangle[t];
    if (packed.triangle.size() % kTrianglesOfRun == 0) {
      const glm::vec3& first = mesh.position[index.x];
      packed.run.push_back(
          {first, first, static_cast<std::uint32_t>(packed.vertex.size()), static_cast<std::uint32_t>(surface.size())});
      vertices.clear();
    }
    TriangleRun& run = packed.run.back();
    auto& triangle = packed.triangle.emplace_back();
    for (int c = 0; c < 3; ++c) {
      const glm::vec3& p = mesh.position[index[c]];
      run.min = glm::min(run.min, p);
      run.max = glm::max(run.max, p);
      triangle[static_cast<std::size_t>(c)] = vertices.numberOf(p, run.firstVertex, packed.vertex);
    }
    // Neighbours are alike: the latest first
    std::size_t at = surface.size();
    while (at > run.firstSurface && !isSame(surfaces[surface[at - 1]], own)) --at;
    if (at == run.firstSurface) {
      surface.push_back(mesh.surface[t]);
      at = surface.size();
    }
    triangle[3] = static_cast<std::uint8_t>(at - 1 - run.firstSurface);
  }
  packed.triangle.shrink_to_fit();
  packed.vertex.shrink_to_fit();
  packed.run.shrink_to_fit();
  return packed;
}

}  // namespace

std::size_t PackedMesh::bytes() const {
  return run.size() * sizeof(run[0]) + vertex.size() * sizeof(vertex[0]) + triangle.size() * sizeof(triangle[0]);
}

bool isThere(float coverage, std::uint32_t triangle) {
  if (coverage >= 1.0f) return true;
  std::uint32_t hash = triangle * 2654435769u;
  hash ^= hash >> 15;
  hash *= 2246822519u;
  hash ^= hash >> 13;
  return static_cast<float>(hash >> 8) < coverage * 0x1p+24f;
}

PackedGeometry packGeometry(const VoxelGeometry& geometry, const ParallelFor& parallelFor) {
  PackedGeometry packed;
  packed.mesh.resize(geometry.meshes.size());
  std::vector<std::vector<std::uint32_t>> surface(geometry.meshes.size());
  forChunks(parallelFor, static_cast<std::uint32_t>(packed.mesh.size()), 1,
            [&](std::uint32_t first, std::uint32_t last) {
              for (std::uint32_t m = first; m < last; ++m)
                packed.mesh[m] = pack(geometry.meshes[m], geometry.surfaces, surface[m]);
            });
  std::size_t count = 0;
  for (const std::vector<std::uint32_t>& each : surface) count += each.size();
  packed.surfaces.reserve(count);
  for (std::size_t m = 0; m < packed.mesh.size(); ++m) {
    for (TriangleRun& run : packed.mesh[m].run) run.firstSurface += packed.surfaces.size();
    for (const std::uint32_t s : surface[m]) packed.surfaces.add(geometry.surfaces[s]);
  }
  return packed;
}

bool snapRuns(const VolumeGrid& grid, const SnapBox& box, const PackedMesh& mesh, const glm::mat4x3& toWorld,
              std::uint32_t begin, std::uint32_t end, std::vector<SnappedTriangle>& snapped, SnapCounts& counts) {
  const RunsOutside isOutside(grid, box, toWorld);
  TriangleSnapper snapper(grid, box, toWorld);
  std::array<glm::ivec3, 3 * kTrianglesOfRun> steps;
  for (std::uint32_t r = begin; r < end; ++r) {
    const TriangleRun& run = mesh.run[r];
    const std::uint32_t count = mesh.trianglesOf(r);
    if (isOutside(run)) {
      counts.outside += count;
      continue;
    }
    const std::size_t last = r + 1 < mesh.run.size() ? mesh.run[r + 1].firstVertex : mesh.vertex.size();
    for (std::size_t v = run.firstVertex; v < last; ++v) steps[v - run.firstVertex] = snapper.stepsOf(mesh.vertex[v]);
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto& t = mesh.triangle[std::size_t{r} * kTrianglesOfRun + i];
      if (!snapper.add({steps[t[0]], steps[t[1]], steps[t[2]]}, run.firstSurface + t[3], snapped, counts)) return false;
    }
  }
  return true;
}

}  // namespace relume
