// SPDX-License-Identifier: MIT
// A path-traced reference as the layers of an image file, which the accuracy tests read.
#pragma once

#include "bake/reference/path_tracer.h"
#include "tools/images/image_io.h"

#include <vector>

namespace relume {

// Radiance toward the camera. [Size width * height]
std::vector<glm::vec3> radianceOf(const ReferenceImage& image);

// That radiance as R, G, B, and the layers DiffInd, DiffDir, DiffIndErr, DiffDirErr, DiffCol, Emit, Position, Normal
// and Depth.
ChannelImage toChannels(const ReferenceImage& image);

}  // namespace relume
