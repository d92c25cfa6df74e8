// SPDX-License-Identifier: MIT
// The host's textures that a frame puts on drivable materials (MaterialEmission::texture), looked at before they are
// read.
#pragma once

#include "relume/lights.h"
#include "relume/result.h"
#include "runtime/gl/functions.h"
#include "runtime/shared/driven_emission.h"

namespace relume::gl {

// What cannot be read of the textures: usage. sizes: declared, by drivable material. Puts back what it binds.
Status checkTextures(const Functions& gl, const LightSetup& setup, const ImageSizes& sizes);

}  // namespace relume::gl
