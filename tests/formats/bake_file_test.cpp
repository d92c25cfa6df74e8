// SPDX-License-Identifier: MIT
// The file: round trips, in-place use, and a named error for every field of header and table damaged alone.
#include "relume/bake_file.h"
#include "formats/chunks.h"

#include "tests/formats/corrupt_file.h"
#include "tests/formats/small_bake.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>

namespace relume {
namespace {

namespace fs = std::filesystem;

// A folder of its own, removed at the end.
class BakeFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / ("relume_bake_file_" + std::string(info->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    path_ = folder_ / "small.relume";
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_, path_;
};

Bytes smallFile(LinkKind kind = LinkKind::cone) {
  const Result<Bytes> file = serializeBake(makeSmallBake(kind));
  EXPECT_TRUE(file);
  return *file;
}

Result<Bake> parse(const Bytes& file) { return parseBake(file, nullptr); }

void write(const fs::path& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

TEST_F(BakeFile, onlyFilesWithEmittersAreOfVersion4) {
  const Bytes without = smallFile(), with = *serializeBake(makeSmallDrivableBake());
  EXPECT_EQ(getAt<std::uint32_t>(without, 8), 3u);
  EXPECT_EQ(getAt<std::uint32_t>(with, 8), 4u);
  const Result<Bake> bake = parse(with);
  ASSERT_TRUE(bake) << bake.error().message;
  ASSERT_EQ(bake->emitters.materials.size(), 2u);
  EXPECT_EQ(bake->emitters.materials[0].name, "glow");
  EXPECT_TRUE(bake->emitters.materials[0].clampU && bake->emitters.materials[0].textured);
  EXPECT_FALSE(bake->emitters.materials[0].clampV || bake->emitters.materials[0].marked);
  EXPECT_TRUE(bake->emitters.materials[1].marked);
  EXPECT_EQ(bake->emitters.surfel.toVector(), (std::vector<std::uint32_t>{5, 4}));
  EXPECT_EQ(bake->emitters.tapWidth.toVector(), (std::vector<float>{0.125f, 0.5f}));
  EXPECT_EQ(*serializeBake(*bake), with);

  // No bake has two files: one of another version than its own is refused.
  for (const auto& [file, version, message] :
       {std::tuple{without, 4u, "expected 3, of a bake without emitters, found 4"},
        std::tuple{with, 3u, "expected 4, of a bake with emitters, found 3"}}) {
    Bytes other = file;
    putAt(other, 8, version);
    reseal(other);
    EXPECT_NE(errorOf(other).find(message), std::string::npos) << errorOf(other);
  }
}

TEST_F(BakeFile, onlyFilesWithSightAreOfVersion8) {
  Bake sighted = makeSmallSightedBake();
  const Bytes with = *serializeBake(sighted);
  EXPECT_EQ(getAt<std::uint32_t>(with, 8), 8u);
  const Result<Bake> read = parse(with);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->caches.lightmap.sight.toVector(), sighted.caches.lightmap.sight.toVector());
  EXPECT_EQ(*serializeBake(*read), with);
  Bytes other = with;
  putAt(other, 8, 6u);
  reseal(other);
  EXPECT_NE(errorOf(other).find("expected 8, of a bake whose light map has sight, found 6"), std::string::npos)
      << errorOf(other);
  sighted.caches.lightmap.sight = {};
  EXPECT_EQ(*serializeBake(sighted), *serializeBake(makeSmallCertifiedBake()));
}

TEST_F(BakeFile, roundTripKeepsEveryByteOfAllLinkKinds) {
  for (const LinkKind kind : kLinkKinds) {
    const Bytes file = smallFile(kind);
    const Result<Bake> bake = parse(file);
    ASSERT_TRUE(bake) << bake.error().message;
    const Result<Bytes> again = serializeBake(*bake);
    ASSERT_TRUE(again);
    EXPECT_EQ(*again, file);
    EXPECT_EQ(smallFile(kind), file) << "not deterministic";
  }
}

TEST_F(BakeFile, roundTripKeepsValues) {
  ASSERT_TRUE(writeBake(makeSmallBake(), path_));
  for (const auto& read : {readBake(path_), mapBake(path_), mapBake(path_, Checksums::skip)}) {
    ASSERT_TRUE(read) << read.error().message;
    const Bake original = makeSmallBake();
    EXPECT_EQ(read->surfels.positionWorld.toVector(), original.surfels.positionWorld.toVector());
    EXPECT_EQ(read->surfels.areaEach, 1.0f);
    EXPECT_EQ(read->hierarchy.child.toVector(), original.hierarchy.child.toVector());
    EXPECT_EQ(read->caches.grid.resolution, original.caches.grid.resolution);
    EXPECT_EQ(read->caches.lightmap.width, 4u);
    EXPECT_EQ(read->caches.lightmap.parts[1].firstCorner, 6u);
    EXPECT_EQ(read->caches.lightmap.cornerUv.toVector(), original.caches.lightmap.cornerUv.toVector());
    EXPECT_EQ(read->caches.lightmap.backCornerUv.toVector(), original.caches.lightmap.backCornerUv.toVector());
    EXPECT_EQ(read->links.cone[5].transfer, original.links.cone[5].transfer);
    ASSERT_EQ(read->instances.size(), 2u);
    EXPECT_EQ(read->instances[0].material, "wood");
    EXPECT_EQ(read->instances[0].contentHash, 0x0123456789ABCDEFull);
    EXPECT_EQ(read->provenance.optionsJson, original.provenance.optionsJson);
    EXPECT_EQ(read->instances[1].geometryHash, 22u);
    EXPECT_EQ(read->provenance.sceneHash, 99u);
    EXPECT_EQ(read->provenance.viewHash, 77u);
  }
}

TEST_F(BakeFile, arraysAreUsedInPlaceAndKeepTheMappingAlive) {
  const Bytes file = smallFile();
  const Result<Bake> parsed = parse(file);
  ASSERT_TRUE(parsed);
  const auto* data = reinterpret_cast<const std::byte*>(parsed->links.cone.data());
  EXPECT_TRUE(data >= file.data() && data < file.data() + file.size());

  ASSERT_TRUE(writeBake(makeSmallBake(), path_));
  Array<ConeLink> links;
  {
    const Result<Bake> mapped = mapBake(path_);
    ASSERT_TRUE(mapped);
    links = mapped->links.cone;
  }
  fs::remove(path_);
  EXPECT_EQ(links[0].node, 3u);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(links.data()) % 64, 0u);
}

TEST_F(BakeFile, everyTruncationIsRefused) {
  const Bytes file = smallFile();
  for (std::size_t size = 0; size < file.size(); ++size) {
    const Result<Bake> bake = parseBake(std::span(file).first(size), nullptr);
    ASSERT_FALSE(bake) << size;
    EXPECT_EQ(bake.error().code, ErrorCode::invalidFile);
  }
}

TEST_F(BakeFile, everyFlippedBitIsRefused) {
  Bytes file = smallFile();
  for (std::size_t bit = 0; bit < 8 * file.size(); ++bit) {
    file[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
    ASSERT_FALSE(parse(file)) << "byte " << bit / 8 << " bit " << bit % 8;
    file[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
  }
}

struct Damage {
  const char* message;  // part of the error
  std::function<void(Bytes&)> damage;
};

// Each field of the header alone.
TEST_F(BakeFile, eachHeaderFieldHasItsOwnError) {
  const Damage cases[] = {
      {"header magic", [](Bytes& f) { putAt<char>(f, 1, 'X'); }},
      {"format version 99", [](Bytes& f) { putAt<std::uint32_t>(f, 8, 99); }},
      {"format version 0", [](Bytes& f) { putAt<std::uint32_t>(f, 8, 0); }},
      {"big endian", [](Bytes& f) { putAt<std::uint32_t>(f, 12, 0x04030201); }},
      {"byte-order mark", [](Bytes& f) { putAt<std::uint32_t>(f, 12, 7); }},
      {"header size", [](Bytes& f) { putAt<std::uint32_t>(f, 16, 128); }},
      {"header chunk count", [](Bytes& f) { putAt<std::uint32_t>(f, 20, 0xFFFFFFFF); }},
      {"truncated", [](Bytes& f) { putAt<std::uint64_t>(f, 24, f.size() + 1); }},
      {"appended", [](Bytes& f) { putAt<std::uint64_t>(f, 24, f.size() - 1); }},
      {"header and chunk table checksum", [](Bytes& f) { putAt<std::uint64_t>(f, 32, 1); }},
      {"header: reserved", [](Bytes& f) { putAt<std::uint64_t>(f, 48, 1); }},
  };
  for (const Damage& c : cases) {
    Bytes file = smallFile();
    c.damage(file);
    EXPECT_NE(errorOf(file).find(c.message), std::string::npos) << c.message << " <> " << errorOf(file);
  }
}

// Each field of a table row alone; the message names the chunk.
TEST_F(BakeFile, eachTableFieldHasItsOwnError) {
  const Bytes good = smallFile();
  const std::size_t row = rowOffset(findRow(good, "surfel.normal"));
  const auto offset = getAt<std::uint64_t>(good, row + 40);
  const Damage cases[] = {
      {"name is not", [&](Bytes& f) { putAt<char>(f, row, '!'); }},
      {"name is not", [&](Bytes& f) { putAt<char>(f, row + 15, 'x'); }},
      {"chunk surfel.albedo: appears twice", [&](Bytes& f) { std::memcpy(&f[row], "surfel.albedo\0\0", 16); }},
      {"chunk surfel.normal: missing, found chunk surfel.normak",
       [&](Bytes& f) {
         putAt<char>(f, row + 12, 'k');
         reseal(f);
       }},
      {"chunk surfel.normal: unknown element type 99", [&](Bytes& f) { putAt<std::uint32_t>(f, row + 16, 99); }},
      {"chunk surfel.normal element type: expected f32, found u32",
       [&](Bytes& f) {
         putAt<std::uint32_t>(f, row + 16, 1);
         reseal(f);
       }},
      {"chunk surfel.normal: reserved", [&](Bytes& f) { putAt<std::uint32_t>(f, row + 20, 1); }},
      {"chunk surfel.normal size", [&](Bytes& f) { putAt<std::uint64_t>(f, row + 24, ~std::uint64_t{0}); }},
      {"chunk surfel.normal size", [&](Bytes& f) { putAt<std::uint64_t>(f, row + 32, ~std::uint64_t{0}); }},
      {"chunk surfel.normal size", [&](Bytes& f) { putAt<std::uint64_t>(f, row + 32, 0); }},
      {"chunk surfel.normal shape: expected 3 columns, found 1",
       [&](Bytes& f) {
         putAt<std::uint64_t>(f, row + 24, 18);
         putAt<std::uint64_t>(f, row + 32, 1);
         reseal(f);
       }},
      {"chunk surfel.normal offset: misaligned", [&](Bytes& f) { putAt<std::uint64_t>(f, row + 40, offset + 4); }},
      {"chunk surfel.normal offset: overlaps", [&](Bytes& f) { putAt<std::uint64_t>(f, row + 40, offset - 64); }},
      {"chunk surfel.normal offset: leaves a hole", [&](Bytes& f) { putAt<std::uint64_t>(f, row + 40, offset + 64); }},
      {"chunk surfel.normal: reaches out of the file",
       [&](Bytes& f) { putAt<std::uint64_t>(f, row + 40, ~std::uint64_t{63}); }},
      {"chunk surfel.normal size", [&](Bytes& f) { putAt<std::uint64_t>(f, row + 48, 60); }},
      {"chunk surfel.normal: reaches out of the file",
       [&](Bytes& f) {
         putAt<std::uint64_t>(f, row + 24, std::uint64_t{1} << 40);
         putAt<std::uint64_t>(f, row + 48, std::uint64_t{12} << 40);
       }},
      {"chunk surfel.normal checksum",
       [&](Bytes& f) {
         putAt<std::uint64_t>(f, row + 56, 5);
         const std::size_t rows = chunkCount(f);
         putAt<std::uint64_t>(f, 32, 0);
         putAt<std::uint64_t>(f, 32, XXH3_64bits(f.data(), kHeaderBytes + rows * kRowBytes));
       }},
      {"chunk surfel.normal checksum", [&](Bytes& f) { f[offset] ^= std::byte{1}; }},
      {"padding before it is not zero", [&](Bytes& f) { f[offset - 1] = std::byte{1}; }},
  };
  for (const Damage& c : cases) {
    Bytes file = good;
    c.damage(file);
    EXPECT_NE(errorOf(file).find(c.message), std::string::npos) << c.message << " <> " << errorOf(file);
  }
}

TEST_F(BakeFile, enormousClaimsAreRefused) {
  // A list of 2^60 instances; a string of 2^60 bytes; a surfel count of 2^50.
  Bytes file = smallFile();
  const auto instances = getAt<std::uint64_t>(file, rowOffset(findRow(file, "instances")) + 40);
  putAt<std::uint64_t>(file, instances + 4, std::uint64_t{1} << 60);
  reseal(file);
  EXPECT_NE(errorOf(file).find("chunk instances: claims 1152921504606846976 elements"), std::string::npos)
      << errorOf(file);

  file = smallFile();
  putAt<std::uint64_t>(file, instances + 12, std::uint64_t{1} << 60);
  reseal(file);
  EXPECT_NE(errorOf(file).find("chunk instances: claims"), std::string::npos) << errorOf(file);
}

TEST_F(BakeFile, unknownClassVersionIsUnsupported) {
  Bytes file = smallFile();
  putAt<std::uint32_t>(file, getAt<std::uint64_t>(file, rowOffset(findRow(file, "provenance")) + 40), 2);
  reseal(file);
  const Result<Bake> bake = parse(file);
  ASSERT_FALSE(bake);
  EXPECT_EQ(bake.error().code, ErrorCode::unsupported);
  EXPECT_NE(bake.error().message.find("chunk provenance: class version 2"), std::string::npos) << bake.error().message;
}

TEST_F(BakeFile, missingAndUnknownChunksAreNamed) {
  // Rename the last chunk: it is missing. A chunk more than known: unknown.
  Bytes file = smallFile();
  putAt<char>(file, rowOffset(findRow(file, "provenance")), 'q');
  reseal(file);
  EXPECT_NE(errorOf(file).find("chunk provenance: missing, found chunk qrovenance"), std::string::npos)
      << errorOf(file);

  auto chunks = *readChunks(smallFile());
  const Bytes keep = smallFile();
  chunks = *readChunks(keep);
  chunks.push_back({{"extra", ElementType::u32, kUncoded, {0, 1}, 0, 0, 0}, {}});
  Bytes more;
  writeChunks(chunks, [&](std::span<const std::byte> b) { return more.insert(more.end(), b.begin(), b.end()), true; });
  EXPECT_NE(errorOf(more).find("chunk extra: unknown"), std::string::npos) << errorOf(more);

  chunks.resize(chunks.size() - 2);
  Bytes fewer;
  writeChunks(chunks,
              [&](std::span<const std::byte> b) { return fewer.insert(fewer.end(), b.begin(), b.end()), true; });
  EXPECT_NE(errorOf(fewer).find("chunk provenance: missing"), std::string::npos) << errorOf(fewer);
}

TEST_F(BakeFile, structureIsCheckedEvenWithoutChecksums) {
  Bytes file = smallFile();
  const auto links = getAt<std::uint64_t>(file, rowOffset(findRow(file, "link.cone")) + 40);
  putAt<std::uint32_t>(file, links, 15);
  EXPECT_NE(errorOf(file).find("checksum"), std::string::npos);
  const Result<Bake> bake = parseBake(file, nullptr, Checksums::skip);
  ASSERT_FALSE(bake);
  EXPECT_NE(bake.error().message.find("E123 link refers to a node that does not exist: link.cone[0]"),
            std::string::npos)
      << bake.error().message;
}

TEST_F(BakeFile, misalignedMemoryIsUsage) {
  Bytes file = smallFile();
  file.insert(file.begin(), std::byte{0});
  const Result<Bake> bake = parseBake(std::span(file).subspan(1), nullptr);
  ASSERT_FALSE(bake);
  EXPECT_EQ(bake.error().code, ErrorCode::usage);
}

TEST_F(BakeFile, brokenBakeIsNotWritten) {
  Bake bake = makeSmallBake();
  bake.links.rowBegin = {};
  const Status status = writeBake(bake, path_);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::failed);
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(BakeFile, errorsNameTheFile) {
  write(path_, Bytes(100, std::byte{'x'}));
  for (const auto& bake : {readBake(path_), mapBake(path_)}) {
    ASSERT_FALSE(bake);
    EXPECT_EQ(bake.error().code, ErrorCode::invalidFile);
    EXPECT_EQ(bake.error().message.find(path_.string() + ": header magic"), 0u) << bake.error().message;
  }
  const Result<Bake> missing = readBake(folder_ / "missing.relume");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::io);
  write(path_, {});
  EXPECT_NE(mapBake(path_).error().message.find("empty file"), std::string::npos);
  EXPECT_EQ(readBake(folder_).error().code, ErrorCode::io);
}

}  // namespace
}  // namespace relume
