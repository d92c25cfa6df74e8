// SPDX-License-Identifier: MIT
// See pictures.h.
#include "tests/render/pictures.h"

#include "tools/render/render_cpu.h"
#ifdef RELUME_RENDER_GL
#include "tools/render/render_gl.h"
#endif

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume::test {
namespace {

const char* kLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";

}  // namespace

const Scene& level() {
  static const Scene scene = [] {
    Context context;
    auto imported = importGltf(kLevel, context);
    EXPECT_TRUE(imported) << imported.error().message;
    return std::move(*imported);
  }();
  return scene;
}

Bake bakeDraft(const Scene& scene) {
  BakeOptions options = presetOptions(Preset::draft);
  options.caches.lightmapCaches = 2500;
  Context context;
  auto made = bake(scene, options, context);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made);
}

const Bake& levelBake() {
  static const Bake made = bakeDraft(level());
  return made;
}

const Camera& camera(const Scene& scene, const std::string& name) {
  return *std::find_if(scene.cameras.begin(), scene.cameras.end(), [&](const Camera& c) { return c.name == name; });
}

RenderRequest request(const Scene& scene, const Bake* made, const std::string& cameraName) {
  RenderRequest r;
  r.bake = made;
  r.camera = camera(scene, cameraName);
  r.lights = scene.lights;
  r.emissive = true;
  r.sky.radiance = {0.5f, 0.7f, 1.0f};
  r.width = 128;
  r.height = 72;
  r.samples = 2;
  r.straight = true;
  r.centres = true;
  return r;
}

Result<RenderedFrame> drawCpu(const Scene& scene, const RenderRequest& r, int threads) {
  Context context;
  context.threads = threads;
  auto tracer = RayTracer::create(scene, "avx2", context, RayStructure::thorough, RayGeometry::drawn);
  if (!tracer) return tracer.error();
  return renderCpu(*tracer, r, context);
}

#ifdef RELUME_RENDER_GL
std::optional<DrawnTwice> drawTwice(const Scene& scene, const RenderRequest& r) {
  Context context;
  auto gl = renderGl(scene, r, context);
  if (!gl) {
    const Error& error = gl.error();
    if (error.code == ErrorCode::unsupported) [&] { GTEST_SKIP() << error.message; }();
    EXPECT_EQ(error.code, ErrorCode::unsupported) << error.message;
    return std::nullopt;
  }
  auto cpu = drawCpu(scene, r);
  EXPECT_TRUE(cpu) << cpu.error().message;
  if (!cpu) return std::nullopt;
  return DrawnTwice{std::move(*cpu), std::move(*gl)};
}
#endif

double relativeRms(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  double squared = 0.0, mean = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const glm::vec3 d = a[i] - b[i];
    squared += glm::dot(d, d) / 3.0;
    mean += (a[i].r + a[i].g + a[i].b) / 3.0;
  }
  const auto n = static_cast<double>(a.size());
  return std::sqrt(squared / n) / (mean / n);
}

double total(const std::vector<glm::vec3>& image) {
  double sum = 0.0;
  for (const glm::vec3& p : image) sum += p.r + p.g + p.b;
  return sum;
}

std::vector<glm::vec3> blocks(const std::vector<glm::vec3>& image, std::uint32_t width) {
  std::vector<glm::vec3> out(image.size() / 64, glm::vec3(0.0f));
  for (std::size_t i = 0; i < image.size(); ++i) out[i / width / 8 * (width / 8) + i % width / 8] += image[i] / 64.0f;
  return out;
}

}  // namespace relume::test
