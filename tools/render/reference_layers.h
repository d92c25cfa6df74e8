// SPDX-License-Identifier: MIT
// A path-traced reference as the layers of an image file, which the accuracy tests read.
#pragma once

#include "bake/reference/path_tracer.h"
#include "tools/images/image_io.h"

#include <span>
#include <vector>

namespace relume {

// Radiance toward the camera. [Size width * height]
std::vector<glm::vec3> radianceOf(const ReferenceImage& image);

// Glossy light, all of it. Empty where none was traced.
std::vector<glm::vec3> glossyOf(const ReferenceImage& image);

// How open the surroundings of surfaces are, as grey. Empty where it was not traced.
std::vector<glm::vec3> opennessOf(const ReferenceImage& image);

// `combined` as R, G, B, and the layers DiffInd, DiffDir, DiffIndErr, DiffDirErr, DiffCol, Emit, Position, Normal,
// Depth and, where they were traced, GlossInd, GlossDir, GlossIndErr, GlossDirErr, Open. [Size combined = width *
// height]
ChannelImage toChannels(const ReferenceImage& image, std::span<const glm::vec3> combined);

}  // namespace relume
