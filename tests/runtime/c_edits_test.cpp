// SPDX-License-Identifier: MIT
// relume_edit_blend_... of relume_live.h say what edit_blend.h does, and refuse what they should with a text.
#include "relume/edit_blend.h"
#include "relume/relume_live.h"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr float kNanOfEdits = std::numeric_limits<float>::quiet_NaN();

class CEdits : public testing::Test {
 protected:
  void SetUp() override {
    relume_context_desc describe{};
    describe.struct_size = sizeof describe;
    describe.api_version = RELUME_API_VERSION;
    ASSERT_EQ(relume_context_create(&describe, &host_), RELUME_OK);
    desc_.struct_size = sizeof desc_;
    desc_.boxes = boxes_.data();
    desc_.box_count = boxes_.size();
    desc_.voxel = 0.1f;
    desc_.reach = 0.5f;
    desc_.fade = 1.0f;
  }
  void TearDown() override {
    relume_edit_blend_destroy(blend_);
    relume_context_destroy(host_);
  }
  void makeBlend() {
    ASSERT_EQ(relume_edit_blend_create(host_, &desc_, &blend_), RELUME_OK) << relume_context_error(host_);
  }

  std::array<relume_edit_box, 2> boxes_{{{{0, 0, 0}, {1, 2, 1}}, {{3, 0, 0}, {4, 2, 1.5f}}}};
  relume_edit_blend_desc desc_{};
  relume_context* host_ = nullptr;
  relume_edit_blend* blend_ = nullptr;
};

TEST_F(CEdits, boxesReachAsFarAsTheySay) {
  const std::array<float, 2> reaches{0.0f, 9.0f};
  desc_.box_reaches = reaches.data();
  ASSERT_NO_FATAL_FAILURE(makeBlend());
  const std::array<float, 6> positions{-5, 0, 0, 12, 0, 0};
  std::array<float, 4> shares{};
  ASSERT_EQ(relume_edit_blend_share(blend_, 2, positions.data(), shares.data()), RELUME_OK);
  EXPECT_EQ(shares[0], 1.0f) << "of the second box, eight metres off";
  EXPECT_EQ(shares[2], 1.0f);
}

TEST_F(CEdits, sharesAndLightAreTheCppApis) {
  ASSERT_NO_FATAL_FAILURE(makeBlend());
  const auto same = EditBlend::create(std::vector<EditBounds>{{{0, 0, 0}, {1, 2, 1}}, {{3, 0, 0}, {4, 2, 1.5f}}},
                                      {.voxel = 0.1f, .reach = 0.5f, .fade = 1.0f});
  ASSERT_TRUE(same);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> metres(-2.0f, 6.0f), some(0.0f, 3.0f);
  constexpr std::size_t kPlaces = 500;
  std::vector<float> positions(3 * kPlaces), baked(3 * kPlaces), before(3 * kPlaces), after(3 * kPlaces);
  for (float& x : positions) x = metres(random);
  for (std::vector<float>* light : {&baked, &before, &after}) {
    for (float& x : *light) x = some(random);
  }
  std::vector<float> shares(2 * kPlaces), found(baked);
  ASSERT_EQ(relume_edit_blend_share(blend_, kPlaces, positions.data(), shares.data()), RELUME_OK);
  ASSERT_EQ(relume_edit_blend_irradiance(blend_, kPlaces, shares.data(), found.data(), before.data(), after.data(),
                                         found.data()),
            RELUME_OK);
  const auto at = [](const std::vector<float>& v, std::size_t i) {
    return glm::vec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
  };
  std::size_t fading = 0;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const EditShare share = same->share(at(positions, i));
    EXPECT_EQ(shares[2 * i], share.change);
    EXPECT_EQ(shares[2 * i + 1], share.contact);
    EXPECT_EQ(at(found, i), blendEdited(at(baked, i), at(before, i), at(after, i), share));
    fading += share.change > 0.0f && share.change < 1.0f ? 1 : 0;
  }
  EXPECT_GT(fading, 20u);

  EXPECT_EQ(relume_edit_blend_glsl(blend_), EditBlend::glsl());
  relume_edit_blend_info info{};
  info.struct_size = sizeof info;
  ASSERT_EQ(relume_edit_blend_get_info(blend_, &info), RELUME_OK);
  EXPECT_EQ(info.boxes, 2u);
  EXPECT_EQ(info.voxel, 0.1f);
  EXPECT_EQ(std::memcmp(info.values, same->boxes().data(), same->boxes().size_bytes()), 0);
}

