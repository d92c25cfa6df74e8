// SPDX-License-Identifier: MIT
// relume/edit_blend.h: where an edit counts, what it changes, and what is refused.
#include "relume/edit_blend.h"

#include "tests/comma_locale.h"

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr EditBlendOptions kMetres{.voxel = 0.1f, .reach = 2.0f, .fade = 1.0f};

EditBlend madeEdit(const std::vector<EditBounds>& boxes, const EditBlendOptions& options = kMetres) {
  auto blend = EditBlend::create(boxes, options);
  EXPECT_TRUE(blend) << blend.error().message;
  return std::move(*blend);
}

void expectEditRefused(const EditBounds& box, const EditBlendOptions& options, const std::string& word) {
  const auto blend = EditBlend::create(std::vector<EditBounds>{{}, {}, box}, options);
  ASSERT_FALSE(blend) << word;
  EXPECT_EQ(blend.error().code, ErrorCode::usage);
  EXPECT_NE(blend.error().message.find(word), std::string::npos) << blend.error().message;
}

}  // namespace

TEST(EditBlends, countInFullWithinReachAndNotAtAllBeyondTheFade) {
  const EditBlend blend = madeEdit({{{0, 0, 0}, {1, 1, 1}}});
  for (const glm::vec3& at : {glm::vec3(0.5f), glm::vec3(0, 1, 0.3f), glm::vec3(2.999f, 0.5f, 0.5f)})
    EXPECT_EQ(blend.share(at).change, 1.0f);
  EXPECT_NEAR(blend.share({3.5f, 0.5f, 0.5f}).change, 0.5f, 1e-5f);
  for (const glm::vec3& at : {glm::vec3(4.001f, 0, 0), glm::vec3(0, -3.001f, 0), glm::vec3(1e7f)})
    EXPECT_EQ(blend.share(at).change, 0.0f);
  EXPECT_EQ(blend.share({0.5f, 1.09f, 0.5f}).contact, 1.0f);
  EXPECT_NEAR(blend.share({0.5f, 1.2f, 0.5f}).contact, 0.5f, 1e-5f);
  EXPECT_EQ(blend.share({0.5f, 1.301f, 0.5f}).contact, 0.0f);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(blend.share({nan, 0, 0}).change, 0.0f);
  EXPECT_EQ(blend.share({nan, 0, 0}).contact, 0.0f);
  EXPECT_EQ(EditBlend().share(glm::vec3(0.0f)).change, 0.0f);
  EXPECT_TRUE(EditBlend().isEmpty());
}

// Reach and fade that are not given grow with the part, and with the voxels where parts are small beside them.
TEST(EditBlends, reachFollowsThePartAndTheVoxels) {
  const float half = 0.5f * std::sqrt(3.0f);  // of the diagonal
  const EditBlend large = madeEdit({{{0, 0, 0}, {1, 1, 1}}}, {.voxel = 0.01f});
  EXPECT_EQ(large.share({1.0f + 0.99f * kEditReach * half, 0, 0}).change, 1.0f);
  EXPECT_LT(large.share({1.0f + 1.01f * kEditReach * half, 0, 0}).change, 1.0f);
  EXPECT_EQ(large.share({1.0f + 2.01f * kEditReach * half, 0, 0}).change, 0.0f);
  const EditBlend small = madeEdit({{{0, 0, 0}, {0, 0, 0}}}, {.voxel = 0.5f});
  EXPECT_EQ(small.share({3.99f, 0, 0}).change, 1.0f);
  EXPECT_EQ(small.share({8.01f, 0, 0}).change, 0.0f);
}

// A step of a millimetre changes no more than the steepest of both curves, 1.5 over their widths.
// Of a part that emits, also where its box is joined with others.
TEST(EditBlends, reachIsThatOfTheBoxAtLeast) {
  std::vector<EditBounds> boxes{{{0, 0, 0}, {0.1f, 0.1f, 0.1f}, 20.0f}};
  EXPECT_EQ(madeEdit(boxes).share({19, 0, 0}).change, 1.0f);
  EXPECT_EQ(madeEdit(boxes, {.voxel = 0.1f}).share({19, 0, 0}).change, 1.0f);
  boxes.front().reach = 1.0f;
  EXPECT_EQ(madeEdit(boxes).share({2, 0, 0}).change, 1.0f) << "the options' is farther";
  boxes.assign(kMaxEditBoxes + 1, {{0, 0, 0}, {0, 0, 0}});
  boxes.back().reach = 20.0f;
  EXPECT_EQ(madeEdit(boxes).share({19, 0, 0}).change, 1.0f);
}

TEST(EditBlends, sharesAreContinuous) {
  const EditBlend blend = madeEdit({{{0, 0, 0}, {1, 2, 3}}, {{4, 0, 0}, {4.5f, 1, 1}}, {{1, 1, 1}, {1, 1, 1}}});
  std::mt19937 random(1);
  std::uniform_real_distribution<float> metres(-6.0f, 9.0f);
  constexpr float kStep = 1e-3f;
  for (int line = 0; line < 40; ++line) {
    glm::vec3 at(metres(random), metres(random), metres(random));
    const glm::vec3 along = kStep * glm::normalize(glm::vec3(metres(random), metres(random), metres(random)) - at);
    for (int i = 0; i < 4000; ++i) {
      const EditShare before = blend.share(at), after = blend.share(at + along);
      at += along;
      ASSERT_LE(std::abs(after.change - before.change), 1.6f * kStep);
      ASSERT_LE(std::abs(after.contact - before.contact), 8.0f * kStep);
    }
  }
}

