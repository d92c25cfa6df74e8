// SPDX-License-Identifier: MIT
// OpenGL's errors, which queue up until they are asked for: around calls that may run out of memory.
#pragma once

#include "runtime/gl/functions.h"

namespace relume::gl {

// More than a context keeps, one of each kind. What has more has one again as soon as it is asked for: no context at
// all on some systems, or one that is lost.
inline constexpr int kMostErrors = 16;

// Whether OpenGL has run out of memory since its errors were last asked for. None is pending afterwards.
inline bool takeOutOfMemory(const Functions& gl) {
  bool isOut = false;
  GLenum error = gl.GetError();
  for (int i = 0; error != GL_NO_ERROR && i < kMostErrors; ++i, error = gl.GetError())
    isOut = isOut || error == GL_OUT_OF_MEMORY;
  return isOut;
}

// Forget what the host has left, which would be taken for one's own.
inline void dropErrors(const Functions& gl) { static_cast<void>(takeOutOfMemory(gl)); }

}  // namespace relume::gl
