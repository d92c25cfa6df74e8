// SPDX-License-Identifier: MIT
// GLM's vectors as all public headers have them. Where GLM_FORCE_DEFAULT_ALIGNED_GENTYPES makes them larger, what the
// library was compiled with and what a host hands over would differ without a word of the linker's.
#pragma once

#include <glm/mat4x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

static_assert(sizeof(glm::vec3) == 12 && alignof(glm::vec3) == 4 && sizeof(glm::mat4x3) == 48 && sizeof(glm::vec2) == 8,
              "Relume takes GLM's packed vectors: include its headers where GLM_FORCE_DEFAULT_ALIGNED_GENTYPES is not "
              "defined");
