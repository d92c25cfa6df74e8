// SPDX-License-Identifier: MIT
// What a resolve by textures reads, as texels: see include/relume/texture_resolve.h. shaders/lib/resolve_textures.glsl
// reads it.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"
#include "relume/texture_resolve.h"
#include "runtime/shared/bands.h"
#include "runtime/shared/grid_texture.h"
#include "runtime/shared/packed_caches.h"
#include "runtime/shared/resolve.h"

#include <cstddef>
#include <memory_resource>
#include <span>
#include <string>

namespace relume {

// A relighter's light and what it lies on. All must outlive this.
struct ResolveSource {
  const PackedCaches& caches;
  CacheBands bands;
  const GridTexture* gridTexture;  // null = none
  std::pmr::memory_resource* memory;
};

// unsupported: a grid with more words than a texture addresses exactly. Throws std::bad_alloc.
Result<TextureResolve> describeTextures(const ResolveSource& source);

// Write all texels of one of the textures, by its index. light: the frame's; gridTexels: Backend::gridTexels(). [Size
// texels = ResolveTexture::bytes] Throws std::bad_alloc.
void writeTexels(const ResolveSource& source, std::size_t texture, const CacheLight& light,
                 std::span<const float> gridTexels, const ParallelFor& parallelFor, std::span<std::byte> texels);

// GLSL without comments, valid in 3.30 and in ES 3.00.
Result<std::string> textureResolveGlsl(const CacheBands& bands, bool gridTexture);

}  // namespace relume
