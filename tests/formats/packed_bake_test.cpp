// SPDX-License-Identifier: MIT
// Packed bakes: nothing is lost, the bytes are those that formats/README.md describes, and damage is refused by name.
#include "formats/chunks.h"
#include "formats/direction_coding.h"
#include "formats/field_coding.h"
#include "formats/format_version.h"
#include "formats/packed_chunks.h"
#include "relume/bake_file.h"
#include "tests/formats/corrupt_file.h"
#include "tests/formats/small_bake.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <memory_resource>
#include <random>
#include <vector>

namespace relume {
namespace {

Bytes bytesOf(std::initializer_list<int> values) {
  Bytes bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

// Coding of a chunk's row, and where its data begins.
std::size_t codingOffset(const Bytes& file, const char* name) { return rowOffset(findRow(file, name)) + 20; }
std::size_t dataOffset(const Bytes& file, const char* name) {
  return getAt<std::uint64_t>(file, rowOffset(findRow(file, name)) + 40);
}

TEST(FieldCoding, groupsTheBytesOfFieldsBySignificance) {
  // Two columns of 16 bits: 4 bits as they are, 12 as differences: 1, then -1 and 0x101 more.
  const FieldCoding coding = fieldCoding(4, 12 | kDifferences);
  const std::vector<std::uint16_t> rows = {0x0013, 0x0025, 0x000F, 0x0020, 0x101F, 0x1030};
  const Bytes coded = encodeFields(coding, std::as_bytes(std::span(rows)), 4);
  //                                    low bits      differences: low bytes  high bytes
  EXPECT_EQ(coded, bytesOf({0x3, 0xF, 0xF, 0x02, 0x01, 0x02, 0x00, 0x00, 0x02,    // column 0: 1, -1, 0x101
                            0x5, 0x0, 0x0, 0x04, 0x00, 0x02, 0x00, 0x00, 0x02}))  // column 1: 2, 0, 0x101
      << "3 rows";
  std::vector<std::uint16_t> decoded(rows.size());
  EXPECT_TRUE(decodeFields(coding, coded, 4, std::as_writable_bytes(std::span(decoded))));
  EXPECT_EQ(decoded, rows);
}

TEST(FieldCoding, givesBackAnyWords) {
  std::mt19937 random(7);
  for (const FieldCoding coding :
       {fieldCoding(32), fieldCoding(32 | kDifferences), fieldCoding(20 | kDifferences, 2, 10), fieldCoding(1, 31),
        fieldCoding(31 | kDifferences, 1 | kDifferences), fieldCoding(6, 6, 4), fieldCoding(16 | kDifferences),
        fieldCoding(8, 8 | kDifferences, 8, 8)}) {
    std::vector<std::uint32_t> words(3 * 50);
    for (std::uint32_t& word : words) word = static_cast<std::uint32_t>(random());
    const Bytes coded = encodeFields(coding, std::as_bytes(std::span(words)), 12);
    EXPECT_EQ(coded.size(), codedBytes(coding, 50, 12));
    std::vector<std::uint32_t> decoded(words.size());
    EXPECT_TRUE(decodeFields(coding, coded, 12, std::as_writable_bytes(std::span(decoded)))) << coding;
    EXPECT_EQ(decoded, words) << coding;
  }
}

TEST(FieldCoding, knowsWhatIsNone) {
  EXPECT_EQ(wordBits(fieldCoding(6, 6, 4)), 16u);
  EXPECT_EQ(wordBits(fieldCoding(20 | kDifferences, 2, 10)), 32u);
  for (const FieldCoding coding :
       {kUncoded, fieldCoding(12), fieldCoding(33), fieldCoding(16, 0, 16), fieldCoding(16, kDifferences),
        fieldCoding(32, 32), fieldCoding(32 | 0x80), fieldCoding(0, 32), ~0u})
    EXPECT_EQ(wordBits(coding), 0u) << coding;
}

// Two surfels below a root, two caches: one link straight up, one to the sky, one to the middle of both surfels.
struct SmallLinks {
  std::vector<float> surfel = {0, 0, 3, 4, 0, 3}, sky = {1, 0, 0}, cache = {0, 0, 1, 2, 0, 1};
  std::vector<std::uint32_t> child = {1, 3, kLeafBit | 2u, kLeafBit | 0u, kLeafBit | 1u}, row = {0, 2, 3},
                             head = {3, 2, 1};
  LinkEnds ends() const { return {surfel, sky, cache, child, row, head}; }
};

Bytes shapesOf(std::initializer_list<std::uint16_t> shapes) {
  const std::vector<std::uint16_t> list(shapes);
  const auto bytes = std::as_bytes(std::span(list));
  return {bytes.begin(), bytes.end()};
}

std::uint16_t shapeOf(int x, int y, int cone) {
  return static_cast<std::uint16_t>((x & 63) | (y & 63) << 6 | cone << 12);
}

TEST(DirectionCoding, storesHowFarDirectionsAreFromTheSenders) {
  const SmallLinks links;
  // +Z is (0, 0), +X is (31, 0); the fourth shape has no link.
  const Bytes shapes = shapesOf({shapeOf(1, -1, 5), shapeOf(31, 0, 15), shapeOf(0, 2, 0), shapeOf(3, 0, 0)});
  const Bytes coded = encodeDirections(links.ends(), shapes);
  EXPECT_EQ(coded, bytesOf({2, 0, 0, 6,  // x: 1, 0, 0, 3
                            1, 0, 4, 0,  // y: -1, 0, 2, 0
                            5, 15, 0, 0}));
  Bytes decoded(shapes.size());
  EXPECT_TRUE(decodeDirections(links.ends(), coded, decoded, std::pmr::new_delete_resource()));
  EXPECT_EQ(decoded, shapes);
  for (const std::size_t plane : {0u, 1u, 2u}) {
    Bytes wide = coded;
    wide[4 * plane] = std::byte{0x40};
    EXPECT_FALSE(decodeDirections(links.ends(), wide, decoded, std::pmr::new_delete_resource())) << plane;
  }
}

TEST(DirectionCoding, anyNumbersAreSafeAndGiveTheShapesBack) {
  std::mt19937 random(3);
  const auto any = [&] { return static_cast<std::uint32_t>(random()); };
  for (int round = 0; round < 300; ++round) {
    SmallLinks links;
    for (auto* values : {&links.surfel, &links.sky, &links.cache})
      for (float& value : *values) value = std::bit_cast<float>(any());
    for (auto* words : {&links.child, &links.row, &links.head})
      for (std::uint32_t& word : *words) word = any() % 3 != 0 ? any() % 6 | (any() & kLeafBit) : any();
    if (round % 4 == 0) links.surfel.resize(any() % 6);
    if (round % 4 == 1) links.cache.clear();
    if (round % 4 == 2) links.row.resize(any() % 3);
    if (round % 4 == 3) links.child.resize(any() % 5);
    const Bytes shapes = shapesOf({static_cast<std::uint16_t>(any()), static_cast<std::uint16_t>(any()),
                                   static_cast<std::uint16_t>(any()), static_cast<std::uint16_t>(any())});
    Bytes decoded(shapes.size());
    EXPECT_TRUE(decodeDirections(links.ends(), encodeDirections(links.ends(), shapes), decoded,
                                 std::pmr::new_delete_resource()));
    EXPECT_EQ(decoded, shapes) << round;
  }
}

TEST(PackedBake, isTheSameBake) {
  for (const LinkKind kind : kLinkKinds) {
    for (const Bake& bake :
         {makeSmallBake(kind), makeSmallDrivableBake(kind), makeSmallCertifiedBake(kind), makeSmallSightedBake(kind)}) {
      const Bytes plain = *serializeBake(bake);
      const Bytes packed = *serializePackedBake(bake, 42);
      EXPECT_EQ(getAt<std::uint32_t>(packed, 8), packedVersionOf(bake));
      EXPECT_TRUE(isPacked(packed));
      EXPECT_FALSE(isPacked(plain));
      EXPECT_EQ(identityOf(packed), 42u);
      const Result<Bake> unpacked = parseBake(packed, nullptr);
      ASSERT_TRUE(unpacked) << linkKindName(kind) << ": " << unpacked.error().message;
      EXPECT_EQ(*serializeBake(*unpacked), plain) << linkKindName(kind);
      EXPECT_EQ(*serializePackedBake(*unpacked, 42), packed) << linkKindName(kind);
    }
  }
}

TEST(PackedBake, hasTheDocumentedBytes) {
  const Bytes file = *serializePackedBake(makeSmallBake(LinkKind::oct6), 42);
  EXPECT_EQ(getAt<std::uint64_t>(file, 40), 42u);
  EXPECT_EQ(getAt<std::uint32_t>(file, codingOffset(file, "scalars")), 0u);
  EXPECT_EQ(getAt<std::uint32_t>(file, codingOffset(file, "link.head")), 0x000A0254u);
  EXPECT_EQ(getAt<std::uint32_t>(file, codingOffset(file, "link.shape")), 0x80000003u);
  EXPECT_EQ(getAt<std::uint32_t>(file, codingOffset(file, "node.leaf")), 0x80000002u);
  EXPECT_EQ(getAt<std::uint64_t>(file, rowOffset(findRow(file, "node.leaf")) + 48), 0u);
  // The tree of small_bake.h: seven inner nodes, then the leaves of senders 0 to 7.
  ASSERT_EQ(getAt<std::uint32_t>(file, codingOffset(file, "node.child")), 0x80000001u);
  for (std::uint32_t node = 0; node < 15; ++node)
    EXPECT_EQ(getAt<std::uint32_t>(file, dataOffset(file, "node.child") + 4 * node),
              node < 7 ? 0u : kLeafBit | (node - 7));
}

TEST(PackedBake, damageIsRefusedByName) {
  const Bytes good = *serializePackedBake(makeSmallBake(LinkKind::oct6), 42);
  struct Case {
    const char* expected;
    void (*apply)(Bytes& file);
  };
  const Case list[] = {
      {"chunk link.head: packed: a field has more bits than its width",
       [](Bytes& f) {  // the third bytes of nodes of 20 bits follow the first and second
         const std::uint64_t rows = getAt<std::uint64_t>(f, rowOffset(findRow(f, "link.head")) + 24);
         f[dataOffset(f, "link.head") + 2 * rows] = std::byte{0x10};
       }},
      {"chunk link.shape: packed: a direction has more bits than its width",
       [](Bytes& f) { f[dataOffset(f, "link.shape")] = std::byte{0x40}; }},
      {"chunk node.child: row 0: expected 0 of an inner node, found 1",
       [](Bytes& f) { putAt<std::uint32_t>(f, dataOffset(f, "node.child"), 1); }},
      {"node.child", [](Bytes& f) { putAt<std::uint32_t>(f, dataOffset(f, "node.child") + 4 * 14, 0); }},
      {"chunk node.leaf: has 8 rows, and a leaf is of sender 9",
       [](Bytes& f) { putAt<std::uint32_t>(f, dataOffset(f, "node.child") + 4 * 14, kLeafBit | 9u); }},
      {"node.leaf", [](Bytes& f) { putAt<std::uint32_t>(f, dataOffset(f, "node.child") + 4 * 14, kLeafBit); }},
      {"chunk node.leaf: has 1000000000 rows, and the tree before it 8 leaves",
       [](Bytes& f) { putAt<std::uint64_t>(f, rowOffset(findRow(f, "node.leaf")) + 24, 1000000000); }},
      {"chunk node.leaf size",
       [](Bytes& f) { putAt<std::uint64_t>(f, rowOffset(findRow(f, "node.leaf")) + 24, ~0ull); }},
      {"packed by coding 0000000000000021",
       [](Bytes& f) { putAt<std::uint32_t>(f, codingOffset(f, "link.row"), 0x21u); }},
      {"chunk scalars size", [](Bytes& f) { putAt<std::uint32_t>(f, codingOffset(f, "scalars"), 0x20u); }},
      {"chunk surfel.position size",
       [](Bytes& f) { putAt<std::uint32_t>(f, codingOffset(f, "surfel.position"), kCountedLeaves); }},
      {"header: reserved bytes are not zero", [](Bytes& f) { putAt<std::uint64_t>(f, 48, 1); }},
      {"header: reserved bytes are not zero", [](Bytes& f) { putAt<std::uint32_t>(f, 8, 3); }},
      {"reserved bytes are not zero", [](Bytes& f) { putAt<std::uint32_t>(f, 8, 3), putAt<std::uint64_t>(f, 40, 0); }},
      {"header format version: expected 5, of a packed bake without a certificate, found 7",
       [](Bytes& f) { putAt<std::uint32_t>(f, 8, 7); }},
      {"format version 10, this program reads versions 3 to 9", [](Bytes& f) { putAt<std::uint32_t>(f, 8, 10); }},
  };
  for (const Case& damage : list) {
    Bytes file = good;
    damage.apply(file);
    reseal(file);
    EXPECT_NE(errorOf(file).find(damage.expected), std::string::npos) << damage.expected << " | " << errorOf(file);
  }
}

// Counts what is asked of it.
class CountedMemory final : public std::pmr::memory_resource {
 public:
  std::size_t bytes = 0;

 private:
  void* do_allocate(std::size_t size, std::size_t alignment) override {
    bytes += size;
    return std::pmr::new_delete_resource()->allocate(size, alignment);
  }
  void do_deallocate(void* block, std::size_t size, std::size_t alignment) override {
    std::pmr::new_delete_resource()->deallocate(block, size, alignment);
  }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
};

// A chunk of leaves takes no room in the file: a tree has one, so that a small file is not a large bake.
TEST(PackedBake, leavesAreUnpackedOnce) {
  const std::vector<std::uint32_t> child(20001, 0);
  std::vector<Chunk> chunks{{{"node.child", ElementType::u32, kCountedChildren, {child.size(), 1}, 0, 0, 0},
                             std::as_bytes(std::span(child))}};
  for (char c = 'a'; c <= 'z'; ++c) {
    chunks.push_back(
        {{std::string("leaf.") + c, ElementType::u32, kCountedLeaves, {(child.size() + 1) / 2, 1}, 0, 0, 0}, {}});
  }
  const Bytes file = joinChunks(chunks, kOldestPackedFormatVersion, kBakeFileType, 42);
  CountedMemory memory;
  const Result<Bake> bake = parseBake(file, nullptr, Checksums::verify, &memory);
  ASSERT_FALSE(bake);
  EXPECT_NE(bake.error().message.find("chunk leaf.b: has 10001 rows, and the tree before it 0 leaves"),
            std::string::npos)
      << bake.error().message;
  EXPECT_LT(memory.bytes, 2 * file.size());
}

TEST(PackedBake, aFileOfGzipIsToldFromOtherFiles) {
  const std::string error = errorOf(bytesOf({0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 0, 3}));
  EXPECT_NE(error.find("found a file of gzip: unpack it by gunzip first"), std::string::npos) << error;
}

}  // namespace
}  // namespace relume
