// SPDX-License-Identifier: MIT
// Clusters the senders into a binary tree (PIC 4.3).
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/hierarchy.h"
#include "relume/result.h"
#include "relume/surfels.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// A binary tree as clustering makes it: leaves 0..n-1 are senders, inner node n+k is the k-th merge.
struct ClusterTree {
  std::uint32_t leafCount = 0;
  std::vector<std::uint32_t> first, second;  // [Size n-1] children of inner node n+k; the last one is the root
};

// The geometry of a node, which the baker needs in addition to what the file's Hierarchy says.
struct NodeGeometry {
  std::vector<glm::vec3> center;  // [m] [Size nodes] mean of the leaves; sky: mean of the unit directions
  std::vector<glm::vec3> normal;  // unit mean normal (zero for sky, and where the leaves' normals cancel)
  std::vector<float> area;        // [m²] sum of leaf areas; sky patches have none
  std::vector<float> radius;      // [m] RMS distance of the leaves from the center, 0 for a leaf; sky: of the unit
                                  // directions; infinite for joins with the sky
};

// Exact agglomerative clustering of the surfels in `members` with the metric of PIC 4.3 (bounded nearest-neighbour
// search). Leaf i is surfel members[i]. centroids: as visibleCentroids() has it [Size 0 or n_S]; empty = none, the
// paper's metric. usage: weights out of range; failed: no members, cancelled.
Result<ClusterTree> agglomerate(const Surfels& surfels, std::span<const std::uint32_t> members,
                                const ClusteringOptions& options, Context& context,
                                std::span<const glm::vec3> centroids = {});
// Nearly the same tree, by all threads (agglomerate_by_cells.cpp). Takes and fails as agglomerate() does.
Result<ClusterTree> agglomerateByCells(const Surfels& surfels, std::span<const std::uint32_t> members,
                                       const ClusteringOptions& options, Context& context,
                                       std::span<const glm::vec3> centroids = {});

// The whole stage: groups (reflectors; emitters, those with emission > 0; sky patches), a tree for each, flattened
// breadth first. firstWeight is the paper's equal areas (the share of the leaves); traceLinks() may replace it.
// skyPatches [0..4096], centroids as in agglomerate(). usage: options out of range; failed: no surfels, cancelled.
Result<Hierarchy> clusterSurfels(const Surfels& surfels, std::uint32_t skyPatches, const ClusteringOptions& options,
                                 Context& context, std::span<const glm::vec3> centroids = {});
// The same with the visible centroids that the options ask for.
Result<Hierarchy> clusterSurfels(const RayTracer& tracer, const Surfels& surfels, std::uint32_t skyPatches,
                                 const ClusteringOptions& options, Context& context);

NodeGeometry nodeGeometry(const Hierarchy& hierarchy, const Surfels& surfels);

}  // namespace relume
