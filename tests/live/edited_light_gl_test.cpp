// SPDX-License-Identifier: MIT
// A shader of a game's that reads a bake and the live light before and after an edit, by names and texture units of the
// game's choice: it finds what the CPU does.
#include "relume/edit_blend.h"
#include "relume/live_light.h"

#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/some_lights.h"
#include "tests/voxels/boxes.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

namespace relume {
namespace {

using namespace test;

class EditedLightOnGl : public GlTest {
 protected:
  static LiveLightOptions named(const std::string& prefix, const std::array<std::uint32_t, 3>& units) {
    LiveLightOptions options;
    options.backend = BackendKind::gl;
    options.cells = 12;
    options.getProcAddress = EglContext::getProcAddress;
    options.glNames = {prefix, units};
    return options;
  }
};

TEST_F(EditedLightOnGl, isThatOfTheCpu) {
  SyntheticOptions small;
  small.surfels = 256;
  const Bake bake = makeSyntheticBake(small);
  const CacheGrid& grid = bake.caches.grid;
  const glm::vec3 low = grid.originWorld, size = grid.spacing * glm::vec3(grid.resolution - 1u), high = low + size;
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(0.6f, 0.5f, 0.4f)};
  level.addBox(low - 0.02f * size, high + 0.02f * size, true);
  level.addBox(low + glm::vec3(0.3f, 0.0f, 0.0f) * size, low + glm::vec3(0.34f, 0.6f, 1.0f) * size, false);

  const std::array<Light, 2> lights = lampAndSun();
  LightSetup setup;
  setup.lights = lights;
  Relighter relighter = makeRelighter(bake, BackendKind::gl);
  ASSERT_TRUE(relighter.relight(setup));
  auto before = LiveLight::create(level.geometry(), named("relumeBefore", {19, 20, 21}));
  auto after = LiveLight::create(level.geometry(), named("now_", {24, 22, 23}));
  ASSERT_TRUE(before) << before.error().message;
  ASSERT_TRUE(after) << after.error().message;
  glm::mat4x3 moved(1.0f);
  moved[3].x = 0.3f * size.x;
  ASSERT_TRUE(after->edit(std::vector<PartEdit>{{1, moved, true}}));
  for (std::uint32_t f = 0; f < 4; ++f) {
    LiveFrame frame;
    frame.raySet = f;
    ASSERT_TRUE(before->update(setup, frame));
    ASSERT_TRUE(after->update(setup, frame));
  }
  std::vector<EditBounds> boxes;
  for (const float x : {0.3f, 0.6f})
    boxes.push_back({low + glm::vec3(x, 0.0f, 0.0f) * size, low + glm::vec3(x + 0.04f, 0.6f, 1.0f) * size});
  const float longest = std::max({size.x, size.y, size.z});
  const auto blend =
      EditBlend::create(boxes, {.voxel = longest / 48.0f, .reach = 0.1f * size.x, .fade = 0.1f * size.x});
  ASSERT_TRUE(blend);

  constexpr std::size_t kPlaces = 1000;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> in(0.02f, 0.98f);
  std::vector<float> places;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const glm::vec3 p = low + glm::vec3(in(random), in(random), in(random)) * size, n = unit(random);
    places.insert(places.end(), {p.x, p.y, p.z, n.x, n.y, n.z});
  }
  relighter.gl()->bind();
  before->gl()->bind();
  after->gl()->bind();
  const std::vector<float> found =
      runCompute(relighter.gl()->glsl() + before->gl()->glsl() + after->gl()->glsl() + EditBlend::glsl(),
                 "  vec3 p = vec3(inData[6u * i], inData[6u * i + 1u], inData[6u * i + 2u]);\n"
                 "  vec3 n = vec3(inData[6u * i + 3u], inData[6u * i + 4u], inData[6u * i + 5u]);\n"
                 "  vec3 e = relumeIrradianceGrid(p, n);\n"
                 "  vec2 share = relumeEditShare(p);\n"
                 "  if (share.x > 0.0)\n"
                 "    e = relumeBlendEdited(e, relumeBeforeIrradiance(p, n), now_Irradiance(p, n), share);\n"
                 "  for (int k = 0; k < 3; ++k) outData[3u * i + uint(k)] = e[k];\n",
                 places, kPlaces, 3 * kPlaces, [&](std::uint32_t program) {
                   ASSERT_TRUE(before->gl()->setUniforms(program));
                   ASSERT_TRUE(after->gl()->setUniforms(program));
                   const std::span<const glm::vec4> uniforms = blend->boxes();
                   glProgramUniform1i(program, glGetUniformLocation(program, "relumeEditBoxes"),
                                      static_cast<int>(uniforms.size() / 2));
                   glProgramUniform1f(program, glGetUniformLocation(program, "relumeEditVoxel"), blend->voxel());
                   glProgramUniform4fv(program, glGetUniformLocation(program, "relumeEditBox"),
                                       static_cast<GLsizei>(uniforms.size()), glm::value_ptr(uniforms[0]));
                 });

