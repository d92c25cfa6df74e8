// SPDX-License-Identifier: MIT
// In a host whose locale writes decimal commas, GLSL holds points and compiles: what hosts include (GlResolve::glsl(),
// in the samples' level shader) and what the backend compiles itself, with the samples' shadow maps in the surfel pass.
#include "relume/relighter.h"
#include "tools/gl_scene/egl_context.h"
#include "tools/gl_scene/level_shader.h"
#include "tools/gl_scene/shadow_maps.h"

#include "tests/comma_locale.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

const char* kMain = "out vec4 color;\nvoid main() { color = vec4(levelLinks(levelPosition, levelNormal()), 1.0); }\n";

TEST(CommaLocale, shadowGlslIsTheSame) {
  const std::string before = ShadowMaps::glsl();
  const test::CommaLocale commas;
  EXPECT_EQ(ShadowMaps::glsl(), before);
  if (!commas.ofC()) GTEST_SKIP() << test::kNoCommaLocale;
}

TEST(CommaLocale, shadersCompileAndAreTheSame) {
  const Result<EglContext> context = EglContext::create({.debug = true});
  if (!context) GTEST_SKIP() << context.error().message;
  const Bake bake = test::makeSyntheticBake({.surfels = 300});
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  const auto resolve = [&] {
    options.visibilityGlsl = ShadowMaps::glsl();
    const Result<Relighter> relighter = Relighter::create(bake, options);
    EXPECT_TRUE(relighter) << (relighter ? "" : relighter.error().message);
    if (!relighter) return std::string();
    const Result<GlProgram> program = makeLevelProgram(&*relighter, kMain);
    EXPECT_TRUE(program) << (program ? "" : program.error().message);
    return relighter->gl()->glsl() + relighter->gl()->surfelGlsl();
  };
  const std::string before = resolve();
  EXPECT_NE(before.find("#define RELUME_SURFEL_RADIUS 0."), std::string::npos);
  const test::CommaLocale commas;
  EXPECT_EQ(resolve(), before);
  if (!commas.ofC()) GTEST_SKIP() << test::kNoCommaLocale;
}

}  // namespace
}  // namespace relume
