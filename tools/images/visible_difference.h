// SPDX-License-Identifier: MIT
// Which pixels of two pictures an observer can tell apart: the perceptual metric for production testing (Yee, Newman
// 2004), PerceptualDiff, written from its paper and those that its formulas are of. CRC Table 1 counts such pixels.
#pragma once

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

struct ObserverOptions {
  double fieldOfView = 45.0;      // [degree] of the picture's width
  double whiteLuminance = 100.0;  // [cd/m²] of the screen
};

// 1 where a difference is seen, 0 elsewhere. Linear sRGB, clamped to [0..1], row by row. [Size a, b == width height]
std::vector<std::uint8_t> visiblyDifferent(std::uint32_t width, std::uint32_t height, std::span<const glm::vec3> a,
                                           std::span<const glm::vec3> b, const ObserverOptions& options = {});

// The least difference of luminance that is seen on a ground of that luminance. [cd/m²] (Ward Larson, Rushmeier, Piatko
// 1997, Table 1)
double thresholdOfLuminance(double adaptation);

// How sensitive an eye is to stripes. frequency: [cycles a degree]; adaptation: [cd/m²] (Barten 1989)
double contrastSensitivity(double frequency, double adaptation);

}  // namespace relume
