// SPDX-License-Identifier: MIT
// See packed_mesh.h.
#include "runtime/voxels/packed_mesh.h"

#include "runtime/shared/chunks.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <span>

namespace relume {
namespace {

// The vertices of a run, each once, by a table of hashes of which a quarter at least stays empty.
class RunVertices {
 public:
  void clear() { slot_.fill(kEmpty); }

  // The vertex's number in its run, which is appended where the run has none of its bits.
  std::uint16_t numberOf(const glm::vec3& vertex, std::vector<glm::vec3>& vertices) {
    using Bits = std::array<std::uint32_t, 3>;
    const auto bits = std::bit_cast<Bits>(vertex);
    std::uint32_t hash =
        bits[0] * 2654435769u ^ std::rotl(bits[1] * 2246822519u, 11) ^ std::rotl(bits[2] * 3266489917u, 22);
    hash ^= hash >> 16;
    for (std::uint32_t at = hash ^ hash >> 8;; ++at) {
      std::uint16_t& slot = slot_[at % kSlots];
      if (slot == kEmpty) {
        slot = static_cast<std::uint16_t>(vertices.size());
        vertices.push_back(vertex);
        return slot;
      }
      if (std::bit_cast<Bits>(vertices[slot]) == bits) return slot;
    }
  }

 private:
  static constexpr std::uint16_t kEmpty = 0xFFFF;
  static constexpr std::uint32_t kSlots = 4 * kTrianglesOfRun;
  static_assert(std::has_single_bit(kSlots) && 3 * kTrianglesOfRun < kEmpty);
  std::array<std::uint16_t, kSlots> slot_{};
};

bool isSame(const VoxelSurface& a, const VoxelSurface& b) {
  return a.albedo == b.albedo && a.emission == b.emission && a.doubleSided == b.doubleSided;
}

constexpr std::uint32_t kCountBits = 11, kWidthBits = 6;
constexpr std::size_t kSurfacesCompared = 32;  // with each triangle's
static_assert(3 * kTrianglesOfRun < 1u << kCountBits);

// Zero has one sign, so that equal vertices are of the same bits.
glm::vec3 withoutSignOfZero(const glm::vec3& v) { return v + 0.0f; }

struct RunSurface {
  std::uint32_t number = 0;  // among those that the host has handed over
  bool isOfOne = false;      // each triangle of the run has its own
};

// A mesh run by run.
class MeshPacker {
 public:
  // `surface`: of each run its surfaces
  MeshPacker(std::span<const VoxelSurface> surfaces, std::vector<RunSurface>& surface)
      : surfaces_(surfaces), surface_(surface) {}

  PackedMesh pack(const VoxelMesh& mesh) {
    PackedMesh packed;
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      if (!isThere(surfaces_[mesh.surface[t]].coverage, t)) continue;
      const glm::uvec3& index = mesh.triangle[t];
      pieces_.add({withoutSignOfZero(mesh.position[index.x]), withoutSignOfZero(mesh.position[index.y]),
                   withoutSignOfZero(mesh.position[index.z])});
      own_.push_back(mesh.surface[t]);
      if (own_.size() == kTrianglesOfRun) addRun(packed);
    }
    if (!own_.empty()) addRun(packed);
    packed.run.shrink_to_fit();
    packed.bits.shrinkToFit();
    return packed;
  }

 private:
  void addRun(PackedMesh& packed) {
    TriangleRun& run = packed.run.emplace_back();
    packed.bits.alignToByte();
    run.firstByte = static_cast<std::uint32_t>(packed.bits.size() / 8);
    run.firstSurface = static_cast<std::uint32_t>(surface_.size());
    RunHead head;
    findSurfaces(head);
    findVertices(run, head);
    head.trees = static_cast<std::uint32_t>(pieces_.trees().size());
    head.isCut = head.trees < own_.size();
    head.add(packed.bits);
    for (const glm::vec3& v : vertex_) {
      for (int k = 0; k < 3; ++k)
        packed.bits.add(orderedBits(v[k]) - orderedBits(run.min[k]), head.coordinate[static_cast<std::size_t>(k)]);
    }
    if (head.surface > 0) {
      for (const std::uint16_t s : surfaceOf_) packed.bits.add(s, head.surface);
    }
    addTrees(head, packed.bits);
    packed.triangles += own_.size();
    own_.clear();
    pieces_.clear();
  }

  void addTrees(const RunHead& head, PackedBits& to) const {
    std::uint32_t seen = 0;  // vertices
    for (std::size_t t = 0; t < head.trees; ++t) {
      for (std::size_t c = 3 * t; c < 3 * t + 3; ++c) {
        to.add(corner_[c], cornerBits(seen));
        if (corner_[c] == seen) ++seen;
      }
      if (!head.isCut) continue;
      const bool isLast = t + 1 == head.trees;
      const std::size_t end = isLast ? pieces_.cuts().size() : pieces_.trees()[t + 1].firstCut;
      for (std::size_t i = pieces_.trees()[t].firstCut; i < end; ++i) to.add(pieces_.cuts()[i], kCutBits);
    }
  }

