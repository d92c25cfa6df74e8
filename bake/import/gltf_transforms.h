// SPDX-License-Identifier: MIT
// A node's own transform, and what of it turns a light.
#pragma once

#include "bake/import/gltf_document.h"

#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <vector>

namespace relume {

// A unit quaternion from x, y, z, w; no rotation where there are not four, or they have no length.
glm::dquat rotationOf(const std::vector<double>& xyzw);

glm::dmat4 localTransform(const tinygltf::Node& node);

// The node's +Z by its rotation alone, against which a light shines: a unit vector, or zero where the node's matrix has
// a scale of 0 along Z and along another axis.
glm::dvec3 lightAxis(const tinygltf::Node& node);

}  // namespace relume
