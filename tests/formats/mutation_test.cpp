// SPDX-License-Identifier: MIT
// Thousands of deterministic mutations of the small bake, checksums made to fit: each is refused with a message or is a
// bake that can be validated and written again. The default suite's little sister of tests/fuzz.
#include "formats/validate.h"
#include "relume/bake_file.h"
#include "tests/formats/corrupt_file.h"
#include "tests/formats/small_bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <tuple>

namespace relume {
namespace {

// Numbers that break arithmetic more often than random ones.
std::uint64_t nastyNumber(std::mt19937& random) {
  static const std::uint64_t list[] = {0,          1,          2,          3,           63,         64,
                                       65,         0x7F,       0x80,       0xFF,        0x7FFF,     0x8000,
                                       0xFFFF,     0x7C00,     0x7FC00000, 0x7F800000,  0x7FFFFFFF, 0x80000000,
                                       0xFFFFFFFE, 0xFFFFFFFF, 1ull << 32, 1ull << 40,  1ull << 60, ~0ull,
                                       ~0ull - 63, 0x3F800000, 0xBF800000, 0x100000001, 7,          15};
  return list[random() % std::size(list)];
}

void mutate(Bytes& file, std::mt19937& random) {
  const std::size_t words = file.size() / 4;
  switch (random() % 6) {
    case 0:
      file[random() % file.size()] ^= static_cast<std::byte>(1u << (random() % 8));
      break;
    case 1:
      putAt<std::uint32_t>(file, 4 * (random() % words), static_cast<std::uint32_t>(nastyNumber(random)));
      break;
    case 2:
      putAt<std::uint64_t>(file, 4 * (random() % (words - 1)), nastyNumber(random));
      break;
    case 3: {  // in header or table
      const std::size_t tableWords = std::min(rowOffset(28) / 4, words - 1);
      putAt<std::uint64_t>(file, 4 * (random() % tableWords), nastyNumber(random));
      break;
    }
    case 4: {  // move a piece elsewhere
      const std::size_t size = 1 + random() % 64;
      std::memmove(&file[random() % (file.size() - size)], &file[random() % (file.size() - size)], size);
      break;
    }
    default:
      file.resize(file.size() - random() % std::min<std::size_t>(file.size() - kHeaderBytes, 200));
      break;
  }
}

class Mutation : public testing::TestWithParam<std::tuple<LinkKind, bool>> {};

TEST_P(Mutation, isRefusedOrUsable) {
  const auto [kind, packed] = GetParam();
  const Bake bakeOfKind = makeSmallDrivableBake(kind);
  const Bytes good = packed ? *serializePackedBake(bakeOfKind, 1) : *serializeBake(bakeOfKind);
  std::mt19937 random(12345);
  int refused = 0, usable = 0;
  for (int i = 0; i < 6000; ++i) {
    Bytes file = good;
    for (std::uint32_t n = 1 + random() % 3; n > 0; --n) mutate(file, random);
    if (random() % 8 != 0) putAt<std::uint64_t>(file, 24, file.size());
    if (random() % 8 != 0) reseal(file);
    const Result<Bake> bake = parseBake(file, nullptr, random() % 2 ? Checksums::verify : Checksums::skip);
    if (!bake) {
      EXPECT_FALSE(bake.error().message.empty());
      ++refused;
      continue;
    }
    ++usable;
    for (const Finding& finding : validateBake(*bake)) EXPECT_GE(static_cast<int>(finding.check), 200);
    EXPECT_TRUE(serializeBake(*bake));
  }
  // Both sides of the coin must have been seen, or the test tests nothing.
  EXPECT_GT(refused, 1000);
  EXPECT_GT(usable, 100);
}

INSTANTIATE_TEST_SUITE_P(, Mutation, testing::Combine(testing::ValuesIn(kLinkKinds), testing::Bool()));

}  // namespace
}  // namespace relume
