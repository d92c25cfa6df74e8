// SPDX-License-Identifier: MIT
// A play space as bytes, to be kept and taken up again for a level of the same shapes.
#pragma once

#include "bake/base/byte_stream.h"
#include "bake/visibility/play_space.h"

#include <optional>

namespace relume {

void writePlaySpace(const PlaySpace& space, ByteWriter& to);
// Nothing where the bytes are none of this scene's play spaces: sizes and ranges are checked. The scene must outlive
// it.
std::optional<PlaySpace> readPlaySpace(ByteReader& from, const Scene& scene);

}  // namespace relume
