// SPDX-License-Identifier: MIT
// What a bake was made from: content hashes of the scene's parts, the options, the versions. Nothing of the machine.
#pragma once

#include "bake/options.h"
#include "bake/scene/scene.h"
#include "formats/bake.h"

#include <string>
#include <vector>

namespace relume {

// Raised whenever the same input would give other light.
inline constexpr std::uint32_t kAlgorithmVersion = 1;

// One entry an instance of the scene, in its order: names, and the XXH3 of world transform, geometry, material and the
// texels it uses. Instances that share a mesh, a material or an image are hashed once. Any thread.
std::vector<BakedInstance> describeInstances(const Scene& scene);

// XXH3 over what decides where light is looked for beside the surfaces: play volumes, and Scene::playSpaceCameras().
std::uint64_t hashViews(const Scene& scene);

// XXH3 over the instances' hashes and names, and hashViews(). Lights are left out: they never enter a bake.
std::uint64_t hashScene(const Scene& scene, const std::vector<BakedInstance>& instances);

Provenance describeProvenance(const Scene& scene, const std::vector<BakedInstance>& instances,
                              const BakeOptions& options, const std::string& rayTracer);

}  // namespace relume
