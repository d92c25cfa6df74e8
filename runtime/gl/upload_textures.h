// SPDX-License-Identifier: MIT
// Textures that resolves read: the light map, and the grid's where there is one.
#pragma once

#include "runtime/gl/upload.h"

namespace relume::gl {

// unsupported: a light map larger than the driver's textures.
Status makeLightmap(const Functions& gl, const Caches& caches, const CacheBands& bands, GpuBake& gpu,
                    std::pmr::memory_resource* memory);
void makeGridTextures(const Functions& gl, const GridTexture& texture, const CacheBands& bands, GpuBake& gpu,
                      std::pmr::memory_resource* memory);

}  // namespace relume::gl
