// SPDX-License-Identifier: MIT
// The plan of a bake whose links are traced in shards: all that the stages before made, once, for any number of
// processes on any machines. formats/README.md documents its file.
#pragma once

#include "bake/certificate/test_rays.h"
#include "bake/rays/ray_tracer.h"
#include "bake/stages.h"
#include "bake/surfels/surfels.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

namespace relume {

struct BakePlan {
  Bake bake;            // without links: its rows are empty, and Hierarchy::firstWeight is the clustering's
  BakeOptions options;  // what Provenance::optionsJson says
  BakeOptions chosen;   // the same with the sizes that their budgets chose: what links are traced with
  SurfelMap map;
  std::vector<glm::vec3> tracedEmission;  // [W/m²/sr] [Size 0 or n_S] where materials are drivable: the emission that
                                          // links reckon with, which is not the bake's (PlacedSurfels::bakedEmission)
  TestRays test;                          // what the merged bake is certified with; of its lights without SceneLight
  float minKey = -1.0f;                   // CutLimit::minKey of all caches
  std::uint64_t identity = 0;  // of its file, which parsePlan() and readPlan() find. Same level, options and program:
                               // same file
};

// Make all of a bake but its links. Errors as bake(); usage: an error to bake for, which takes whole bakes.
Result<BakePlan> makePlan(const Scene& scene, const BakeOptions& options, Context& context);

// A plan but for its threshold, and the ray tracer that it was made with, for who goes on to trace its links.
struct PlannedLevel {
  BakePlan plan;
  RayTracer tracer;
};
Result<PlannedLevel> planLevel(const Scene& scene, const BakeOptions& options, const PlaceStages& stages,
                               Context& context);
// What BakePlan::minKey is to be. failed: cancelled, too little memory.
Result<float> findThreshold(const RayTracer& tracer, const BakePlan& plan, Context& context);

// Rows of no links, as a plan's bake has them.
Links noLinks(const Caches& caches, const LinkOptions& options);

// Done where this program would make this plan of this scene and its options. unsupported: another version of the
// program, or of its ray tracer, which merging does without. invalidFile: another level.
Status checkPlanVersion(const BakePlan& plan);
Status checkPlanTracer(const BakePlan& plan);
Status checkPlanLevel(const BakePlan& plan, const Scene& scene);

// As a file. Errors as of writeBake(), serializeBake(), readBake() and parseBake(). A plan that was read is safe to
// trace with, whatever its file says: sizes, indices and numbers are checked.
Status writePlan(const BakePlan& plan, const std::filesystem::path& path);
Result<std::vector<std::byte>> serializePlan(const BakePlan& plan);
Result<BakePlan> readPlan(const std::filesystem::path& path);
Result<BakePlan> parsePlan(std::span<const std::byte> bytes, const std::shared_ptr<const void>& owner);

}  // namespace relume
