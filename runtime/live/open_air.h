// SPDX-License-Identifier: MIT
// Light in open air: what flies or stands out of reach of the caches, which are near surfaces alone, reads the nearest
// ones that it sees.
//
// Deviation: CRC lights surfaces, and says nothing of other receivers.
#pragma once

#include "runtime/live/live_caches.h"
#include "runtime/live/nested_caches.h"

#include <glm/vec3.hpp>

#include <span>

namespace relume {

// Irradiance [W/m²] at a receiver with unit normal: by the caches around it (nestedStencil()) or, where no cell around
// has one, by those of the outermost volume that it sees within 5/4 of the way to the nearest, some 64 of them. These
// weigh 1 / d² - 1 / D², d their distance and D that limit, so that none comes in or goes at once. Zero outside of a
// volume that stays, and where position or normal is not finite. caches, sky: as nestedIrradiance() has them.
glm::vec3 receivedIrradiance(std::span<const VolumeCaches> caches, const CacheSum& sky, const glm::vec3& positionWorld,
                             const glm::vec3& normal);

}  // namespace relume
