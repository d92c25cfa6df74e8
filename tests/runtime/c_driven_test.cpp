// SPDX-License-Identifier: MIT
// Driven materials through relume.h: the C++ API's light, names, and what is refused; structs of hosts that were built
// before there were any.
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "relume/relume.h"
#include "tests/runtime/c_handles.h"
#include "tests/runtime/driven_bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

namespace relume {
namespace {

using test::Handles;

class CDriven : public ::testing::Test {
 protected:
  void SetUp() override {
    bake_ = test::makeDrivenBake({.surfels = 700, .lightmapCaches = 24, .linksPerCache = 32});
    bake_.instances = std::vector<BakedInstance>{{"room", {}, {}}};
    bake_.caches.lightmap.parts = std::vector<LightmapPart>(1);
    const Result<std::vector<std::byte>> bytes = serializeBake(bake_);
    ASSERT_TRUE(bytes) << bytes.error().message;
    bytes_ = *bytes;
    relume_context_desc desc{};
    desc.struct_size = sizeof desc;
    desc.api_version = RELUME_API_VERSION;
    ASSERT_EQ(relume_context_create(&desc, &h_.context), RELUME_OK);
    ASSERT_EQ(relume_bake_from_memory(h_.context, bytes_.data(), bytes_.size(), nullptr, nullptr, &h_.bake), RELUME_OK)
        << relume_context_error(h_.context);
    image_ = test::makeStripes(6, 4);
  }
  relume_status create(const relume_driven_image* images, std::size_t count) {
    relume_relighter_desc desc{};
    desc.struct_size = sizeof desc;
    desc.driven_images = images;
    desc.driven_image_count = count;
    return relume_relighter_create(h_.bake, &desc, &h_.relighter);
  }

