// SPDX-License-Identifier: MIT
// Shaders from the sources built into the library: includes expanded here, so that no file is needed at run time and no
// driver extension either.
#pragma once

#include "relume/result.h"

#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace relume {

// A source file by its path below shaders/.
struct EmbeddedShader {
  std::string_view path, text;
};

// Made by CMake: all of shaders/, in builds without OpenGL what resolve.glsl needs.
std::span<const EmbeddedShader> embeddedShaders();

// Preprocessor definitions put in front; an empty value defines the name alone.
using Defines = std::span<const std::pair<std::string, std::string>>;

// Text of `path` with definitions in front and quoted includes replaced by their files, each at most once. The name
// host_visibility.glsl stands for `visibilityGlsl`. Without #version. failed: an include that does not exist.
Result<std::string> expandShader(std::string_view path, Defines defines, std::string_view visibilityGlsl = {});

}  // namespace relume
