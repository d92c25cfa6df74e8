// SPDX-License-Identifier: MIT
// What of relume.h's structs relighters and light without a bake both read.
#pragma once

#include "runtime/c_handles.h"

#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace relume::c {

static_assert(sizeof(glm::vec3) == 3 * sizeof(float));

inline glm::vec3 vec3(const float* v) { return {v[0], v[1], v[2]}; }
// Columns, then the translation.
inline glm::mat4x3 transform(const float* v) { return {vec3(v), vec3(v + 3), vec3(v + 6), vec3(v + 9)}; }
inline std::span<const glm::vec3> vectors(const float* v, std::size_t count) {
  return {reinterpret_cast<const glm::vec3*>(v), v == nullptr ? 0 : count};
}
inline std::span<glm::vec3> vectors(float* v, std::size_t count) { return {reinterpret_cast<glm::vec3*>(v), count}; }

// usage: a backend that there is not.
Status readBackend(const relume_backend& from, BackendKind& to);
// The host outlives what calls it. One pointer: std::function allocates nothing for it.
ParallelFor parallelForOf(const Host& context);

// The lights of a setup, in place of those that were there. usage: no lights, a kind that there is not.
Status readLights(const relume_light_setup& read, std::pmr::vector<Light>& lights);
// The host's shadows; empty where it has none. `setup` outlives it.
VisibilityBatch visibilityOf(const relume_light_setup& setup);

}  // namespace relume::c
