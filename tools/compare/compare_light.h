// SPDX-License-Identifier: MIT
// What the difference of two bakes means for light: both are relit to convergence under one fixed set of lightings, and
// caches that stand at the same place are held against each other.
//
// Punctual lights cast no shadow: direct light reaches every surfel that faces it, in both bakes alike. What is
// compared is transport from there on: bounces, emitters, sky.
//
// Caches are read with the bands that irradiance can use. Receivers (compare_receivers.h) are read as a game reads
// them: with the bands that each bake recommends, through its own light map and grid.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake_data.h"
#include "relume/result.h"
#include "tools/compare/compare_receivers.h"
#include "tools/compare/match_caches.h"

#include <string>
#include <vector>

namespace relume {

// How long each bake is relit under each lighting: until a frame changes the caches by less than the tolerance, of
// their total. What is still to come is then tolerance / (1 - albedo) or so: 0.2 % in a closed room of albedo 0.95,
// which takes some 130 frames.
inline constexpr float kCompareTolerance = 1e-4f;
inline constexpr int kMaxCompareFrames = 1024;

// One lighting, over all pairs of caches. E is irradiance at a surface cache, along its normal; at a grid cache the
// irradiances along the six axes.
struct LightingDifference {
  std::string name;                 // "sky", "sun 3", "point 5", "emitter lamp", "other emitters"
  std::string was;                  // A's name of an emitting node that was renamed; else empty
  std::string group;                // "sky", "suns", "points", "emitters"
  bool counted = true;              // not left out by --ignore
  bool converged = true;            // both bakes, within kMaxCompareFrames
  double rmse = 0.0;                // sqrt(sum |E_B - E_A|² / sum |E_A|²); where A alone is dark kBeyondBounds
  double meanA = 0.0, meanB = 0.0;  // [W/m²] mean luminance of E
  double meanChange = 0.0, p95Change = 0.0, maxChange = 0.0;  // of |E_B - E_A| / (|E_A| + floor)
  double meanDeltaE = 0.0, p95DeltaE = 0.0, maxDeltaE = 0.0;  // CIE 1976 on white, the lighting's 95th percentile of A
                                                              // as L* = 100
  double floor = 0.0;                               // [W/m²] a twentieth of the mean |E_A|: the dark does not decide
  double white = 1.0;                               // [W/m²] luminance shown as white
  std::vector<float> change, deltaE;                // [Size pairs]
  std::vector<glm::vec3> irradianceA, irradianceB;  // [W/m²] [Size n_C of each] at grid caches the mean of the six
  ReceiverLighting receivers;
};

struct WorstPlace {
  std::uint32_t pair = 0;
  std::string lighting, node;  // node: of the nearest surfel of A, PartNodes::texts
  glm::vec3 positionWorld{0.0f};
  double change = 0.0, deltaE = 0.0;
  glm::vec3 a{0.0f}, b{0.0f};  // [W/m²]
};

struct NodeDifference {
  std::string node;  // PartNodes::texts; "" of caches far from all
  std::uint32_t caches = 0;
  double meanChange = 0.0, maxChange = 0.0;  // of each cache's greatest change over the counted lightings
};

// The receivers of one node, or those in the air, under the lighting that changes them most.
struct WorstReceivers {
  std::string group, lighting;  // group: ReceiverGroup::text
  bool air = false;
  std::uint32_t receivers = 0;
  double change = 0.0;  // GroupChange::change
};

struct LightDifference {
  CacheMatch match;
  Receivers receivers;
  std::vector<LightingDifference> lightings;
  std::vector<float> greatestChange;  // [Size pairs] over the counted lightings; -1 = the cache's node is ignored
  std::vector<WorstPlace> worst;      // at most ten, apart from one another, worst first
  std::vector<NodeDifference> nodes;  // worst first
  std::vector<WorstReceivers> worstReceivers;  // every group that changed, worst first
  double maxRmse = 0.0, maxChange = 0.0, maxDeltaE = 0.0, maxReceiverChange = 0.0;  // over what counts
  bool unmatched = false;  // fewer than half of A's caches have a partner, or none at all of either bake's
};

// What --ignore leaves out: "sky", "suns", "points", "emitters", a lighting's own name, or "node:NAME". A node that was
// renamed goes by either name.
struct LightIgnore {
  std::vector<std::string> names;
};

// Of arguments that are such a name, which may have commas, or several, separated by them.
LightIgnore splitIgnore(const std::vector<std::string>& arguments, const Bake& a, const Bake& b);

// usage: an ignored lighting that there is not, or a node without a name. Of a node or an emitter that neither bake has
// a warning is all, for a CI's list may be of many levels.
Status checkIgnore(const LightIgnore& ignore, const Bake& a, const Bake& b, Context& context);

// Relight both. `scene` may be null (compare_receivers.h). Errors of Relighter::create(); those of
// checkIgnore(); failed when cancelled.
Result<LightDifference> compareLight(const Bake& a, const Bake& b, const Scene* scene, const LightIgnore& ignore,
                                     Context& context);

}  // namespace relume
