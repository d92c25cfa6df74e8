// SPDX-License-Identifier: MIT
// Shadow maps that OpenGL has no room for, and the ones after them.
#include "tools/gl_scene/shadow_maps.h"

#include "tests/rays/make_scene.h"
#include "tests/runtime/gl_test_support.h"

#include <epoxy/gl.h>

#include <vector>

namespace relume {
namespace {

class ShadowMapsOnGl : public test::GlTest {};

TEST_F(ShadowMapsOnGl, thatDoNotFitAreRefusedEachTime) {
  Scene scene;
  test::addInstance(scene, test::quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}));
  test::finish(scene);
  const auto level = GlLevel::create(scene, nullptr);
  ASSERT_TRUE(level) << level.error().message;
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  auto maps = ShadowMaps::create(2 * static_cast<std::uint32_t>(most));
  ASSERT_TRUE(maps) << maps.error().message;
  const std::vector<Light> sun{{.kind = LightKind::directional, .direction = {0, -1, 0}}};
  for (int i = 0; i < 2; ++i) {
    const Status refused = maps->update(*level, sun);
    ASSERT_FALSE(refused) << "call " << i;
    EXPECT_EQ(refused.error().code, ErrorCode::failed);
    EXPECT_NE(refused.error().message.find("no memory for 1 shadow maps"), std::string::npos)
        << refused.error().message;
  }
  EXPECT_TRUE(maps->update(*level, {})) << "which needs none";
  context_->forgetErrors();  // the driver's of textures that large
}

}  // namespace
}  // namespace relume