  // The run's surfaces, each once or nearly so; or that of each triangle, where most have their own.
  void findSurfaces(RunHead& head) {
    const std::size_t first = surface_.size();
    surfaceOf_.clear();
    for (const std::uint32_t s : own_) {
      // Neighbours are alike: the latest ones, the last of them first
      std::size_t at = surface_.size();
      const std::size_t end = std::max(first, at - std::min(at, kSurfacesCompared));
      while (at > end && !isSame(surfaces_[surface_[at - 1].number], surfaces_[s])) --at;
      if (at == end) {
        surface_.push_back({s, false});
        at = surface_.size();
      }
      surfaceOf_.push_back(static_cast<std::uint16_t>(at - 1 - first));
    }
    const std::size_t once = surface_.size() - first;
    if (8 * once > 7 * own_.size()) {
      surface_.resize(first);
      for (const std::uint32_t s : own_) surface_.push_back({s, true});
    } else {
      head.surface = std::max(1u, static_cast<std::uint32_t>(std::bit_width(once - 1)));
    }
  }

  void findVertices(TriangleRun& run, RunHead& head) {
    vertex_.clear();
    corner_.clear();
    table_.clear();
    run.min = run.max = pieces_.trees().front().corner[0];
    for (const PieceTrees::Tree& tree : pieces_.trees()) {
      for (const glm::vec3& p : tree.corner) {
        run.min = glm::min(run.min, p);
        run.max = glm::max(run.max, p);
        corner_.push_back(table_.numberOf(p, vertex_));
      }
    }
    head.vertices = static_cast<std::uint32_t>(vertex_.size());
    for (int k = 0; k < 3; ++k)
      head.coordinate[static_cast<std::size_t>(k)] =
          static_cast<std::uint32_t>(std::bit_width(orderedBits(run.max[k]) - orderedBits(run.min[k])));
  }

  std::span<const VoxelSurface> surfaces_;
  std::vector<RunSurface>& surface_;
  RunVertices table_;
  PieceTrees pieces_;
  std::vector<std::uint32_t> own_;  // of each triangle
  std::vector<glm::vec3> vertex_;
  std::vector<std::uint16_t> corner_, surfaceOf_;
};

struct PlacedVertex {
  glm::vec3 position{0.0f};
  glm::ivec3 steps{0};
};

}  // namespace

RunHead RunHead::read(PackedBitsReader& from) {
  const auto next = [&](std::uint32_t width) { return static_cast<std::uint32_t>(from.next(width)); };
  RunHead head;
  head.vertices = next(kCountBits);
  head.trees = next(kCountBits);
  for (std::uint32_t& each : head.coordinate) each = next(kWidthBits);
  head.surface = next(kWidthBits);
  head.isCut = next(1) != 0;
  return head;
}

void RunHead::add(PackedBits& to) const {
  to.add(vertices, kCountBits);
  to.add(trees, kCountBits);
  for (const std::uint32_t each : coordinate) to.add(each, kWidthBits);
  to.add(surface, kWidthBits);
  to.add(isCut ? 1 : 0, 1);
}

std::uint32_t orderedBits(float v) {
  const auto bits = std::bit_cast<std::uint32_t>(v);
  return (bits >> 31) != 0 ? ~bits : bits | 0x80000000u;
}

float fromOrderedBits(std::uint32_t bits) {
  return std::bit_cast<float>((bits >> 31) != 0 ? bits & 0x7FFFFFFFu : ~bits);
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
  std::vector<std::vector<RunSurface>> surface(geometry.meshes.size());
  forChunks(parallelFor, static_cast<std::uint32_t>(packed.mesh.size()), 1,
            [&](std::uint32_t first, std::uint32_t last) {
              for (std::uint32_t m = first; m < last; ++m)
                packed.mesh[m] = MeshPacker(geometry.surfaces, surface[m]).pack(geometry.meshes[m]);
            });
  for (std::size_t m = 0; m < packed.mesh.size(); ++m) {
    for (TriangleRun& run : packed.mesh[m].run) run.firstSurface += packed.surfaces.size();
    for (const RunSurface& each : surface[m]) packed.surfaces.add(geometry.surfaces[each.number], each.isOfOne);
  }
  return packed;
}

bool snapRuns(const VolumeGrid& grid, const SnapBox& box, const PackedMesh& mesh, const glm::mat4x3& toWorld,
              std::uint32_t begin, std::uint32_t end, std::vector<SnappedTriangle>& snapped, SnapCounts& counts) {
  const RunsOutside isOutside(grid, box, toWorld);
  TriangleSnapper snapper(grid, box, toWorld);
  const auto placed = [&](const glm::vec3& position) { return PlacedVertex{position, snapper.stepsOf(position)}; };
  RunReader<PlacedVertex, decltype(placed)> reader(mesh, placed);
  for (std::uint32_t r = begin; r < end; ++r) {
    if (isOutside(mesh.run[r])) {
      counts.outside += mesh.trianglesOf(r);
      continue;
    }
    const bool fits = reader.visit(r, [&](const std::array<PlacedVertex, 3>& t, std::uint32_t surface) {
      return snapper.add({t[0].steps, t[1].steps, t[2].steps}, surface, snapped, counts);
    });
    if (!fits) return false;
  }
  return true;
}

}  // namespace relume
