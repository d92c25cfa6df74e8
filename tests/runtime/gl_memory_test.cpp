// SPDX-License-Identifier: MIT
// The OpenGL backend's memory on the host's side: from the host's resource, back to it, and refused at any request
// without a crash, a leak or a change of last frame's light. OpenGL objects are not counted here.
#include "relume/relighter.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"
#include "tests/runtime/tracking_memory.h"

#include <epoxy/gl.h>

#include <memory_resource>
#include <string>
#include <vector>

namespace relume {
namespace {

using test::TrackingMemory;

// std::pmr's default resource gives nothing in this program: a container that was not handed a resource shows.
const auto kNoDefault = std::pmr::set_default_resource(std::pmr::null_memory_resource());

class GlMemory : public test::GlTest {
 protected:
  GlMemory() {
    setup_.lights = lights_;
    many_.insert(many_.end(), lights_.begin(), lights_.end());
    many_.insert(many_.end(), lights_.begin(), lights_.end());
    irradiance_.assign(bake_.surfels.count(), glm::vec3(0.5f));
    sky_.assign(bake_.hierarchy.skyDirection.size(), glm::vec3(0.2f));
    more_.lights = many_;
    more_.surfelIrradiance = irradiance_;
    more_.skyPatches = sky_;
  }
  Result<Relighter> create(std::pmr::memory_resource* memory) const {
    RelightOptions options;
    options.backend = BackendKind::gl;
    options.getProcAddress = EglContext::getProcAddress;
    options.memory = memory;
    return Relighter::create(bake_, options);
  }

  Bake bake_ = test::makeSyntheticBake(
      {.surfels = 700, .skyPatches = 8, .lightmapCaches = 24, .linksPerCache = 32, .kind = LinkKind::oct6});
  std::vector<Light> lights_ = test::someLights(), many_;
  std::vector<glm::vec3> irradiance_, sky_;
  LightSetup setup_, more_;  // more_: needs memory for everything that a host can hand over
};

TEST_F(GlMemory, comesFromTheHostAndGoesBack) {
  TrackingMemory memory;
  {
    Result<Relighter> relighter = create(&memory);
    ASSERT_TRUE(relighter) << relighter.error().message;
    const std::size_t created = memory.requests();
    EXPECT_GT(created, 20u);
    EXPECT_GT(memory.maxBytes(), std::size_t{5} * bake_.links.count()) << "what is made for the driver";
    EXPECT_LT(memory.bytes(), 24576u) << "what is kept is the driver's, and what look-ups on the processor read";
    for (int i = 0; i < 2; ++i) ASSERT_TRUE(relighter->relight(setup_) && relighter->relight(more_));
    std::vector<float> light(bake_.caches.count() * static_cast<std::size_t>(relighter->coefficientsPerCache()));
    ASSERT_TRUE(relighter->cacheCoefficients(light));
    EXPECT_GT(memory.requests(), created);
    EXPECT_GE(memory.bytes(), light.size() * sizeof(float));
    relighter->reset();
    const std::size_t requests = memory.requests();
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(relighter->relight(setup_) && relighter->relight(more_));
    EXPECT_EQ(memory.requests(), requests);
  }
  EXPECT_EQ(memory.blocks(), 0u);
  EXPECT_EQ(memory.mistakes(), 0u);
}

TEST_F(GlMemory, anyRequestMayBeRefused) {
  TrackingMemory memory;
  std::size_t requests = 0;
  {
    ASSERT_TRUE(create(&memory));
    requests = memory.requests();
  }
  for (std::size_t n = 0; n < requests; ++n) {
    memory.refuse(n);
    const Result<Relighter> refused = create(&memory);
    ASSERT_FALSE(refused) << "request " << n;
    EXPECT_EQ(refused.error().code, ErrorCode::memory) << refused.error().message;
    EXPECT_EQ(memory.blocks(), 0u) << "request " << n;
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
  }
}

// Neither last frame's light nor what was handed over for this one is touched by a frame that gets no memory.
TEST_F(GlMemory, aFrameWithoutMemoryIsNoFrame) {
  TrackingMemory memory;
  Result<Relighter> same = create(std::pmr::new_delete_resource());
  ASSERT_TRUE(same && same->relight(setup_));
  const std::vector<float> before = same->cacheCoefficients();
  Result<Relighter> previous = create(std::pmr::new_delete_resource());
  ASSERT_TRUE(previous && previous->relight(setup_) && same->inherit(*previous, bake_) && same->relight(more_));
  const std::vector<float> after = same->cacheCoefficients();
  ASSERT_NE(before, after);
  std::size_t n = 0;
  for (;; ++n) {
    ASSERT_LT(n, 20u);
    memory.refuse(TrackingMemory::kNever);
    Result<Relighter> relighter = create(&memory);
    ASSERT_TRUE(relighter && relighter->relight(setup_) && relighter->inherit(*previous, bake_));
    ASSERT_EQ(relighter->cacheCoefficients(), before);
    memory.refuse(n);
    const Status refused = relighter->relight(more_);
    const bool enough = static_cast<bool>(refused);
    memory.refuse(TrackingMemory::kNever);
    if (!enough) {
      EXPECT_EQ(refused.error().code, ErrorCode::memory);
      EXPECT_EQ(relighter->cacheCoefficients(), before) << "request " << n;
      ASSERT_TRUE(relighter->relight(more_));
    }
    EXPECT_EQ(relighter->cacheCoefficients(), after) << "request " << n;
    if (enough) break;
  }
  // Lights twice; what surfels read of the map, their kinds, slots and order, of which the last is kept; what the host
  // hands over.
  EXPECT_EQ(n, 8u);
}

TEST_F(GlMemory, readersAndResetsSayWhenThereIsNone) {
  TrackingMemory memory;
  Result<Relighter> relighter = create(&memory);
  ASSERT_TRUE(relighter && relighter->relight(setup_));
  std::vector<float> light(bake_.caches.count() * static_cast<std::size_t>(relighter->coefficientsPerCache()));
  std::vector<std::uint16_t> map(bake_.caches.lightmap.cache.size() * 4);
  memory.refuse(0);
  EXPECT_EQ(relighter->cacheCoefficients(light).error().code, ErrorCode::memory);
  memory.refuse(1);
  EXPECT_EQ(relighter->irradianceMap(map).error().code, ErrorCode::memory);
  memory.refuse(TrackingMemory::kNever);
  ASSERT_TRUE(relighter->cacheCoefficients(light));
  // A reset that gets none forgets nothing.
  memory.refuse(0);
  EXPECT_THROW(relighter->reset(), std::bad_alloc);
  EXPECT_EQ(relighter->cacheCoefficients(), light);
  relighter->reset();
  EXPECT_EQ(relighter->cacheCoefficients(), std::vector<float>(light.size(), 0.0f));
}

}  // namespace
}  // namespace relume
