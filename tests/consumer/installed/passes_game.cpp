// SPDX-License-Identifier: MIT
// A game with a renderer of its own: a frame's passes as data, by the installed headers and library; with Vulkan's
// headers at hand, the executor's too.
#include <relume/bake_file.h>
#include <relume/gpu_passes.h>
#ifdef HAS_VULKAN
#include <relume/vulkan_executor.h>
#endif

#include <cstdio>

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  const relume::Result<relume::Bake> bake = relume::mapBake(argv[1]);
  if (!bake) return std::fprintf(stderr, "%s\n", bake.error().message.c_str()), 2;
  relume::Result<relume::GpuPasses> passes = relume::GpuPasses::create(*bake, {}, {});
  if (!passes) return std::fprintf(stderr, "%s\n", passes.error().message.c_str()), 3;
  const relume::Result<relume::GpuFrame> frame = passes->frame({});
  if (!frame) return std::fprintf(stderr, "%s\n", frame.error().message.c_str()), 4;
#ifdef HAS_VULKAN
  const auto refused = relume::VulkanExecutor::create({}, *passes, VK_NULL_HANDLE);
  if (refused || refused.error().code != relume::ErrorCode::usage) return 5;
#endif
  const relume::Result<std::string> surfels = relume::gpuSurfelGlsl();
  if (!surfels || surfels->empty() || passes->resolveGlsl().empty()) return 6;
  std::printf("%zu programs, %zu dispatches\n", passes->programs().size(), frame->dispatches.size());
  return 0;
}