  std::size_t off = 0, untouched = 0, changed = 0;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const glm::vec3 p = glm::make_vec3(&places[6 * i]), n = glm::make_vec3(&places[6 * i + 3]);
    const glm::vec3 baked = relighter.irradianceInGrid(p, n);
    const EditShare share = blend->share(p);
    const glm::vec3 expected = blendEdited(baked, before->irradiance(p, n), after->irradiance(p, n), share);
    const bool isOff = glm::distance(glm::make_vec3(&found[3 * i]), expected) > 5e-3f * glm::length(expected) + 1e-4f;
    off += isOff ? 1 : 0;
    untouched += share.change == 0.0f ? 1 : 0;
    changed += glm::distance(baked, expected) > 0.1f * glm::length(baked) ? 1 : 0;
  }
  EXPECT_LE(off, kPlaces / 200);  // a ray that grazes a voxel may pass on one and not on the other
  EXPECT_GT(untouched, kPlaces / 10);
  EXPECT_GT(changed, kPlaces / 10);
}

TEST_F(EditedLightOnGl, badNamesAndUnitsAreNamed) {
  VoxelLevel level;
  level.addBox({0, 0, 0}, {4, 4, 4}, true);
  int most = 0;
  glGetIntegerv(GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS, &most);
  const auto last = static_cast<std::uint32_t>(most) - 1;
  const auto refused = [&](const std::string& prefix, const std::array<std::uint32_t, 3>& units,
                           const std::string& what) {
    const auto light = LiveLight::create(level.geometry(), named(prefix, units));
    ASSERT_FALSE(light) << prefix;
    EXPECT_EQ(light.error().code, ErrorCode::usage);
    EXPECT_NE(light.error().message.find(what), std::string::npos) << light.error().message;
  };
  for (const char* prefix : {"", "gl_Live", "2nd", "_before", "be-fore", "before__", "be fore", "lumière"})
    refused(prefix, {0, 1, 2}, std::string("glNames.prefix is \"") + prefix);
  refused(std::string(65, 'a'), {0, 1, 2}, "glNames.prefix");
  refused("before", {3, 4, 3}, "unit 3 twice");
  refused("before", {last + 1, 4, 5}, "unit " + std::to_string(most));
  refused("before", {1, 2, 0xFFFFFFFFu}, "unit 4294967295");
  EXPECT_TRUE(LiveLight::create(level.geometry(), named("relumeLiveOfMyOwn", {0, 1, last})));
}

// Two texts that are right each by itself, and read each other's textures.
TEST_F(EditedLightOnGl, textureUnitsThatTwoHaveAreNamed) {
  VoxelLevel level;
  level.addBox({0, 0, 0}, {4, 4, 4}, true);
  SyntheticOptions small;
  small.surfels = 64;
  Relighter relighter = makeRelighter(makeSyntheticBake(small), BackendKind::gl);
  // What the light with names of its own says of a shader with its text, `others` and `body`.
  const auto said = [&](const std::array<std::uint32_t, 3>& units, const std::string& others, const std::string& body) {
    const auto light = LiveLight::create(level.geometry(), named("relumeBefore", units));
    EXPECT_TRUE(light);
    std::string message;
    runCompute(others + light->gl()->glsl(),
               "  vec3 p = vec3(1.0), n = vec3(0.0, 1.0, 0.0);\n  outData[0] = (relumeBeforeIrradiance(p, n) + " +
                   body + ").x;\n",
               {0.0f}, 1, 1, [&](std::uint32_t program) {
                 for (int call = 0; call < 2; ++call) {
                   const Status set = light->gl()->setUniforms(program);
                   message = set ? "" : set.error().message;
                   EXPECT_TRUE(set || set.error().code == ErrorCode::usage);
                 }
               });
    return message;
  };
  const auto names = [](const std::string& message, const char* sampler, const char* own) {
    return message.find(sampler) != std::string::npos && message.find(own) != std::string::npos;
  };
  // A bake's light map has units 12 to 15; what the shader does not read has none.
  const std::string& bake = relighter.gl()->glsl();
  const char* const map = "relumeIrradianceLightmap(vec2(0.5), n)";
  const std::string shared = said({12, 20, 21}, bake, map);
  EXPECT_TRUE(names(shared, "relumeLightmap", "unit 12")) << shared;
  EXPECT_TRUE(names(shared, "of relumeBeforeCells", "glNames.textureUnits")) << shared;
  EXPECT_EQ(said({19, 20, 21}, bake, map), "");
  EXPECT_EQ(said({12, 20, 21}, bake, "vec3(0.0)"), "");
  // Another light, with a prefix of its own and the default units.
  const auto other = LiveLight::create(level.geometry(), named("relumeLive", {12, 13, 14}));
  ASSERT_TRUE(other);
  const std::string twins = said({20, 21, 14}, other->gl()->glsl(), "relumeLiveIrradiance(p, n)");
  EXPECT_TRUE(names(twins, "sampler relumeLiveLight has texture unit 14", "of relumeBeforeLight")) << twins;
  EXPECT_EQ(said({20, 21, 22}, other->gl()->glsl(), "relumeLiveIrradiance(p, n)"), "");
  // Arrays of samplers, of which each has a unit. Without comparisons: of textures that have no depth, as here, drivers
  // that run shaders tell that those are undefined.
  const std::string array = "layout(binding = 7) uniform sampler2D shadowMaps[3];\n";
  const std::string third =
      said({20, 9, 22}, array, "texture(shadowMaps[0], p.xy).xyz + texture(shadowMaps[2], p.xy).xyz");
  EXPECT_TRUE(names(third, "shadowMaps[2]", "of relumeBeforeSubVoxels")) << third;
}

