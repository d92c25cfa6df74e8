// SPDX-License-Identifier: MIT
// A radiance record's splat (RCS Algorithm 1): the box of pixels in which its sphere of influence can be seen, an
// instance of four corners for each record. With RELUME_SPLAT_ORDER, of a record of splat_mirrors.frag. Row 0 of the targets is the picture's first.
#include "shared/layout.h"

#ifdef RELUME_SPLAT_ORDER
#define RECORD_LIGHTS RELUME_SPLAT_MIRROR_LIGHTS
#else
#define RECORD_LIGHTS RELUME_SPLAT_LIGHTS
#endif

layout(location = RELUME_SPLAT_AT_BOX) in uvec4 box;
layout(location = RELUME_SPLAT_AT_POSITION) in vec4 position;
layout(location = RELUME_SPLAT_AT_NORMAL) in vec4 normal;
layout(location = RELUME_SPLAT_AT_NEAR) in float near;
layout(location = RELUME_SPLAT_AT_LIGHT) in vec4 light[RECORD_LIGHTS];
layout(location = RELUME_SPLAT_AT_SIZE) uniform vec2 pictureSize;

flat out vec4 recordPosition;
flat out vec4 recordNormal;
flat out float recordNear;
flat out vec4 recordLight[RECORD_LIGHTS];

void main() {
  vec2 corner = vec2((gl_VertexID & 1) == 0 ? box.x : box.z, (gl_VertexID & 2) == 0 ? box.y : box.w);
  gl_Position = vec4(2.0 * corner / pictureSize - 1.0, 0.0, 1.0);
  recordPosition = position;
  recordNormal = normal;
  recordNear = near;
  recordLight = light;
}
