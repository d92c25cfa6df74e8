// SPDX-License-Identifier: MIT
// The links on the GPU, in batches that the driver's bindings hold.
#pragma once

#include "runtime/gl/upload.h"

namespace relume::gl {

// Upload the links, and cut them into batches of at most `limit` bytes a binding, whose starts are aligned to
// `alignment` [byte]. gpu.firstMapCache must be set: no batch has caches before and from it on. unsupported: a cache
// whose links alone exceed `limit`.
Status makeLinks(const Functions& gl, const Links& links, std::size_t limit, std::size_t alignment, GpuBake& gpu,
                 std::pmr::memory_resource* memory);

}  // namespace relume::gl
