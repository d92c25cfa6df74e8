// SPDX-License-Identifier: MIT
// A host of relume.h, with the same bake and lights for the C++ API.
#pragma once

#include "formats/pack.h"
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "relume/relume.h"
#include "tests/runtime/c_handles.h"
#include "tests/runtime/c_lights.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace relume::test {

// A room of a synthetic bake, as a host has it: bytes in memory, a context, a relighter.
class CApi : public ::testing::Test {
 protected:
  void SetUp() override {
    bake_ = test::makeSyntheticBake({.surfels = 700, .skyPatches = 12, .lightmapCaches = 24, .linksPerCache = 32});
    bake_.instances = std::vector<BakedInstance>{{"room", {}, {}}};
    bake_.caches.lightmap.cornerUv =
        std::vector<std::uint32_t>{packUnorm16x2({0.25f, 0.5f}), kGridLit, kGridLit, packUnorm16x2({1, 0}), 7, 70000};
    bake_.caches.lightmap.parts = std::vector<LightmapPart>{{.triangleCount = 2, .firstCorner = 0}};
    const Result<std::vector<std::byte>> bytes = serializeBake(bake_);
    ASSERT_TRUE(bytes) << bytes.error().message;
    bytes_ = *bytes;
    lights_ = test::someLights();
    cLights_ = test::cLights(lights_);
    relume_light_setup_default(&setup_, sizeof setup_);
    setup_.lights = cLights_.data();
    setup_.light_count = cLights_.size();
  }

  void open(Handles& h, relume_parallel_for parallelFor = nullptr) {
    relume_context_desc desc{};
    desc.struct_size = sizeof desc;
    desc.api_version = RELUME_API_VERSION;
    desc.parallel_for = parallelFor;
    ASSERT_EQ(relume_context_create(&desc, &h.context), RELUME_OK);
    ASSERT_EQ(relume_bake_from_memory(h.context, bytes_.data(), bytes_.size(), nullptr, nullptr, &h.bake), RELUME_OK)
        << relume_context_error(h.context);
    ASSERT_EQ(relume_relighter_create(h.bake, nullptr, &h.relighter), RELUME_OK) << relume_bake_error(h.bake);
  }

  Relighter cpp() {
    Result<Relighter> relighter = Relighter::create(bake_, {});
    EXPECT_TRUE(relighter);
    return std::move(*relighter);
  }

  // Open, and relight both.
  void light(Handles& h, Relighter& same) {
    ASSERT_NO_FATAL_FAILURE(open(h));
    ASSERT_EQ(relume_relight(h.relighter, &setup_), RELUME_OK);
    LightSetup setup;
    setup.lights = lights_;
    ASSERT_TRUE(same.relight(setup));
  }

  Bake bake_;
  std::vector<std::byte> bytes_;
  std::vector<Light> lights_;
  std::vector<relume_light> cLights_;
  relume_light_setup setup_;
};

}  // namespace relume::test
