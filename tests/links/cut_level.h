// SPDX-License-Identifier: MIT
// A level baked as far as the leaves that its caches see, and lit by lights that the bake knew nothing of: what cuts,
// pull weights and budgets are measured against. For the long tests of the links and the tables of docs/notes/cuts.md.
#pragma once

#include "bake/caches/caches.h"
#include "bake/links/gather.h"
#include "bake/links/pull_weights.h"
#include "bake/links/select_cut.h"
#include "bake/visibility/play_space.h"

#include <memory>
#include <string>
#include <vector>

namespace relume::test {

struct CutLevel {
  Scene scene;
  std::unique_ptr<RayTracer> tracer;
  PlaySpace space;
  PlacedSurfels placed;
  Hierarchy hierarchy;
  Caches caches;
  std::vector<std::vector<Arrival>> arrivals;  // [Size n_C] of every leaf once: weights added up, the rest their mean

  bool onSurface(std::size_t cache) const;
  float receivedScale(std::size_t cache) const { return onSurface(cache) ? 1.0f : 0.25f; }
};

// Everything up to the hierarchy, the caches and what they see; no sky.
Result<std::unique_ptr<CutLevel>> makeCutLevel(Scene scene, const BakeOptions& options, Context& context);
Result<std::unique_ptr<CutLevel>> loadCutLevel(const std::string& path, const BakeOptions& options, Context& context);
// What every cache sees through so many rays.
std::vector<std::vector<Arrival>> gatherLeaves(const CutLevel& level, std::uint32_t rays, std::uint64_t seed,
                                               Context& context);

// Radiosity of every sender under some lights, first bounce, shadowed: value[sender * count() + light].
struct LitSenders {
  std::vector<std::string> name;  // [Size lights]
  std::vector<float> value;
  std::size_t count() const { return name.size(); }
};

// Lights of one kind; those that reach less than one in 10^4 surfels are left out.
struct LightSuite {
  std::string name;
  LitSenders lit;
};

LightSuite makeSuite(const CutLevel& level, const std::string& name, const std::vector<SceneLight>& lights,
                     Context& context);
// The level's own lights, each alone.
LightSuite ownLights(const CutLevel& level, Context& context);
// 16 suns from all around, 30 to 90 degrees above the horizon; 16 spots at random free places, in random directions,
// half cones of 15 to 40 degrees; a torch at 16 places along the longest way through the level, at about a man's
// height.
std::vector<LightSuite> untrainedLights(const CutLevel& level, Context& context);

// What a cache reads: node, and the share of irradiance it weighs.
struct Read {
  std::uint32_t node;
  float received;
};
using Reads = std::vector<std::vector<Read>>;

// Every visible leaf: the truth for these rays.
Reads leafReads(const CutLevel& level);
// Irradiance [W/m²] of every cache under every light: [cache * lights + light].
std::vector<double> irradiance(const CutLevel& level, const Reads& reads, std::span<const float> firstWeight,
                               const LitSenders& lit);

struct CutError {
  double rmse = 0.0;    // root of the summed squares of the differences over that of the exact
  double energy = 0.0;  // sum over that of the exact
};
// One a light.
std::vector<CutError> compareCaches(const std::vector<double>& read, const std::vector<double>& exact,
                                    std::size_t lights);

struct CutChoice {
  LinkOptions::CutKey key = LinkOptions::CutKey::readError;
  LinkOptions::PullWeight pull = LinkOptions::PullWeight::importance;
  CutLimit limit{254};
};
struct CutReads {
  Reads reads;
  std::vector<float> firstWeight;
  std::size_t links = 0, min = 0, max = 0;  // of all caches, of one
};
// The cuts of a bake and the weights that belong to them.
CutReads cutCaches(const CutLevel& level, const CutChoice& choice);

// Median and worst of a suite.
struct SuiteError {
  double medianRmse = 0.0, worstRmse = 0.0;
  double medianEnergy = 0.0, worstEnergy = 0.0;  // the worst is the one farthest from 1
  std::string worst;                             // light with the worst RMSE
};
SuiteError summarize(const std::vector<CutError>& errors, const std::vector<std::string>& names);

}  // namespace relume::test
