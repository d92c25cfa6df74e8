// SPDX-License-Identifier: MIT
// What a bake was made from: content hashes of the scene's parts, the options, the versions. Nothing of the machine.
#pragma once

#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"

#include <string>
#include <vector>

namespace relume {

// Raised whenever the same input and options can give other bytes; tests/pipeline/algorithm_version_test.cpp holds it.
inline constexpr std::uint32_t kAlgorithmVersion = 26;

// One entry an instance of the scene, in its order: names, the XXH3 of world transform (but of what is dynamic),
// geometry, material and the texels it uses, and its blocks of describeShapes(). Instances that share a mesh, a
// material or an image are hashed once. Any thread.
std::vector<BakedInstance> describeInstances(const Scene& scene);

// Bake::shapes: the sums of all meshes, in the scene's order: what tells noise of an exporter from a change.
std::vector<std::uint32_t> describeShapes(const Scene& scene);

// The same entries, but where a baked part of that node and mesh has a geometry that differs by noise alone, with the
// baked part's geometry hash: `answers[i]` is the index of the baked part that answers to instance i, or kNone.
std::vector<BakedInstance> forgiveNoise(const Scene& scene, std::vector<BakedInstance> now, const Bake& bake,
                                        const std::vector<std::uint32_t>& answers);

// XXH3 over what decides where light is looked for beside the surfaces: play volumes, and Scene::playSpaceCameras().
std::uint64_t hashViews(const Scene& scene);

// XXH3 over all cameras, for those who want to know that one changed which decides nothing.
std::uint64_t hashCameras(const Scene& scene);

// XXH3 over the instances' hashes and names, which of them share a mesh, and hashViews(). Lights are left out: they
// never enter a bake.
std::uint64_t hashScene(const Scene& scene, const std::vector<BakedInstance>& instances);

// The same as bake() would store it. rayTracer: its name and version, as Provenance::rayTracer of a bake has it.
Provenance describeProvenance(const Scene& scene, const std::vector<BakedInstance>& instances,
                              const BakeOptions& options, const std::string& rayTracer);

}  // namespace relume
