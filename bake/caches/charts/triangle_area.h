// SPDX-License-Identifier: MIT
// Areas of triangles in the plane of a chart.
#pragma once

#include <glm/vec2.hpp>

#include <array>

namespace relume {

// Of the parallelogram that two vectors span; positive where b is counter-clockwise from a.
inline float cross2(const glm::vec2& a, const glm::vec2& b) { return a.x * b.y - a.y * b.x; }

inline float signedArea(const std::array<glm::vec2, 3>& t) { return 0.5f * cross2(t[1] - t[0], t[2] - t[0]); }

}  // namespace relume
