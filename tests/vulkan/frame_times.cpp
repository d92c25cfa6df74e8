// SPDX-License-Identifier: MIT
// Frames of light of a bake in OpenGL and in Vulkan, on whatever devices this machine has, one after the other:
//   bench_vulkan_times LEVEL.relume [FRAMES [X,Y,Z RADIUS]]
// Prints milliseconds of a frame from its first call until the device is done, median and least, of all of this
// program's threads in that time, and of what the processor does for it. The metres are those of a grey ball that
// swings about a place, a moving part.
#include "relume/bake_file.h"
#include "relume/vulkan_executor.h"
#include "tests/runtime/ball.h"
#include "tests/runtime/some_lights.h"
#include "tests/vulkan/vulkan_host.h"
#include "tools/gl_scene/egl_context.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace relume {
namespace {

using Clock = std::chrono::steady_clock;

double msSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// [ms] of all threads of this program.
double processMs() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

// [ms] of each frame.
struct Times {
  std::vector<double> ms, process, submitted;
};

void print(const char* what, const std::string& device, Times times) {
  for (std::vector<double>* each : {&times.ms, &times.process, &times.submitted}) std::sort(each->begin(), each->end());
  const std::size_t middle = times.ms.size() / 2;
  std::printf("%-8s %-44s %8.2f %8.2f %8.2f %8.3f\n", what, device.c_str(), times.ms[middle], times.ms.front(),
              times.process[middle], times.submitted[middle]);
}

int fail(const std::string& message) {
  std::fprintf(stderr, "bench_vulkan_times: %s\n", message.c_str());
  return 1;
}

struct Swing {
  glm::vec3 middle{0.0f};
  float radius = 0.0f;  // 0 = no ball
};

int measure(const Bake& bake, int frames, const Swing& swing) {
  const std::vector<Light> lights = test::someLights();
  LightSetup setup;
  setup.lights = lights;
  setup.skyRadiance = {0.1f, 0.2f, 0.3f};
  const test::Ball ball(std::max(swing.radius, 0.1f), 32);
  const glm::vec3 grey(0.5f);
  const MovingMesh mesh{ball.position, ball.triangle, {&grey, 1}};
  const Result<MovingShapes> shapes = MovingShapes::create({&mesh, 1});
  if (!shapes) return fail(shapes.error().message);
  MovingPart part;
  setup.movingShapes = &*shapes;
  setup.movingParts = {&part, swing.radius > 0.0f ? 1u : 0u};
  Result<EglContext> context = EglContext::create();
  if (!context) return fail(context.error().message);
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.movingParts = static_cast<std::uint32_t>(setup.movingParts.size());
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

  Times glTimes, vulkanTimes;
  // In turns, so that what else this machine does meets both.
  for (int i = 0; i < frames + 3; ++i) {
    part.toWorld[3] = swing.middle + 0.1f * swing.radius * std::sin(0.3f * static_cast<float>(i));
    auto start = Clock::now();
    double begin = processMs();
    if (Status lit = gl->relight(setup); !lit) return fail(lit.error().message);
    const double submitted = msSince(start);
    glFinish();
    const double glTime = msSince(start), glProcess = processMs() - begin;
    start = Clock::now();
    begin = processMs();
    double recorded = 0.0;
    Result<GpuFrame> frame = passes->frame(setup);
    if (!frame) return fail(frame.error().message);
    host->run([&](VkCommandBuffer commands) {
      (*executor)->record(commands, *frame);
      recorded = msSince(start);
    });
    // The first frames compile, and have no bounces.
    if (i < 3) continue;
    vulkanTimes.ms.push_back(msSince(start));
    vulkanTimes.process.push_back(processMs() - begin);
    vulkanTimes.submitted.push_back(recorded);
    glTimes.ms.push_back(glTime);
    glTimes.process.push_back(glProcess);
    glTimes.submitted.push_back(submitted);
  }
  std::printf("%u surfels, %u caches, %u links; ms of a frame: median, least, of all threads, and of the calls\n",
              bake.surfels.count(), static_cast<unsigned>(bake.caches.count()), bake.links.count());
  print("OpenGL", context->renderer(), std::move(glTimes));
  print("Vulkan", host->name(), std::move(vulkanTimes));
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  const int frames = argc > 2 ? std::atoi(argv[2]) : 30;
  relume::Swing swing;
  const bool hasBall =
      argc == 5 && std::sscanf(argv[3], "%f,%f,%f", &swing.middle.x, &swing.middle.y, &swing.middle.z) == 3;
  if (hasBall) swing.radius = static_cast<float>(std::atof(argv[4]));
  if (argc < 2 || frames < 1 || (argc > 3 && !(swing.radius > 0.0f)))
    return relume::fail("usage: bench_vulkan_times LEVEL.relume [FRAMES [X,Y,Z RADIUS]]");
  const relume::Result<relume::Bake> bake = relume::mapBake(argv[1]);
  return bake ? relume::measure(*bake, frames, swing) : relume::fail(bake.error().message);
}
