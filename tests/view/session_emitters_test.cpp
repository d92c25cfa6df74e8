// SPDX-License-Identifier: MIT
// Driven materials of what moves through a baked level: they send what they are shown to emit, as `relume render` has
// it, whoever drives them and whichever backend relights, and cones find them so.
#include "tests/view/session_fixture.h"
#include "tools/render/moving_parts.h"
#include "tools/render/render_cpu.h"

#include <glm/common.hpp>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr glm::vec3 kOwn(40, 8, 4), kBlue(5, 5, 50);

class MovingEmitter : public ViewerSession {
 protected:
  void SetUp() override {
    ViewerSession::SetUp();
    options_.lights = {"none"};
    options_.live.cells = 12;
  }
  // The level, whose toy is of a material that emits, and has a texture.
  Scene glowing() const {
    Scene level = scene();
    Material glow;
    glow.name = "glow";
    glow.albedo = glm::vec3(0.5f);
    glow.emission = kOwn;
    level.materials.push_back(glow);
    for (const Instance& instance : level.instances) {
      if (instance.baked()) continue;
      Mesh& mesh = level.meshes[instance.mesh];
      mesh.material = static_cast<std::uint32_t>(level.materials.size() - 1);
      mesh.uv[0].assign(mesh.position.size(), glm::vec2(0.5f));
    }
    return level;
  }
  // Shown as --emission has it, baked by the first call.
  void show(const std::vector<DrivenMaterial>& driven) {
    if (!fs::exists(at("glow.relume"))) {
      Context context;
      const auto baked = bake(glowing(), small(512), context);
      ASSERT_TRUE(baked) << baked.error().message;
      ASSERT_TRUE(writeBake(*baked, at("glow.relume")));
    }
    options_.bake = at("glow.relume");
    options_.driven = driven;
    Context context;
    const auto level = loadBake(glowing(), {kLevel, options_.bake, {}, false, driven}, context);
    ASSERT_TRUE(level) << level.error().message;
    auto state = initialState((*level)->scene, options_);
    ASSERT_TRUE(state) << state.error().message;
    state->relightBy.backend = backend_;
    session_.emplace(std::move(*state), options_, EglContext::getProcAddress);
    const Status shown = session_->show(*level);
    ASSERT_TRUE(shown) << shown.error().message;
  }
  ViewedEmitter& emitter(const char* name) {
    return *std::ranges::find(session_->state.emitters, name, &ViewedEmitter::name);
  }
  // Mean light over links, where caches far from a lamp that moves have had their turn as well.
  glm::dvec3 light() {
    for (std::uint32_t i = 0; i <= RelightOptions().movingLag; ++i) frame();
    return meanOf(*session_->viewer->irradiance(session_->state, kWidth, kHeight));
  }
  static glm::dvec3 meanOf(const std::vector<glm::vec3>& pixels) {
    glm::dvec3 sum(0.0);
    for (const glm::vec3& pixel : pixels) sum += glm::dvec3(pixel);
    return sum / static_cast<double>(pixels.size());
  }
  // The same by `relume render --dynamic solid`.
  glm::dvec3 rendered(const std::vector<DrivenMaterial>& driven) const {
    Scene level = glowing();
    EXPECT_TRUE(driveScene(level, driven, false));
    const auto shapes = movingShapes(level);
    EXPECT_TRUE(shapes);
    RenderRequest request;
    request.bake = &session_->level->bake;
    request.camera = *std::ranges::find(level.cameras, "cam_living", &Camera::name);
    request.driven = driven;
    request.movingShapes = &*shapes;
    request.movingParts = movingParts(level);
    request.width = kWidth;
    request.height = kHeight;
    request.samples = 1;
    Context context;
    const auto tracer = RayTracer::create(level, "", context, RayStructure::thorough, RayGeometry::drawn);
    EXPECT_TRUE(tracer);
    const auto frame = renderCpu(*tracer, request, context);
    EXPECT_TRUE(frame);
    return meanOf(composeAov(*frame, Aov::indirect));
  }
  static void expectNear(const glm::dvec3& found, const glm::dvec3& expected, double share, const char* what) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], share * expected[c]) << what << ", channel " << c;
  }
  BackendKind backend_ = BackendKind::gl;
};

