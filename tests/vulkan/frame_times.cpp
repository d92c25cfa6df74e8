// SPDX-License-Identifier: MIT
// Frames of light of a bake in OpenGL and in Vulkan, on whatever devices this machine has, one after the other:
//   bench_vulkan_times LEVEL.relume [FRAMES]
// Prints milliseconds of a frame from its first call until the device is done, median and least, and of what the
// processor does for it.
#include "relume/bake_file.h"
#include "relume/vulkan_executor.h"
#include "tests/runtime/some_lights.h"
#include "tests/vulkan/vulkan_host.h"
#include "tools/gl_scene/egl_context.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>

namespace relume {
namespace {

using Clock = std::chrono::steady_clock;

double msSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

void print(const char* what, const std::string& device, std::vector<double> ms, std::vector<double> submitted) {
  std::sort(ms.begin(), ms.end());
  std::sort(submitted.begin(), submitted.end());
  std::printf("%-8s %-44s %8.2f %8.2f %8.3f\n", what, device.c_str(), ms[ms.size() / 2], ms.front(),
              submitted[submitted.size() / 2]);
}

int fail(const std::string& message) {
  std::fprintf(stderr, "bench_vulkan_times: %s\n", message.c_str());
  return 1;
}

int measure(const Bake& bake, int frames) {
  const std::vector<Light> lights = test::someLights();
  LightSetup setup;
  setup.lights = lights;
  setup.skyRadiance = {0.1f, 0.2f, 0.3f};
  Result<EglContext> context = EglContext::create();
  if (!context) return fail(context.error().message);
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  Result<Relighter> gl = Relighter::create(bake, options);
  if (!gl) return fail(gl.error().message);
  std::string why;
  const std::unique_ptr<test::VulkanHost> host = test::VulkanHost::open(why, false);
  if (!host) return fail(why);
  Result<GpuPasses> passes = GpuPasses::create(bake, options, gpuDeviceOf(host->device()));
  if (!passes) return fail(passes.error().message);
  Result<std::unique_ptr<VulkanExecutor>> executor = Error{};
  host->run([&](VkCommandBuffer commands) { executor = VulkanExecutor::create(host->device(), *passes, commands); });
  if (!executor) return fail(executor.error().message);
  passes->forgetContents();

  std::vector<double> glMs, glSubmitted, vulkanMs, vulkanSubmitted;
  // In turns, so that what else this machine does meets both.
  for (int i = 0; i < frames + 3; ++i) {
    auto start = Clock::now();
    if (Status lit = gl->relight(setup); !lit) return fail(lit.error().message);
    const double submitted = msSince(start);
    glFinish();
    const double glTime = msSince(start);
    start = Clock::now();
    double recorded = 0.0;
    Result<GpuFrame> frame = passes->frame(setup);
    if (!frame) return fail(frame.error().message);
    host->run([&](VkCommandBuffer commands) {
      (*executor)->record(commands, *frame);
      recorded = msSince(start);
    });
    // The first frames compile, and have no bounces.
    if (i < 3) continue;
    glMs.push_back(glTime);
    glSubmitted.push_back(submitted);
    vulkanMs.push_back(msSince(start));
    vulkanSubmitted.push_back(recorded);
  }
  std::printf("%u surfels, %u caches, %u links; ms of a frame: median, least, and of the processor's calls\n",
              bake.surfels.count(), static_cast<unsigned>(bake.caches.count()), bake.links.count());
  print("OpenGL", context->renderer(), glMs, glSubmitted);
  print("Vulkan", host->name(), vulkanMs, vulkanSubmitted);
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  const int frames = argc > 2 ? std::atoi(argv[2]) : 30;
  if (argc < 2 || argc > 3 || frames < 1) return relume::fail("usage: bench_vulkan_times LEVEL.relume [FRAMES]");
  const relume::Result<relume::Bake> bake = relume::mapBake(argv[1]);
  return bake ? relume::measure(*bake, frames) : relume::fail(bake.error().message);
}
