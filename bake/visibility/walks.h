// SPDX-License-Identifier: MIT
// Walks through the level from where receivers can be. A walker in the air looks in a random direction. From what it
// hits it goes on in one of two ways: through the air, from a random point between the last one and the hit (a receiver
// may stand there, too), or off the surface in a cosine-weighted direction (light that bounces there reaches the
// receiver). Drawing points on chords spreads the walkers evenly over the connected air (hit-and-run sampling). No
// walker follows a ray that leaves the level: the far side of a roof must not be reached through the sky.
//
// Hits are counted per voxel (seen_voxels.h). All is by number: what an edit does to one walk leaves the random numbers
// of the others as they are.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/visibility/find_starts.h"
#include "bake/visibility/seen_voxels.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kWalkStage = 0x706C6179;  // of the random streams of the first round
inline constexpr std::uint32_t kWalkRounds = 8;          // each with a stage of its own

// Where the walks of a round ended in the air. Walks whose way came to no such end have none, but keep their number: a
// walk that goes another way after an edit leaves all other numbers as they are.
class WalkEnds {
 public:
  // Of so many walks.
  void set(std::vector<glm::vec3> reached, std::span<const std::uint8_t> valid);
  bool empty() const { return count_ == 0; }
  std::uint32_t walks() const { return static_cast<std::uint32_t>(reached_.size()); }
  // That of a walk, or of the next one that has an end.
  const glm::vec3& operator[](std::size_t walk) const { return reached_[next_[walk]]; }
  // At most so many, spread over the walks.
  std::vector<glm::vec3> some(std::size_t most) const;

 private:
  std::vector<glm::vec3> reached_;
  std::vector<std::uint32_t> next_;  // [Size walks] the walk itself, or the next with an end
  std::size_t count_ = 0;            // of walks with an end
};

// What walks found.
struct Walks {
  VoxelGrid grid;
  std::vector<VoxelHits> voxels;                   // sorted by key
  double nearHits = 0.0;                           // all of theirs
  std::map<std::uint32_t, std::uint32_t> farHits;  // by side
  WalkEnds ends;                                   // of the last round
};

// Hits beyond farDistance [m] are far: no walk goes on from there. voxelSize [m]. What was found until then where the
// context is cancelled.
Walks walkThrough(const RayTracer& tracer, const PlaySpaceOptions& options, std::uint64_t seed,
                  const StartSources& sources, float voxelSize, float farDistance, Context& context);

}  // namespace relume
