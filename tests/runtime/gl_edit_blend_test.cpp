// SPDX-License-Identifier: MIT
// EditBlend::glsl() against EditBlend::share() and blendEdited().
#include "relume/edit_blend.h"
#include "tests/runtime/gl_test_support.h"

#include <epoxy/gl.h>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <random>

namespace relume {
namespace {

using EditBlendsOnGl = test::GlTest;

TEST_F(EditBlendsOnGl, areThoseOfTheCpu) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> metres(-4.0f, 8.0f), some(0.0f, 1.0f);
  std::vector<EditBounds> boxes;
  for (std::uint32_t i = 0; i < kMaxEditBoxes; ++i) {
    const glm::vec3 low(metres(random), metres(random), metres(random));
    boxes.push_back({low, low + glm::vec3(some(random), some(random), some(random))});
  }
  for (const std::uint32_t count : {0u, 1u, kMaxEditBoxes}) {
    const auto blend = EditBlend::create(std::span(boxes).first(count), {.voxel = 0.2f, .reach = 0.5f, .fade = 1.0f});
    ASSERT_TRUE(blend);
    constexpr std::size_t kPlaces = 4000;
    std::vector<float> in, expected;
    int counting = 0;
    for (std::size_t i = 0; i < kPlaces; ++i) {
      const glm::vec3 at(metres(random), metres(random), metres(random));
      std::array<glm::vec3, 3> light{};
      for (glm::vec3& l : light) l = {some(random), some(random), some(random) < 0.3f ? 0.0f : some(random)};
      for (const glm::vec3& v : {at, light[0], light[1], light[2]}) in.insert(in.end(), {v.x, v.y, v.z});
      const EditShare share = blend->share(at);
      const glm::vec3 blended = blendEdited(light[0], light[1], light[2], share);
      expected.insert(expected.end(), {share.change, share.contact, blended.x, blended.y, blended.z});
      counting += share.change > 0.0f && share.change < 1.0f ? 1 : 0;
    }
    EXPECT_GE(counting, count > 0 ? 20 : 0);
    const std::vector<float> found = test::runCompute(
        EditBlend::glsl(),
        "vec3 v[4];\n"
        "for (uint k = 0u; k < 4u; ++k) v[k] = vec3(inData[12u * i + 3u * k], inData[12u * i + 3u * k + 1u], "
        "inData[12u * i + 3u * k + 2u]);\n"
        "vec2 share = relumeEditShare(v[0]);\n"
        "vec3 e = relumeBlendEdited(v[1], v[2], v[3], share);\n"
        "outData[5u * i] = share.x; outData[5u * i + 1u] = share.y;\n"
        "outData[5u * i + 2u] = e.x; outData[5u * i + 3u] = e.y; outData[5u * i + 4u] = e.z;\n",
        in, kPlaces, 5 * kPlaces, [&](std::uint32_t program) {
          const std::span<const glm::vec4> uniforms = blend->boxes();
          glProgramUniform1i(program, glGetUniformLocation(program, "relumeEditBoxes"),
                             static_cast<int>(uniforms.size() / 2));
          glProgramUniform1f(program, glGetUniformLocation(program, "relumeEditVoxel"), blend->voxel());
          if (!uniforms.empty())
            glProgramUniform4fv(program, glGetUniformLocation(program, "relumeEditBox"),
                                static_cast<GLsizei>(uniforms.size()), glm::value_ptr(uniforms[0]));
        });
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], expected[i], 2e-5f) << i;
  }
}

}  // namespace
}  // namespace relume