  Bake bake_;
  std::vector<std::byte> bytes_;
  Handles h_;
  std::vector<glm::vec3> image_;
};

TEST_F(CDriven, lightIsTheCppApis) {
  ASSERT_EQ(relume_bake_drivable_count(h_.bake), 2u);
  EXPECT_STREQ(relume_bake_drivable_name(h_.bake, 0), "screen");
  EXPECT_STREQ(relume_bake_drivable_name(h_.bake, 1), "panel");
  EXPECT_STREQ(relume_bake_drivable_name(h_.bake, 2), "");
  EXPECT_EQ(relume_bake_drivable_count(nullptr), 0u);

  const relume_driven_image declared = {"screen", 6, 4};
  ASSERT_EQ(create(&declared, 1), RELUME_OK) << relume_bake_error(h_.bake);
  relume_material_emission emissions[2] = {};
  emissions[0].material = 1;
  emissions[0].radiance[1] = 4.0f;
  emissions[1].radiance[0] = emissions[1].radiance[1] = emissions[1].radiance[2] = 1.0f;
  emissions[1].image = &image_[0].x;
  emissions[1].texel_count = image_.size();
  relume_light_setup setup;
  relume_light_setup_default(&setup, sizeof setup);
  setup.material_emissions = emissions;
  setup.material_emission_count = 2;

  RelightOptions options;
  options.drivenImages = {{"screen", 6, 4}};
  Result<Relighter> same = Relighter::create(bake_, options);
  ASSERT_TRUE(same);
  std::vector<MaterialEmission> driven(2);
  driven[0].material = test::kPanel;
  driven[0].radiance = {0, 4, 0};
  driven[1].image = image_;
  LightSetup frame;
  frame.materialEmissions = driven;
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(relume_relight(h_.relighter, &setup), RELUME_OK) << relume_relighter_error(h_.relighter);
    ASSERT_TRUE(same->relight(frame));
  }
  const std::vector<float> expected = same->cacheCoefficients();
  std::vector<float> found(expected.size());
  ASSERT_EQ(relume_cache_coefficients(h_.relighter, found.data(), found.size() * sizeof(float)), RELUME_OK);
  EXPECT_EQ(found, expected);
}

TEST_F(CDriven, mistakesAreUsageAndLightStays) {
  const relume_driven_image unknown = {"wall", 6, 4}, unnamed = {nullptr, 6, 4};
  EXPECT_EQ(create(&unknown, 1), RELUME_ERROR_USAGE);
  EXPECT_NE(std::string(relume_bake_error(h_.bake)).find("no such drivable material"), std::string::npos);
  EXPECT_EQ(create(&unnamed, 1), RELUME_ERROR_USAGE);
  EXPECT_EQ(create(nullptr, 1), RELUME_ERROR_USAGE);
  ASSERT_EQ(create(nullptr, 0), RELUME_OK);
  relume_light_setup setup;
  relume_light_setup_default(&setup, sizeof setup);
  ASSERT_EQ(relume_relight(h_.relighter, &setup), RELUME_OK);
  const std::size_t count = relume_coefficients_per_cache(h_.relighter) * bake_.caches.count();
  std::vector<float> before(count), after(count);
  ASSERT_EQ(relume_cache_coefficients(h_.relighter, before.data(), count * sizeof(float)), RELUME_OK);
  relume_material_emission emission{};
  setup.material_emissions = &emission;
  setup.material_emission_count = 1;
  emission.texel_count = 24;
  EXPECT_EQ(relume_relight(h_.relighter, &setup), RELUME_ERROR_USAGE);  // no image
  emission.image = &image_[0].x;
  EXPECT_EQ(relume_relight(h_.relighter, &setup), RELUME_ERROR_USAGE);
  EXPECT_NE(std::string(relume_relighter_error(h_.relighter)).find("none is declared"), std::string::npos);
  emission.texel_count = 0;
  EXPECT_EQ(relume_relight(h_.relighter, &setup), RELUME_ERROR_USAGE);
  EXPECT_STREQ(relume_relighter_error(h_.relighter),
               "setup.material_emissions[0].texel_count is 0, expected width * height of the image");
  setup.material_emissions = nullptr;
  EXPECT_EQ(relume_relight(h_.relighter, &setup), RELUME_ERROR_USAGE);
  ASSERT_EQ(relume_cache_coefficients(h_.relighter, after.data(), count * sizeof(float)), RELUME_OK);
  EXPECT_EQ(before, after);
  // A host that knows nothing of driven materials: its struct ends before them.
  setup.struct_size = offsetof(relume_light_setup, material_emissions);
  setup.material_emissions = &emission;
  EXPECT_EQ(relume_relight(h_.relighter, &setup), RELUME_OK);
}

TEST_F(CDriven, defaultsWriteNoByteBeyondTheHostsStruct) {
  ASSERT_EQ(create(nullptr, 0), RELUME_OK);
  constexpr std::size_t kOlder = offsetof(relume_light_setup, material_emissions),
                        kNewer = sizeof(relume_light_setup) + 24;
  alignas(relume_light_setup) unsigned char memory[kNewer + 8];
  auto* const setup = reinterpret_cast<relume_light_setup*>(memory);
  for (const std::size_t size : {kOlder, kNewer}) {
    std::fill(std::begin(memory), std::end(memory), std::uint8_t{0xA5});
    relume_light_setup_default(setup, size);
    EXPECT_EQ(setup->struct_size, size);
    EXPECT_EQ(setup->emission_scale[1], 1.0f);
    EXPECT_EQ(setup->bounce_scale, 1.0f);
    for (std::size_t i = size; i < sizeof memory; ++i) ASSERT_EQ(memory[i], 0xA5) << i << " of " << size;
    EXPECT_EQ(relume_relight(h_.relighter, setup), RELUME_OK) << relume_relighter_error(h_.relighter);
  }
  for (std::size_t i = sizeof(relume_light_setup); i < kNewer; ++i)
    EXPECT_EQ(memory[i], 0) << "of a newer host's fields";
}

}  // namespace
}  // namespace relume
