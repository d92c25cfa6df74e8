// SPDX-License-Identifier: MIT
// See display.h.
#include "tools/view/display.h"

#include <epoxy/gl.h>

#include <cmath>

namespace relume {

std::string displayGlsl() {
  return R"(
layout(location = 20) uniform float displayScale;
layout(location = 21) uniform bool displayEncode;
vec3 display(vec3 linear) {
  vec3 scaled = displayScale * max(linear, vec3(0.0));
  if (!displayEncode) return scaled;
  vec3 c = 1.0 - exp(-scaled);
  return mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
}
)";
}

void setDisplay(float exposure, bool encode) {
  glUniform1f(20, std::exp2(exposure));
  glUniform1i(21, encode ? 1 : 0);
}

}  // namespace relume
