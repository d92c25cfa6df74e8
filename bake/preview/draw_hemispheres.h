// SPDX-License-Identifier: MIT
// Records whose surroundings are drawn by a rasteriser in place of traced (RCS 5.2, Figs. 6 and 7). This library knows
// no rasteriser: the caller brings one.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <functional>
#include <span>

namespace relume {

// Draw what points see through the pixels of planeCells(), a picture for each pose.
// worldFromFrame: columns tangent, bitangent, normal and position [m] of a point.
// radiance [W/m²/sr]: what surfaces reflect toward the point. distance [m]: from the point to the surface at the
// pixel's centre, infinite where nothing is. Pixels as cells: pixel (i, j) of a picture is its number j * side + i, i
// along the tangent. [Size radiance = distance = poses * side * side]
using DrawHemispheres = std::function<void(std::span<const glm::mat4> worldFromFrame, std::span<glm::vec3> radiance,
                                           std::span<float> distance)>;

}  // namespace relume
