// SPDX-License-Identifier: MIT
// See surfel_voxels.h.
#include "runtime/cones/surfel_voxels.h"

#include "runtime/shared/chunks.h"

#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <new>
#include <numbers>

namespace relume {
namespace {

constexpr std::uint32_t kBakeSides = 256;  // of a chunk
constexpr float kLeastCosine = 0.3f;       // of a surfel that counts for a side
constexpr std::uint32_t kNowhere = 0xFFFFFFFFu;

Error noMemoryForBake() { return {ErrorCode::memory, "voxels lit by a bake: memory ran out; fewer cells take less"}; }

// A surface on a standing side.
struct Placed {
  std::uint32_t side = kNowhere;
  float weight = 0.0f;  // the cosine between the two
};

// The standing side that a surface at a place [voxels] with a unit normal belongs to. Voxels are thin: a surface that
// passes through the edge of one may be in the next along the normal's longest axis alone.
Placed sideAround(const VoxelVolume& volume, const glm::vec3& place, const glm::vec3& normal) {
  const VoxelLayer& layer = volume.standing();
  const glm::vec3 end(volume.grid().voxels());
  if (!glm::all(glm::greaterThanEqual(place, glm::vec3(-1.0f))) || !glm::all(glm::lessThan(place, end + 1.0f)))
    return {};
  const glm::vec3 size = glm::abs(normal);
  const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
  const glm::ivec3 here(glm::floor(place));
  glm::ivec3 beside(0);
  beside[axis] = place[axis] - static_cast<float>(here[axis]) < 0.5f ? -1 : 1;
  for (const glm::ivec3& v : {here, here + beside, here - beside}) {
    if (!volume.grid().holds(v) || !layer.has(volume.grid(), v)) continue;
    const std::uint32_t number = layer.numberOf(volume.grid(), v);
    if (number >= layer.kept) continue;
    const float cosine = glm::dot(glm::vec3(layer.axis[number]), normal) / 127.0f;
    return {2 * number + (cosine >= 0.0f ? 0 : 1), std::abs(cosine)};
  }
  return {};
}

}  // namespace

Result<SurfelVoxels> SurfelVoxels::create(const VoxelVolume& volume, const Bake& bake) {
  try {
    SurfelVoxels lit;
    const std::uint32_t count = bake.surfels.count(), sides = volume.standingSides();
    std::vector<Placed> placed(count);
    forChunks(volume.parallelFor(), count, kBakeSides, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t s = begin; s < end; ++s)
        placed[s] = sideAround(volume, volume.grid().toGrid(bake.surfels.positionWorld[s]), bake.surfels.normal[s]);
    });
    lit.first_.assign(sides + 1, 0);
    // What stands across tells nothing of a side: bars of a window in the sun are dark from inside.
    const auto counts = [](const Placed& p) { return p.side != kNowhere && p.weight >= kLeastCosine; };
    for (const Placed& p : placed) {
      if (counts(p)) ++lit.first_[p.side + 1];
    }
    for (std::uint32_t s = 0; s < sides; ++s) lit.first_[s + 1] += lit.first_[s];
    lit.sender_.resize(lit.first_[sides]);
    std::vector<std::uint32_t> next(lit.first_.begin(), lit.first_.end() - 1);
    for (std::uint32_t s = 0; s < count; ++s) {
      if (counts(placed[s])) lit.sender_[next[placed[s].side]++] = {bake.hierarchy.leafNode[s], placed[s].weight};
    }
    std::uint32_t with = 0, all = 0;
    volume.forSides(0, sides, [&](const SideAt& at) {
      if (!at.side.isFaced) return;
      ++all;
      if (lit.first_[at.index + 1] > lit.first_[at.index]) ++with;
    });
    lit.covered_ = all > 0 ? static_cast<float>(with) / static_cast<float>(all) : 0.0f;
    lit.standingVersion_ = volume.standingVersion();
    return lit;
  } catch (const std::bad_alloc&) {
    return noMemoryForBake();
  }
}

Status SurfelVoxels::checkVolume(const VoxelVolume& volume) const {
  if (standingVersion_ != volume.standingVersion())
    return Error{ErrorCode::usage, "voxels lit by a bake: the volume has been edited; make them anew"};
  return done();
}

Status SurfelVoxels::light(VoxelVolume& volume, const Relighter& relighter, const glm::vec3& emissionScale) {
  if (Status ok = checkVolume(volume); !ok) return ok;
  try {
    // What the grid has at sides without surfels. With OpenGL the first look-up reads the caches back: by this thread.
    static_cast<void>(relighter.irradianceInGrid(glm::vec3(0.0f), glm::vec3(0.0f, 1.0f, 0.0f)));
    const auto hasSurfels = [&](std::uint32_t s) { return s < volume.standingSides() && first_[s + 1] > first_[s]; };
    const auto bounced = [&](const SideAt& at) {
      if (hasSurfels(at.index)) return glm::vec3(0.0f);
      return relighter.irradianceInGrid(volume.positionOf(at), at.side.normal);
    };
    volume.reflect(bounced, emissionScale);
    // The mean of the surfels, which are all of one size, by how squarely they face the side
    const std::vector<glm::vec3> radiosity = relighter.nodeRadiosity();
    forChunks(volume.parallelFor(), volume.standingSides(), kBakeSides, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t s = begin; s < end; ++s) {
        if (!hasSurfels(s)) continue;
        glm::vec3 sum(0.0f);
        float weights = 0.0f;
        for (std::uint32_t i = first_[s]; i < first_[s + 1]; ++i) {
          sum += sender_[i].weight * radiosity[sender_[i].node];
          weights += sender_[i].weight;
        }
        volume.setRadiance(s, std::numbers::inv_pi_v<float> / weights * sum);
      }
    });
  } catch (const std::bad_alloc&) {
    return noMemoryForBake();
  }
  return done();
}

}  // namespace relume
