// SPDX-License-Identifier: MIT
// Stands where the SPIR-V would in a build without Vulkan.
#include "runtime/passes/spirv.h"

namespace relume::gpu {

std::span<const EmbeddedSpirv> embeddedSpirv() { return {}; }

}  // namespace relume::gpu
