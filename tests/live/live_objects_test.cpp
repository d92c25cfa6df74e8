// SPDX-License-Identifier: MIT
// Textures that grow with a level.
#include "runtime/live_gl/live_objects.h"

#include "tests/runtime/gl_test_support.h"

namespace relume {
namespace {

class LiveObjects : public test::GlTest {};

// Rows beyond those that are wanted are room to grow in, which ends where the driver's textures do.
TEST_F(LiveObjects, rowsHaveRoomUpToTheDriversLimit) {
  const Result<gl::Functions> functions = gl::loadFunctions(EglContext::getProcAddress);
  ASSERT_TRUE(functions);
  GLint most = 0;
  functions->GetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  for (const GLint wanted : {most / 2, most - most / 10, most}) {
    gl::GrowingRows rows(*functions, gl::kWords, 4);
    EXPECT_TRUE(rows.reserve(static_cast<std::uint32_t>(wanted)));
    EXPECT_GE(rows.rows(), static_cast<std::uint32_t>(wanted));
    EXPECT_LE(rows.rows(), static_cast<std::uint32_t>(most));
    GLint height = 0;
    functions->BindTexture(GL_TEXTURE_2D, rows.name());
    functions->GetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_HEIGHT, &height);
    EXPECT_EQ(static_cast<std::uint32_t>(height), rows.rows());
  }
}

}  // namespace
}  // namespace relume
