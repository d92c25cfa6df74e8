// SPDX-License-Identifier: MIT
// Bytes as a file of gzip (RFC 1952): what web servers and browsers unpack on their own.
#pragma once

#include "relume/result.h"

#include <cstddef>
#include <span>
#include <vector>

namespace relume {

// No name and no time in it, so that the same bytes give the same file with the same zlib.
// memory: there is not enough.
Result<std::vector<std::byte>> gzip(std::span<const std::byte> bytes);

}  // namespace relume
