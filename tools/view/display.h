// SPDX-License-Identifier: MIT
// From radiance to the screen: exposure, a soft shoulder, and sRGB unless the target encodes.
#pragma once

#include <string>

namespace relume {

// Defines vec3 display(vec3 linear); uniforms at locations 20 and 21.
std::string displayGlsl();
// Set them on the program in use. `exposure` in stops.
void setDisplay(float exposure, bool encode);

}  // namespace relume
