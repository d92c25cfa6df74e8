// SPDX-License-Identifier: MIT
// Programs of the shaders in shaders/.
#pragma once

#include "relume/result.h"
#include "runtime/gl/handle.h"
#include "runtime/shared/shader_text.h"

#include <string_view>

namespace relume::gl {

// A linked compute program. failed: the driver's log and the file; usage: a block of visibilityGlsl has one of the
// bindings that SavedState saves.
Result<Program> makeComputeProgram(const Functions& gl, std::string_view path, Defines defines,
                                   std::string_view visibilityGlsl = {});
// A linked program that draws; both stages have the definitions. failed: likewise.
Result<Program> makeDrawProgram(const Functions& gl, std::string_view vertexPath, std::string_view fragmentPath,
                                Defines defines);

}  // namespace relume::gl
