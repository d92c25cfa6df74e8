// SPDX-License-Identifier: MIT
// SPIR-V of the passes, made when the library is built (make_spirv.cpp).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace relume::gpu {

struct EmbeddedSpirv {
  std::string_view key;  // spirvKey()
  std::span<const std::uint32_t> words;
};

// In ascending order of keys. Empty in builds without RELUME_BUILD_VULKAN.
std::span<const EmbeddedSpirv> embeddedSpirv();

}  // namespace relume::gpu
