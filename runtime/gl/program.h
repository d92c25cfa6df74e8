// SPDX-License-Identifier: MIT
// Compute programs of the shaders in shaders/.
#pragma once

#include "relume/result.h"
#include "runtime/gl/handle.h"
#include "runtime/shared/shader_text.h"

#include <string_view>

namespace relume::gl {

// A linked compute program. failed: the driver's log and the file.
Result<Program> makeComputeProgram(const Functions& gl, std::string_view path, Defines defines,
                                   std::string_view visibilityGlsl = {});

}  // namespace relume::gl
