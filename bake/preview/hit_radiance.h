// SPDX-License-Identifier: MIT
// What a record's ray finds where it ends: the radiance that is reflected there toward the ray's origin.
#pragma once

#include "bake/rays/ray_tracer.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace relume {

class EmittingTriangles;
struct Sky;

// Write the radiance [W/m²/sr] for each ray that hits something; the others are 0 at first. What surfaces emit is not
// part of it: emitters are light of the pixels' own. `item` is the record's number for random streams; `spread` the
// width of the patch that a ray stands for, over its distance. Random numbers are drawn for one ray after the other:
// what is found depends on their order, which must not depend on threads. Called from many threads at once.
// [Size rays = hits = radiance]
using HitRadiance = std::function<void(std::uint64_t item, float spread, std::span<const Ray> rays,
                                       std::span<const Hit> hits, std::span<glm::vec3> radiance)>;

// RCS 4: light that is reflected once. A shadow ray for each punctual light, one toward a point drawn on the emitters
// and one toward the sky. `drawn` casts the punctual lights' shadows, `transport` all others. emitters: null where
// they are off. All are kept by reference, as long as the function is called.
HitRadiance directRadiance(const RayTracer& transport, const RayTracer& drawn, std::span<const SceneLight> lights,
                           const EmittingTriangles* emitters, const Sky& sky, std::uint64_t seed);

}  // namespace relume