class MovingEmitterByBackend : public MovingEmitter, public testing::WithParamInterface<BackendKind> {
 protected:
  void SetUp() override {
    MovingEmitter::SetUp();
    backend_ = GetParam();
  }
};

INSTANTIATE_TEST_SUITE_P(Backends, MovingEmitterByBackend, testing::Values(BackendKind::cpu, BackendKind::gl),
                         [](const auto& of) { return std::string(of.param == BackendKind::cpu ? "Cpu" : "OpenGl"); });

TEST_P(MovingEmitterByBackend, sendsWhatItIsShownToEmit) {
  const std::vector<DrivenMaterial> driven{{"glow", kBlue, 0, 0, {}}};
  show(driven);
  session_->state.direct = false;
  const glm::dvec3 blue = light();
  EXPECT_GT(blue.b, 0.01);
  expectNear(blue, rendered(driven), 0.1, "as `relume render` draws it");

  // The slider scales all others: none here.
  emitter("panel").isDriven = true;
  emitter("panel").radiance = glm::vec3(0.0f);
  for (const float emission : {1.0f, 2.5f}) {
    session_->state.emission = emission;
    expectNear(light(), blue, 0.02, "scaled");
  }
  session_->state.emission = 0.0f;
  expectNear(light(), blue, 0.02, "off");
  emitter("panel").isDriven = false;
  expectNear(light(), blue, 0.02, "what is not driven is dark");

  // As the panel has it, and as the level does
  emitter("glow").radiance = 2.0f * kBlue;
  expectNear(light(), 2.0 * blue, 0.02, "twice as bright");
  emitter("glow").isDriven = false;
  EXPECT_LT(light().b, 1e-3 * blue.b);
  session_->state.emission = 0.5f;
  emitter("panel").isDriven = true;
  expectNear(light() / glm::dvec3(0.5f * kOwn), blue / glm::dvec3(kBlue), 0.02, "half its own");
}

// A material that no bake knows may have an image.
TEST_P(MovingEmitterByBackend, sendsItsImage) {
  show({{"glow", kBlue, 0, 0, {}}});
  session_->state.direct = false;
  const glm::dvec3 blue = light();
  show({{"glow", glm::vec3(1.0f), 1, 1, {kBlue}}});
  ASSERT_TRUE(session_->viewer);
  session_->state.direct = false;
  expectNear(light(), blue, 0.02, "an image of one texel");
  emitter("glow").radiance = glm::vec3(3.0f);
  expectNear(light(), 3.0 * blue, 0.02, "by a factor");
}

// Voxels beside a bake: what the panel drives is mirrored as what the command line does.
TEST_F(MovingEmitter, isMirroredAsItIsDriven) {
  options_.view = "glossy";
  options_.roughness = 0.3f;
  options_.cones = true;
  const auto mirrored = [&] {
    session_->state.liveStep = 1.0 / 15.0;
    for (int i = 0; i < 8; ++i) frame();
    return brightness_;
  };
  show({{"glow", kBlue, 0, 0, {}}});
  const double expected = mirrored();
  show({});
  EXPECT_LT(mirrored(), 0.05 * expected);
  emitter("glow").isDriven = true;
  emitter("glow").radiance = kBlue;
  EXPECT_NEAR(mirrored(), expected, 0.02 * expected);
  session_->state.emission = 1.0f;
  emitter("panel").isDriven = true;
  emitter("panel").radiance = glm::vec3(0.0f);
  EXPECT_NEAR(mirrored(), expected, 0.02 * expected);
  // A window that does not wait
  session_->state.liveStep = 0.0;
  emitter("glow").radiance = glm::vec3(0.0f);
  frame();
  ASSERT_TRUE(frames([&] { return !session_->viewer->awaitsVoxels(session_->state); }));
  for (int i = 0; i < 8; ++i) frame();
  EXPECT_LT(brightness_, 0.05 * expected);
}

}  // namespace
}  // namespace relume
