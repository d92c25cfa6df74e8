// SPDX-License-Identifier: MIT
// What receivers read of two relit bakes: points on all surfaces, through the light map or the grid as each bake says,
// and points in the air, where things that move read the grid. Caches alone do not tell: two bakes can hold the same
// light and hand it to other surfaces.
//
// A receiver is the same point of the same triangle in both bakes; parts answer to each other by name. Without a scene,
// a point's place and normal come from the texels' caches, and surfaces that read the grid are sampled by surfels: by
// A's, or by B's where a part was moved or reshaped. There both grids are read where B has it, as with B's scene.
#pragma once

#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace relume {

// A change beyond all bounds, which still sorts: of light that A lacks, or that overflows.
inline constexpr double kBeyondBounds = 1e9;
inline double bounded(double change) { return change < kBeyondBounds ? change : kBeyondBounds; }  // NaN is beyond, too
inline bool isBeyondBounds(double change) { return change >= kBeyondBounds; }

// The directions that points in the air are read in.
inline constexpr std::array<glm::vec3, 6> kAirDirections = {
    {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};

// How one bake lights a receiver.
struct Reading {
  bool onMap = false;  // by the light map at uv, else by the grid at positionWorld
  glm::vec2 uv{0.0f};
  glm::vec3 positionWorld{0.0f};  // [m]
  glm::vec3 normal{0.0f};         // unit, on the receiver's side
  glm::vec3 planeNormal{0.0f};    // unit, of the triangle; the same as `normal` without a scene
};

struct Receiver {
  std::uint32_t group = 0;  // index into Receivers::groups
  Reading a, b;
};

// The surfaces of one node, or the air.
struct ReceiverGroup {
  std::string node, text;  // A's name of it, which others may have as well, and PartNodes::texts; "" and "the air"
};

struct Receivers {
  std::vector<ReceiverGroup> groups;  // group 0 is the air
  std::vector<Receiver> list;
  std::uint32_t partsMatched = 0;                    // parts with receivers
  std::uint32_t partsOnlyInA = 0, partsOnlyInB = 0;  // no part of that node and mesh in the other bake
  std::uint32_t partsReshaped = 0;                   // other geometry with another number of triangles: not compared
  bool withoutMap = false;  // a bake lacks its light map's coordinates (fit_bake.h): no receivers on parts, only at
                            // surfels and in the air, which read the grid
  bool unmatched = false;   // fewer than half of A's parts can be compared: gone, reshaped, or not in the scene
  static constexpr std::uint32_t kAir = 0;
};

// Some 32,768 receivers on surfaces, evenly by area but a few on every part, and at each of at most 4,096 grid caches
// of either bake six in the air. `scene` null: see above; else it is the scene of both bakes, as loadScene() gives it.
// A function of its arguments alone.
Receivers placeReceivers(const Bake& a, const Bake& b, const Scene* scene);

// One lighting, over the receivers of one group. E is the irradiance a receiver reads.
struct GroupChange {
  std::uint32_t group = 0, receivers = 0;
  double change = 0.0;  // rms |E_B - E_A| / (rms |E_A| + floor); floor: a twentieth of the mean |E| over all receivers
                        // that count, of the brighter bake
};

struct ReceiverLighting {
  double surfaces = 0.0, air = 0.0;  // the same over all receivers on surfaces, and over all in the air
  std::vector<GroupChange> groups;   // [Size Receivers::groups] in their order; no receivers = 0
};

// Both relighters have converged under the same lighting. `ignored` groups are left out of all sums.
// [Size ignored == groups]
ReceiverLighting compareReceivers(const Receivers& receivers, const std::vector<bool>& ignored, const Relighter& a,
                                  const Relighter& b);

}  // namespace relume