TEST_F(CEdits, whereNothingHasChangedLightIsTheBakes) {
  desc_.boxes = nullptr;
  desc_.box_count = 0;
  desc_.struct_size = offsetof(relume_edit_blend_desc, reach);  // of a host that knows of no more
  ASSERT_NO_FATAL_FAILURE(makeBlend());
  const float position[3] = {0.5f, 0.5f, 0.5f}, baked[3] = {1, 2, 3}, none[3] = {-1, kNanOfEdits, 1e30f};
  float share[2] = {7, 7}, found[3] = {};
  ASSERT_EQ(relume_edit_blend_share(blend_, 1, position, share), RELUME_OK);
  EXPECT_EQ(share[0], 0.0f);
  EXPECT_EQ(share[1], 0.0f);
  ASSERT_EQ(relume_edit_blend_irradiance(blend_, 1, share, baked, none, none, found), RELUME_OK);
  EXPECT_EQ(std::memcmp(found, baked, sizeof found), 0);
  relume_edit_blend_info info{};
  info.struct_size = sizeof info;
  ASSERT_EQ(relume_edit_blend_get_info(blend_, &info), RELUME_OK);
  EXPECT_EQ(info.boxes, 0u);
  EXPECT_EQ(info.values, nullptr);
}

TEST_F(CEdits, whatIsRefusedHasAText) {
  const auto refused = [&](const char* what) {
    auto* blend = reinterpret_cast<relume_edit_blend*>(this);
    EXPECT_EQ(relume_edit_blend_create(host_, &desc_, &blend), RELUME_ERROR_USAGE);
    EXPECT_EQ(blend, nullptr);
    EXPECT_NE(std::string(relume_context_error(host_)).find(what), std::string::npos) << relume_context_error(host_);
  };
  EXPECT_EQ(relume_edit_blend_create(nullptr, &desc_, &blend_), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_edit_blend_create(host_, &desc_, nullptr), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_edit_blend_create(host_, nullptr, &blend_), RELUME_ERROR_USAGE);
  desc_.boxes = nullptr;
  refused("desc.boxes");
  desc_.boxes = boxes_.data();
  boxes_[1].min[0] = 5.0f;
  refused("box 1");
  boxes_[1].min[0] = kNanOfEdits;
  refused("box 1");
  boxes_[1].min[0] = 3.0f;
  desc_.voxel = 0.0f;
  refused("voxel");
  desc_.voxel = 0.1f;
  desc_.fade = -1.0f;
  refused("fade");
  desc_.fade = 1.0f;
  desc_.struct_size = 0;
  refused("struct_size");
  desc_.struct_size = sizeof desc_;
  ASSERT_NO_FATAL_FAILURE(makeBlend());
  EXPECT_STREQ(relume_edit_blend_error(blend_), "");
  const auto refusedBy = [&](relume_status status, const char* what) {
    EXPECT_EQ(status, RELUME_ERROR_USAGE);
    EXPECT_NE(std::string(relume_edit_blend_error(blend_)).find(what), std::string::npos)
        << relume_edit_blend_error(blend_);
  };
  const float in[3] = {1, 1, 1};
  float out[3] = {9, 9, 9};
  refusedBy(relume_edit_blend_share(blend_, 1, nullptr, out), "positions");
  refusedBy(relume_edit_blend_share(blend_, 1, in, nullptr), "shares");
  refusedBy(relume_edit_blend_irradiance(blend_, 1, nullptr, in, in, in, out), "shares");
  refusedBy(relume_edit_blend_irradiance(blend_, 1, in, nullptr, in, in, out), "baked");
  refusedBy(relume_edit_blend_irradiance(blend_, 1, in, in, nullptr, in, out), "before");
  refusedBy(relume_edit_blend_irradiance(blend_, 1, in, in, in, nullptr, out), "after");
  refusedBy(relume_edit_blend_irradiance(blend_, 1, in, in, in, in, nullptr), "irradiance");
  relume_edit_blend_info info{};
  refusedBy(relume_edit_blend_get_info(blend_, &info), "struct_size");
  refusedBy(relume_edit_blend_get_info(blend_, nullptr), "info");
  EXPECT_EQ(out[0], 9.0f);
  EXPECT_EQ(relume_edit_blend_share(blend_, 0, nullptr, nullptr), RELUME_OK);
  EXPECT_EQ(relume_edit_blend_share(nullptr, 1, in, out), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_edit_blend_irradiance(nullptr, 1, in, in, in, in, out), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_edit_blend_glsl(nullptr), nullptr);
  relume_edit_blend_destroy(nullptr);
}

}  // namespace
}  // namespace relume
