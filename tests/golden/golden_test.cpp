// SPDX-License-Identifier: MIT
// The fixtures of every format version ever written load, or are refused by name; the writer of the current version
// still writes them byte for byte. Remade by tests/golden/remake.sh.
#include "formats/map_sight.h"
#include "formats/validate.h"
#include "relume/bake_file.h"
#include "tests/formats/small_bake.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

namespace relume {
namespace {

const std::string kFolder = RELUME_SOURCE_DIR "/tests/golden/";

std::vector<std::byte> readBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

struct Fixture {
  const char* file;
  LinkKind kind;
};

class Golden : public testing::TestWithParam<Fixture> {};

TEST_P(Golden, version3LoadsWithItsValues) {
  const Result<Bake> bake = mapBake(kFolder + GetParam().file);
  ASSERT_TRUE(bake) << bake.error().message;
  EXPECT_TRUE(validateBake(*bake).empty());
  EXPECT_EQ(bake->surfels.count(), 6u);
  EXPECT_EQ(bake->surfels.emission[4], glm::vec3(5, 5, 4));
  EXPECT_EQ(bake->hierarchy.nodeCount(), 15u);
  EXPECT_EQ(bake->caches.grid.resolution, glm::uvec3(2, 1, 1));
  EXPECT_EQ(bake->caches.grid.brickCount(), 1u);
  EXPECT_EQ(bake->caches.grid.fine[1], kHangingPoint);
  EXPECT_EQ(bake->caches.grid.depth[0], 0x00339966u);
  EXPECT_EQ(bake->links.kind, GetParam().kind);
  EXPECT_EQ(bake->links.count(), 27u);
  EXPECT_EQ(bake->instances[1].node, "lamp");
  EXPECT_EQ(bake->provenance.seed, 7u);
}

TEST_P(Golden, writerStillWritesTheSameBytes) {
  const Result<std::vector<std::byte>> written = serializeBake(makeSmallBake(GetParam().kind));
  ASSERT_TRUE(written);
  EXPECT_TRUE(*written == readBytes(kFolder + GetParam().file));
}

TEST(GoldenEmitters, version4LoadsWithThem) {
  const Result<Bake> bake = mapBake(kFolder + "v4_cone.relume");
  ASSERT_TRUE(bake) << bake.error().message;
  EXPECT_TRUE(validateBake(*bake).empty());
  EXPECT_EQ(findMaterial(bake->emitters, "screen"), 1u);
  EXPECT_EQ(bake->emitters.surfel[0], 5u);
  const Result<std::vector<std::byte>> written = serializeBake(makeSmallDrivableBake());
  ASSERT_TRUE(written);
  EXPECT_TRUE(*written == readBytes(kFolder + "v4_cone.relume"));
}

TEST(GoldenPacked, version5LoadsAsTheBakeItWasPackedFrom) {
  const std::string path = kFolder + "v5_oct6.relume";
  const Bake small = makeSmallDrivableBake(LinkKind::oct6);
  const Result<Bake> bake = mapBake(path);
  ASSERT_TRUE(bake) << bake.error().message;
  EXPECT_TRUE(validateBake(*bake).empty());
  EXPECT_EQ(*serializeBake(*bake), *serializeBake(small));
  EXPECT_EQ(*serializePackedBake(small, *identifyBakeFile(path)), readBytes(path));
}

TEST(GoldenCertified, versions6And7LoadWithTheirCertificate) {
  const std::string plain = kFolder + "v6_cone.relume", packed = kFolder + "v7_oct6.relume";
  for (const std::string& path : {plain, packed}) {
    const Result<Bake> bake = mapBake(path);
    ASSERT_TRUE(bake) << bake.error().message;
    EXPECT_TRUE(validateBake(*bake).empty());
    EXPECT_FLOAT_EQ(certifiedError(bake->certificate), 0.125f) << "the root of the middle one";
    EXPECT_EQ(bake->certificate.partReceivers[1], 2u);
  }
  EXPECT_EQ(*serializeBake(makeSmallCertifiedBake()), readBytes(plain));
  EXPECT_EQ(*serializePackedBake(makeSmallCertifiedBake(LinkKind::oct6), *identifyBakeFile(packed)), readBytes(packed));
}

TEST(GoldenSighted, versions8And9LoadWithTheirSight) {
  const std::string plain = kFolder + "v8_cone.relume", packed = kFolder + "v9_oct6.relume";
  for (const std::string& path : {plain, packed}) {
    const Result<Bake> bake = mapBake(path);
    ASSERT_TRUE(bake) << bake.error().message;
    EXPECT_TRUE(validateBake(*bake).empty());
    ASSERT_EQ(bake->caches.lightmap.sight.size(), 16u);
    EXPECT_EQ(placeInSight(bake->caches.lightmap.sight[5], {0.2f, 0.7f}), glm::vec2(0.0f, 0.7f));
    EXPECT_EQ(placeInSight(bake->caches.lightmap.sight[5], {0.4f, 0.7f}), glm::vec2(1.0f, 0.0f));
  }
  EXPECT_EQ(*serializeBake(makeSmallSightedBake()), readBytes(plain));
  EXPECT_EQ(*serializePackedBake(makeSmallSightedBake(LinkKind::oct6), *identifyBakeFile(packed)), readBytes(packed));
}

TEST(GoldenOld, earlierVersionsAreRefusedByName) {
  const Result<Bake> bake = mapBake(kFolder + "v1_oct6.relume");
  ASSERT_FALSE(bake);
  EXPECT_EQ(bake.error().code, ErrorCode::unsupported);
  EXPECT_NE(bake.error().message.find("format version 1, this program reads versions 3 to 9"), std::string::npos)
      << bake.error().message;
}

INSTANTIATE_TEST_SUITE_P(, Golden,
                         testing::Values(Fixture{"v3_cone.relume", LinkKind::cone},
                                         Fixture{"v3_sh.relume", LinkKind::sh},
                                         Fixture{"v3_oct6.relume", LinkKind::oct6},
                                         Fixture{"v3_irradiance.relume", LinkKind::irradiance}));

}  // namespace
}  // namespace relume
