// SPDX-License-Identifier: MIT
// Light of sides as it is kept: rounded, and without that of dark ones.
#include "runtime/voxels/packed_light.h"
#include "runtime/voxels/sparse_light.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

namespace relume {
namespace {

TEST(PackedLight, isOffByLessThanItSays) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> power(-90.0f, 120.0f), share(0.0f, 1.0f);
  for (int i = 0; i < 20000; ++i) {
    const glm::vec3 light = std::exp2(power(random)) * glm::vec3(share(random), share(random), share(random));
    const glm::vec3 held = PackedLight(light).value(), error = glm::abs(held - light);
    const float largest = std::max({light.x, light.y, light.z});
    ASSERT_LE(std::max({error.x, error.y, error.z}), 0x1p-13f * largest) << largest;
    ASSERT_EQ(PackedLight(held).value(), held) << "what has been rounded stays";
    const float heldLargest = std::max({held.x, held.y, held.z});
    const glm::vec3 less = PackedLight(0.999f * light).value();
    ASSERT_LE(std::max({less.x, less.y, less.z}), heldLargest);
  }
  EXPECT_EQ(PackedLight(glm::vec3(0.0f)).value(), glm::vec3(0.0f));
  EXPECT_EQ(PackedLight(glm::vec3(-1.0f, 2.0f, std::nanf(""))).value(), glm::vec3(0.0f, 2.0f, 0.0f));
  EXPECT_EQ(PackedLight(glm::vec3(0.0f, std::numeric_limits<float>::infinity(), 0.0f)).value().y, 0x1p+126f);
  EXPECT_EQ(PackedLight().value(), glm::vec3(0.0f));
}

// Sides lit and dark at random, in pieces of any size; those before one of them, and others after it.
TEST(SparseLight, isWhatWasPutIn) {
  std::mt19937 random(3);
  for (const std::uint32_t share : {0u, 1u, 8u, 10u}) {
    std::vector<PackedLight> all(1000);
    for (PackedLight& side : all) {
      if (random() % 10 < share) side = PackedLight(glm::vec3(static_cast<float>(random() % 100 + 1), 0.0f, 2.0f));
    }
    SparseLight sparse;
    while (sparse.size() < all.size()) {
      const std::size_t next = std::min<std::size_t>(random() % 130, all.size() - sparse.size());
      sparse.append(std::span(all).subspan(sparse.size(), next));
    }
    for (std::size_t i = 0; i < all.size(); ++i) ASSERT_EQ(sparse[i], all[i].value()) << i;
    const auto lit = static_cast<std::size_t>(
        std::count_if(all.begin(), all.end(), [](const PackedLight& side) { return side.value() != glm::vec3(0.0f); }));
    EXPECT_EQ(sparse.bytes(), 6 * lit + 12 * ((all.size() + 63) / 64));
    for (std::size_t side = 0; side <= all.size(); side += random() % 3 == 0 ? 1 : 17) {
      SparseLight some = sparse.before(side);
      ASSERT_EQ(some.size(), side);
      const std::size_t dark = random() % 200;
      some.growTo(side + dark);
      some.append({all.data(), 100});
      ASSERT_EQ(some.size(), side + dark + 100);
      for (std::size_t i = 0; i < some.size(); ++i)
        ASSERT_EQ(some[i], i < side          ? all[i].value()
                           : i < side + dark ? glm::vec3(0.0f)
                                             : all[i - side - dark].value());
    }
  }
}

}  // namespace
}  // namespace relume