// A program of another text under a name from before: linked anew here, as not every OpenGL gives names again.
TEST_F(EditedLightOnGl, aNameThatIsUsedAgainIsCheckedAgain) {
  VoxelLevel level;
  level.addBox({0, 0, 0}, {4, 4, 4}, true);
  auto light = LiveLight::create(level.geometry(), named("relumeBefore", {20, 9, 22}));
  ASSERT_TRUE(light && light->update({}, {}));
  const GLuint program = glCreateProgram();
  const auto link = [&](const std::string& others, const std::string& body) {
    linkCompute(program, "#version 430 core\n" + others + light->gl()->glsl() +
                             "layout(local_size_x = 1) in;\n"
                             "layout(std430, binding = 1) writeonly buffer Out { float outData[]; };\n"
                             "void main() {\n  vec3 p = vec3(1.0), n = vec3(0.0, 1.0, 0.0);\n"
                             "  outData[0] = (relumeBeforeIrradiance(p, n) + " +
                             body + ").x;\n}\n");
  };
  link("", "vec3(0.0)");
  EXPECT_TRUE(light->gl()->setUniforms(program));
  EXPECT_TRUE(light->gl()->setUniforms(program));
  link("layout(binding = 9) uniform sampler2D other;\n", "texture(other, vec2(0.5)).xyz");
  EXPECT_FALSE(light->gl()->setUniforms(program));
  glDeleteProgram(program);
}

// And leaves no error of OpenGL pending.
TEST_F(EditedLightOnGl, whatIsNoLinkedProgramIsRefused) {
  VoxelLevel level;
  level.addBox({0, 0, 0}, {4, 4, 4}, true);
  auto light = LiveLight::create(level.geometry(), named("relumeBefore", {20, 9, 22}));
  ASSERT_TRUE(light && light->update({}, {}));
  const auto expectRefused = [&](GLuint program) {
    const Status set = light->gl()->setUniforms(program);
    ASSERT_FALSE(set) << program;
    EXPECT_EQ(set.error().code, ErrorCode::usage);
    EXPECT_EQ(set.error().message, "live light: program " + std::to_string(program) + " is not a linked program");
    EXPECT_EQ(glGetError(), GLenum{GL_NO_ERROR}) << program;
  };
  expectRefused(0);
  expectRefused(98765);
  const GLuint program = glCreateProgram(), shader = glCreateShader(GL_COMPUTE_SHADER);
  expectRefused(program);
  expectRefused(shader);
  glDeleteShader(shader);
  ASSERT_TRUE(
      linkCompute(program, "#version 430 core\n" + light->gl()->glsl() +
                               "layout(local_size_x = 1) in;\n"
                               "layout(std430, binding = 1) writeonly buffer Out { float outData[]; };\n"
                               "void main() { outData[0] = relumeBeforeIrradiance(vec3(1.0), vec3(1.0)).x; }\n"));
  EXPECT_TRUE(light->gl()->setUniforms(program));
  glDeleteProgram(program);
  expectRefused(program);
}

}  // namespace
}  // namespace relume
