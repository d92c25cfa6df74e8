// SPDX-License-Identifier: MIT
// The clustering stage (PIC 4.3): splits the senders into groups that no cluster may mix, clusters each, and lays the
// whole out for the runtime.
//
// Deviation: PIC has one tree over all surfels. Emitters get a subtree of their own, so that a cut never averages a
// lamp with the wall around it. So do the sky patches, which have no position in space. And the metric takes into
// account what surfels see (metric.h).
#include "bake/hierarchy/flatten.h"
#include "bake/hierarchy/hierarchy.h"
#include "bake/hierarchy/visible_centroid.h"
#include "formats/sphere_points.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace relume {
namespace {

constexpr std::uint32_t kMaxSkyPatches = 4096;
constexpr std::uint32_t kMaxSenders = 1u << 30;

// Centres of equal solid angles, from the zenith down.
std::vector<glm::vec3> skyDirections(std::uint32_t count) {
  std::vector<glm::vec3> directions(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::vec3 p = spherePoint(i, count);
    directions[i] = {p.x, p.z, p.y};
  }
  return directions;
}

// The tree over the sky: clusters of neighbouring directions, by the same metric over points of the unit sphere.
Result<ClusterTree> clusterSky(const std::vector<glm::vec3>& directions, const ClusteringOptions& options,
                               Context& context) {
  Surfels points;
  points.positionWorld = directions;
  points.normal = std::vector<glm::vec3>(directions.size(), glm::vec3(0, 1, 0));
  std::vector<std::uint32_t> members(directions.size());
  for (std::uint32_t i = 0; i < members.size(); ++i) members[i] = i;
  return agglomerate(points, members, options, context);
}

Result<ClusterTree> clusterMembers(const Surfels& surfels, std::span<const std::uint32_t> members,
                                   const ClusteringOptions& options, Context& context,
                                   std::span<const glm::vec3> centroids) {
  return options.method == ClusteringOptions::Method::exact
             ? agglomerate(surfels, members, options, context, centroids)
             : agglomerateByCells(surfels, members, options, context, centroids);
}

}  // namespace

Result<Hierarchy> clusterSurfels(const Surfels& surfels, std::uint32_t skyPatches, const ClusteringOptions& options,
                                 Context& context, std::span<const glm::vec3> centroids) {
  if (skyPatches > kMaxSkyPatches) {
    return Error{ErrorCode::usage, "sky patches must be in [0, 4096], found " + std::to_string(skyPatches)};
  }
  if (surfels.count() == 0) return Error{ErrorCode::failed, "clustering needs at least one surfel, found none"};
  if (surfels.count() > kMaxSenders) {
    return Error{ErrorCode::usage, "clustering takes at most 2^30 surfels, found " + std::to_string(surfels.count())};
  }

  // Reflectors and emitters.
  std::vector<ClusterGroup> groups(2);
  for (std::uint32_t i = 0; i < surfels.count(); ++i) {
    const glm::vec3& e = surfels.emission[i];
    groups[e.x > 0.0f || e.y > 0.0f || e.z > 0.0f ? 1 : 0].sender.push_back(i);
  }
  std::erase_if(groups, [](const ClusterGroup& group) { return group.sender.empty(); });
  for (ClusterGroup& group : groups) {
    Result<ClusterTree> tree = clusterMembers(surfels, group.sender, options, context, centroids);
    if (!tree) return tree.error();
    group.tree = std::move(*tree);
  }

  // Sky patches come after all surfels.
  const std::vector<glm::vec3> directions = skyDirections(skyPatches);
  if (!directions.empty()) {
    Result<ClusterTree> tree = clusterSky(directions, options, context);
    if (!tree) return tree.error();
    ClusterGroup& sky = groups.emplace_back();
    sky.tree = std::move(*tree);
    for (std::uint32_t i = 0; i < skyPatches; ++i) sky.sender.push_back(surfels.count() + i);
  }

  Hierarchy hierarchy = flatten(groups);
  hierarchy.skyDirection = directions;
  context.figure("senders", hierarchy.senderCount());
  context.figure("groups", static_cast<double>(hierarchy.groupRoot.size()));
  context.figure("depth", hierarchy.levelCount());
  return hierarchy;
}

Result<Hierarchy> clusterSurfels(const RayTracer& tracer, const Surfels& surfels, std::uint32_t skyPatches,
                                 const ClusteringOptions& options, Context& context) {
  std::vector<glm::vec3> centroids;
  if (options.outlookWeight > 0.0f && surfels.count() > 0) {
    centroids = visibleCentroids(tracer, surfels, context);
    if (context.cancelled()) return cancelledError();
  }
  return clusterSurfels(surfels, skyPatches, options, context, centroids);
}

}  // namespace relume
