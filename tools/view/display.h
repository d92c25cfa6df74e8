// SPDX-License-Identifier: MIT
// From radiance to the screen: exposure, a soft shoulder and sRGB; or, for files, exposure alone.
#pragma once

#include <string>

namespace relume {

// Defines vec3 display(vec3 linear); uniforms at locations 20 and 21.
std::string displayGlsl();
// Set them on the program in use. `exposure` in stops; encode: the target takes what a screen shows, else linear light.
void setDisplay(float exposure, bool encode);

}  // namespace relume
