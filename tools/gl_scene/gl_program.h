// SPDX-License-Identifier: MIT
// A program of a vertex and a fragment shader, from GLSL text.
#pragma once

#include "relume/result.h"
#include "tools/gl_scene/gl_handle.h"

#include <string>

namespace relume {

// failed: the compiler's or linker's log with `name` and the stage in front.
Result<GlProgram> linkProgram(const std::string& name, const std::string& vertexGlsl, const std::string& fragmentGlsl);

}  // namespace relume
