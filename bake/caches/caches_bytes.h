// SPDX-License-Identifier: MIT
// Caches as bytes, to be kept and taken up again for a level of the same shapes.
#pragma once

#include "bake/base/byte_stream.h"
#include "bake/caches/caches.h"
#include "relume/bake/scene.h"
#include "relume/caches.h"

#include <optional>

namespace relume {

void writeCaches(const PlacedCaches& caches, ByteWriter& to);
// Nothing where the bytes are none of this scene's caches. What tracing links needs is checked here, the rest of the
// finished bake (validateBake()).
std::optional<PlacedCaches> readCaches(ByteReader& from, const Scene& scene);

}  // namespace relume
