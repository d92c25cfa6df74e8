// SPDX-License-Identifier: MIT
// Meshes as a volume keeps them, to find voxels anew when parts or the volume move: in runs of 512 triangles, of which
// those that were cut from one are kept as that one and its cuts (piece_trees.h), with each vertex once. Places are not
// rounded.
#pragma once

#include "relume/relighter.h"
#include "relume/voxel_geometry.h"
#include "runtime/voxels/packed_bits.h"
#include "runtime/voxels/piece_trees.h"
#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/split_edges.h"
#include "runtime/voxels/summed_surfaces.h"
#include "runtime/voxels/triangle_runs.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace relume {

// The triangles of a mesh that are there.
struct PackedMesh {
  std::vector<TriangleRun> run;  // of kTrianglesOfRun triangles each but the last
  // Of each run its head; vertices, each coordinate from the run's least on; surfaces of its triangles, unless each has
  // the next one; of each tree its corners, and its cuts where the run has any. Vertices are in the order in which
  // corners have them first: a corner's number is at most how many there were before it.
  PackedBits bits;
  std::size_t triangles = 0;

  std::uint32_t trianglesOf(std::size_t r) const {
    return static_cast<std::uint32_t>(std::min<std::size_t>(kTrianglesOfRun, triangles - r * kTrianglesOfRun));
  }
  std::size_t bytes() const { return run.size() * sizeof(run[0]) + bits.bytes(); }
};

struct PackedGeometry {
  std::vector<PackedMesh> mesh;
  SummedSurfaces surfaces;  // of the runs of all meshes
};

// What comes first of a run: how many there are of its vertices and trees, and how many bits each number takes.
struct RunHead {
  std::uint32_t vertices = 0, trees = 0;
  std::array<std::uint32_t, 3> coordinate{};  // [0..32 bits]
  std::uint32_t surface = 0;                  // [0..9 bits] 0 = each triangle has the next one
  bool isCut = false;                         // any of them

  static RunHead read(PackedBitsReader& from);
  void add(PackedBits& to) const;
};

inline std::uint32_t cornerBits(std::uint32_t verticesBefore) {
  return static_cast<std::uint32_t>(std::bit_width(verticesBefore));
}

// Floats as integers in the same order.
std::uint32_t orderedBits(float v);
float fromOrderedBits(std::uint32_t bits);

// Triangles of runs, as they were handed over. Corner has a `position`; make() is of a vertex.
template <class Corner, class Make>
class RunReader {
 public:
  RunReader(const PackedMesh& mesh, Make make) : mesh_(mesh), make_(std::move(make)) {}

  // visit(corners, surface) of each triangle in its order, until one returns false; returns whether none did.
  template <class Visit>
  bool visit(std::size_t r, const Visit& visit) {
    const TriangleRun& run = mesh_.run[r];
    PackedBitsReader from(mesh_.bits, std::size_t{8} * run.firstByte);
    const RunHead head = RunHead::read(from);
    vertex_.clear();
    for (std::uint32_t v = 0; v < head.vertices; ++v) {
      glm::vec3 position;
      for (int k = 0; k < 3; ++k)
        position[k] =
            fromOrderedBits(orderedBits(run.min[k]) +
                            static_cast<std::uint32_t>(from.next(head.coordinate[static_cast<std::size_t>(k)])));
      vertex_.push_back(make_(position));
    }
    PackedBitsReader surfaces = from,
                     trees(mesh_.bits, from.place() + std::size_t{mesh_.trianglesOf(r)} * head.surface);
    std::uint32_t triangle = 0, seen = 0;  // of vertices
    for (std::uint32_t t = 0; t < head.trees; ++t) {
      std::array<Corner, 3> corner;
      for (Corner& each : corner) {
        const auto v = static_cast<std::uint32_t>(trees.next(cornerBits(seen)));
        each = vertex_[v];
        if (v == seen) ++seen;
      }
      stack_.assign(1, corner);
      while (!stack_.empty()) {
        const std::array<Corner, 3> now = stack_.back();
        stack_.pop_back();
        const auto cut = head.isCut ? static_cast<std::uint32_t>(trees.next(kCutBits)) : 0u;
        if (cut != 0) {
          splitLong(*this, longEdges(cut), now, stack_);
          continue;
        }
        const auto surface = head.surface > 0 ? static_cast<std::uint32_t>(surfaces.next(head.surface)) : triangle;
        if (!visit(now, run.firstSurface + surface)) return false;
        ++triangle;
      }
    }
    return true;
  }

  Corner middle(const Corner& a, const Corner& b) const {
    return make_(MiddleOfPlaces().middle(a.position, b.position));
  }

 private:
  const PackedMesh& mesh_;
  Make make_;
  std::vector<Corner> vertex_;
  std::vector<std::array<Corner, 3>> stack_;
};

// Whether a triangle of a surface with this coverage is there, by a hash of its number: the same ones each time. [0..1]
bool isThere(float coverage, std::uint32_t triangle);

// geometry: checkGeometry()
PackedGeometry packGeometry(const VoxelGeometry& geometry, const ParallelFor& parallelFor);

// snapTriangles() of runs [begin, end); surfaces are those of the packed geometry. Runs of which RunsOutside says that
// nothing is in the box count as outside.
bool snapRuns(const VolumeGrid& grid, const SnapBox& box, const PackedMesh& mesh, const glm::mat4x3& toWorld,
              std::uint32_t begin, std::uint32_t end, std::vector<SnappedTriangle>& snapped, SnapCounts& counts);

}  // namespace relume