TEST(EditBlends, lightIsTheBakesToTheBitWhereNothingCountsOrChanges) {
  std::mt19937 random(2);
  std::lognormal_distribution<float> light(-2.0f, 3.0f);
  const auto some = [&] { return glm::vec3(light(random), light(random), light(random)); };
  for (int i = 0; i < 2000; ++i) {
    const glm::vec3 baked = some(), before = some(), after = some();
    EXPECT_EQ(blendEdited(baked, before, after, {}), baked);
    EXPECT_EQ(blendEdited(baked, before, before, {0.7f, 0.0f}), baked);
    EXPECT_EQ(blendEdited(baked, before, after, kEditedPart), after);
    const glm::vec3 blended = blendEdited(baked, before, after, {light(random) < 0.1f ? 1.0f : 0.5f, 0.2f});
    EXPECT_TRUE(glm::all(glm::greaterThanEqual(blended, glm::vec3(0.0f))));
    EXPECT_TRUE(glm::all(glm::lessThanEqual(blended, 1.001f * (baked + after))));
  }
}

// What is lost scales the bake's light, whatever live light makes of its level; what is gained is added.
TEST(EditBlends, lossesScaleAndGainsAdd) {
  const EditShare all{1.0f, 0.0f};
  EXPECT_NEAR(blendEdited(glm::vec3(2.0f), glm::vec3(3.0f), glm::vec3(0.75f), all).x, 0.54f, 0.02f);
  EXPECT_NEAR(blendEdited(glm::vec3(2.0f), glm::vec3(0.5f), glm::vec3(1.5f), all).x, 3.0f, 1e-5f);
  EXPECT_NEAR(blendEdited(glm::vec3(0.0f), glm::vec3(0.0f), glm::vec3(1.5f), all).x, 1.5f, 1e-5f);
  // Live light that hardly sees what the bake has says little of it.
  EXPECT_GT(blendEdited(glm::vec3(2.0f), glm::vec3(1e-3f), glm::vec3(0.0f), all).x, 1.9f);
}

// More boxes than shaders have room for are joined: each keeps its change.
TEST(EditBlends, manyBoxesAreJoined) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> metres(0.0f, 50.0f);
  std::vector<EditBounds> boxes;
  for (int i = 0; i < 500; ++i) {
    const glm::vec3 low(metres(random), metres(random), metres(random));
    boxes.push_back({low, low + 0.1f * glm::vec3(metres(random))});
  }
  const EditBlend blend = madeEdit(boxes);
  EXPECT_EQ(blend.boxes().size(), 2 * std::size_t{kMaxEditBoxes});
  for (const EditBounds& box : boxes) {
    EXPECT_EQ(blend.share(box.min).change, 1.0f);
    EXPECT_EQ(blend.share(box.max).change, 1.0f);
  }
}

TEST(EditBlends, refuseWhatIsNoBoxOrNoLength) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  const EditBounds box{{0, 0, 0}, {1, 1, 1}};
  expectEditRefused({{nan, 0, 0}, {1, 1, 1}}, kMetres, "box 2");
  expectEditRefused({{0, 0, 0}, {1, infinity, 1}}, kMetres, "box 2");
  expectEditRefused({{0, 0, 2}, {1, 1, 1}}, kMetres, "box 2");
  expectEditRefused({{0, 0, 0}, {1, 1, 2e8f}}, kMetres, "box 2");
  expectEditRefused({{0, 0, 0}, {1, 1, 1}, -1.0f}, kMetres, "box 2 has reach");
  expectEditRefused({{0, 0, 0}, {1, 1, 1}, nan}, kMetres, "box 2 has reach");
  expectEditRefused(box, {.voxel = 0.0f}, "voxel");
  expectEditRefused(box, {.voxel = nan}, "voxel");
  expectEditRefused(box, {.voxel = 0.1f, .reach = -1.0f}, "reach");
  expectEditRefused(box, {.voxel = 0.1f, .fade = infinity}, "fade");
}

TEST(EditBlends, lightUpTo1e38StaysFinite) {
  for (const float baked : {0.0f, 1e-38f, 1.0f, 1e38f}) {
    for (const float before : {0.0f, 1e-38f, 1.0f, 1e38f}) {
      for (const float after : {0.0f, 1e-38f, 1.0f, 1e38f}) {
        for (const EditShare& share : {EditShare{0.5f, 0.0f}, EditShare{1.0f, 0.5f}, kEditedPart}) {
          const glm::vec3 light = blendEdited(glm::vec3(baked), glm::vec3(before), glm::vec3(after), share);
          ASSERT_TRUE(std::isfinite(light.x) && light.x >= 0.0f) << baked << ' ' << before << ' ' << after;
        }
      }
    }
  }
}

// A host whose locale writes 0,5 gets the same text.
TEST(EditBlends, shadersAndErrorsDoNotFollowTheLocale) {
  const auto texts = [] {
    const auto refused = EditBlend::create({}, {.voxel = 0.1f, .reach = -0.25f, .fade = 1.0f});
    EXPECT_FALSE(refused);
    return EditBlend::glsl() + refused.error().message;
  };
  const std::string expected = texts();
  EXPECT_NE(expected.find("#define RELUME_EDIT_LEAST 0.05\n"), std::string::npos);
  EXPECT_NE(expected.find("reach is -0.25 m"), std::string::npos);
  const test::CommaLocale commas;
  if (!commas.ofC()) GTEST_SKIP() << test::kNoCommaLocale;
  EXPECT_EQ(texts(), expected);
}

}  // namespace relume
