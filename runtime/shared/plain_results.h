// SPDX-License-Identifier: MIT
// A frame's light as plain numbers that a host can upload or store: see the functions of the same names in relighter.h.
#pragma once

#include "relume/relighter.h"
#include "runtime/shared/packed_caches.h"
#include "runtime/shared/resolve.h"

#include <cstdint>
#include <span>

namespace relume {

// [Size texels = 4 * width * height of the map]
void irradianceMap(const PackedCaches& caches, const CacheLight& light, std::span<std::uint16_t> texels,
                   const ParallelFor& parallelFor);
// [Size texels = 16 * width * height]
void irradianceMapL1(const PackedCaches& caches, const CacheLight& light, std::span<std::uint16_t> texels,
                     const ParallelFor& parallelFor);
// [Size cubes = 6 * points of the volume]
void ambientVolume(const PackedCaches& caches, const CacheLight& light, const AmbientVolume& volume,
                   std::span<glm::vec3> cubes, const ParallelFor& parallelFor);

}  // namespace relume
