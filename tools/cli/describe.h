// SPDX-License-Identifier: MIT
// What `relume info` says, as JSON; the plain text is printed from the same.
#pragma once

#include "formats/chunks.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"

#include <nlohmann/json.hpp>

#include <span>

namespace relume {

// Nearest-neighbour distances of the surfels. [m]
struct SpacingStatistics {
  double min = 0.0, mean = 0.0;
  double variation = 0.0;  // coefficient of variation
  double densest = 0.0;    // spacing of the densest packing of as many points on the same area
};
SpacingStatistics surfelSpacing(const Surfels& surfels);

// What a bake says of its own error: {"error", "lights", "parts"}, parts that have receivers by what they add, worst
// first; null where it says nothing. "error" is that under the middle light. A part's "squaredError" is what it adds to
// the mean of the lights' squared errors, and its "share" is of the sum of those above 0. [0..1]
nlohmann::json describeCertificate(const Bake& bake);
// "18.2 MiB and 4.12 ms a frame in a game": runtimeCost().
std::string costText(const Bake& bake);
// "certified error 12.3 % (sky 8.1, sun 14.0, sun 12.3, lamp 20.9)"; empty where there is none.
std::string certificateText(const Bake& bake);
// What exported levels call the bake (identifyBakeFile()), sizes, chunk table, options, statistics of surfels,
// hierarchy, caches and links. packed: isPackedFile().
nlohmann::json describeBake(const Bake& bake, std::span<const ChunkInfo> chunks, std::uint64_t fileHash, bool packed);

// Meshes, instances, materials, cameras, lights, volumes, bounds, and the mesh report (check_mesh.h).
nlohmann::json describeScene(const Scene& scene, Context& context);

}  // namespace relume
