// SPDX-License-Identifier: MIT
// Lists as textures, in rows of 1024 texels, for the passes of bindings/js/src/webgl_passes.js: a fragment per element.
precision highp float;
precision highp int;
precision highp usampler2D;
precision highp sampler2D;
precision highp sampler2DArray;
#include "shared/layout.h"

ivec2 relumeTexelOf(uint index) { return ivec2(int(index & 1023u), int(index >> 10)); }

// The element that this fragment is.
uint relumeElement() { return uint(gl_FragCoord.y) << 10 | uint(gl_FragCoord.x); }

uint relumeWord(usampler2D list, uint index) { return texelFetch(list, relumeTexelOf(index), 0).x; }
