// SPDX-License-Identifier: MIT
// Cuts a mesh into regions of faces that look one way, as a first step toward charts. Works on any triangle soup: two
// faces are neighbours when they share an edge by position, whatever the index buffer says, and an edge may have any
// number of faces.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/scene.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Faces of a mesh with their neighbours. Faces without area have a zero normal and no neighbours.
struct FaceGraph {
  std::vector<glm::uvec3> vertex;    // [Size faces] welded by exact position
  std::vector<glm::vec3> normal;     // [Size faces] unit, by winding
  std::vector<float> area;           // [object units²] [Size faces]
  std::vector<std::uint32_t> begin;  // [Size faces + 1] neighbours of f: neighbor[begin[f]] .. neighbor[begin[f+1]-1]
  std::vector<std::uint32_t> neighbor;
  std::vector<float> edgeLength;  // [object units] of the edge to that neighbour

  bool degenerate(std::uint32_t face) const { return !(area[face] > 0.0f); }
};

FaceGraph buildFaceGraph(const Mesh& mesh);

struct RegionLimits {
  float cosMean = 0.64f;    // a face's normal against the region's mean (50 degrees)
  float cosSeed = 0.42f;    // against the face the region grew from (65 degrees): the mean may drift
  float cosCrease = 0.64f;  // against the neighbour it is reached through (50 degrees)
  float cosMerge = 0.42f;   // faces of a small region that joins a larger one, against the joint mean (65 degrees)
};

// Regions of connected faces, largest seed first, each grown toward the face that agrees best with its mean normal;
// then small regions join the neighbour they share the longest border with, where normals allow. A region lists its
// faces in the order they were added. Deterministic: ties break by face index.
// Incomplete when cancelled.
std::vector<std::vector<std::uint32_t>> growRegions(const FaceGraph& graph, const RegionLimits& limits,
                                                    const Context& context);

// The connected pieces of a set of faces, each in the order of `faces`.
std::vector<std::vector<std::uint32_t>> connectedPieces(const FaceGraph& graph, std::span<const std::uint32_t> faces);

}  // namespace relume
