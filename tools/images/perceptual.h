// SPDX-License-Identifier: MIT
// How different two pictures look, for `relume diff` and the measurements: the error in CIE Lab that CRC Table 1 tells,
// and FLIP for low dynamic range (Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild 2020), written from
// its paper.
#pragma once

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// CIE Lab of linear sRGB, white D65. [0..1]
glm::dvec3 labOf(const glm::dvec3& linear);

// Root mean square of the distance in CIE Lab, 1 = just seen side by side. Linear sRGB, clamped to [0..1]; sizes equal.
double labRmse(std::span<const glm::vec3> a, std::span<const glm::vec3> b);

// What an observer sees who flips between two pictures, a pixel each, 0 = the same .. 1. Linear sRGB, times
// exposure and clamped to [0..1], row by row. pixelsPerDegree: 67 = a 4K screen of 0.7 m at 0.7 m, the paper's. [Size
// a, b == width height]
std::vector<float> flip(std::uint32_t width, std::uint32_t height, std::span<const glm::vec3> a,
                        std::span<const glm::vec3> b, float exposure = 1.0f, double pixelsPerDegree = 67.0206);

}  // namespace relume
