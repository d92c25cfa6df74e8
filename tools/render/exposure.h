// SPDX-License-Identifier: MIT
// How bright a picture is shown: by a number of stops, or by one that is taken from the picture.
#pragma once

#include "relume/result.h"

#include <glm/vec3.hpp>

#include <optional>
#include <span>
#include <string>

namespace relume {

// "auto" or a number of stops, as --exposure takes them. Nothing = auto. usage: neither, or outside -30..30.
Result<std::optional<float>> readExposure(const std::string& text);

// Stops that show linear radiance well, to hundredths, so that the number printed gives the same picture again: the
// geometric mean of the luminances becomes middle grey (0.18), unless that clips more than a twentieth of the pixels.
// 0 for a picture without light.
float autoExposure(std::span<const glm::vec3> pixels);

// Stops as a number of two decimals, for JSON.
double roundedStops(float stops);

// "+1.25": for messages, and for --exposure.
std::string stopsText(float stops);

}  // namespace relume
