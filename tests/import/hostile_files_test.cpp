// SPDX-License-Identifier: MIT
// Broken containers, JSON that is too deep, URIs that leave the folder, image bombs.
#include "bake/import/read_images.h"
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>

namespace relume {
namespace {

using namespace relume::testing;
using Bytes = std::vector<std::uint8_t>;
namespace fs = std::filesystem;

void expectRefused(const Result<Scene>& scene, ErrorCode code, const std::string& message) {
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, code) << scene.error().message;
  EXPECT_NE(scene.error().message.find(message), std::string::npos) << scene.error().message;
}

TEST(HostileFiles, missingFilesFoldersAndPipesAreNamed) {
  const fs::path folder = testFolder();
  expectRefused(importFile(folder / "none.glb"), ErrorCode::io, "none.glb: no such file");
  expectRefused(importFile(folder), ErrorCode::io, "not a regular file");
  const fs::path pipe = folder / "pipe.glb";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  expectRefused(importFile(pipe), ErrorCode::io, "not a regular file");
}

TEST(HostileFiles, emptyAndForeignFilesAreNamed) {
  expectRefused(importFile(writeFile("a.glb", Bytes{})), ErrorCode::invalidFile, "a.glb: empty file");
  expectRefused(importFile(writeFile("b.glb", std::string("PK\3\4 something"))), ErrorCode::invalidFile,
                "neither a .glb");
  expectRefused(importFile(writeFile("c.gltf", std::string("{\"asset\": "))), ErrorCode::invalidFile, "not JSON");
  expectRefused(importFile(writeFile("d.gltf", std::string("[1, 2]"))), ErrorCode::invalidFile, "neither a .glb");
  expectRefused(importFile(writeFile("e.gltf", std::string("{\"a\": \"\xff\xfe\"}"))), ErrorCode::invalidFile, "JSON");
}

TEST(HostileFiles, everyTruncationOfAGlbIsRefused) {
  GltfBuilder b;
  b.quad();
  std::ifstream in(b.write(), std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Result<Scene> scene = importFile(writeFile("cut.glb", whole.substr(0, size)));
    ASSERT_FALSE(scene) << size;
    EXPECT_EQ(scene.error().code, ErrorCode::invalidFile);
  }
}

TEST(HostileFiles, glbHeaderFieldsAreChecked) {
  const Bytes good = glb(R"({"asset":{"version":"2.0"}})", {});
  const auto changed = [&](std::size_t at, std::uint8_t value) {
    Bytes bytes = good;
    bytes[at] = value;
    return importFile(writeFile("h.glb", bytes));
  };
  ASSERT_TRUE(importFile(writeFile("h.glb", good)));
  expectRefused(changed(4, 1), ErrorCode::unsupported, "GLB version 1");
  expectRefused(changed(11, 0x7F), ErrorCode::invalidFile, "GLB says it has");
  expectRefused(changed(15, 0x7F), ErrorCode::invalidFile, "GLB chunk 0 says");
  expectRefused(changed(16, 'X'), ErrorCode::invalidFile, "does not begin with a JSON chunk");
}

TEST(HostileFiles, jsonTwentyThousandDeepIsRefused) {
  for (const char open : {'[', '{'}) {
    std::string text = "{\"asset\":{\"version\":\"2.0\"},\"extras\":";
    for (int i = 0; i < 20000; ++i) text += open == '[' ? "[" : "{\"a\":";
    expectRefused(importFile(writeFile("deep.gltf", text)), ErrorCode::invalidFile, "nested more than 128 deep");
  }
}

TEST(HostileFiles, bracketsInStringsAreNotDepth) {
  const std::string text = "{\"asset\":{\"version\":\"2.0\",\"generator\":\"" + std::string(20000, '[') + "\\\"" +
                           std::string(500, '{') + "\"}}";
  EXPECT_TRUE(importFile(writeFile("flat.gltf", text)));
}

Result<Scene> importWithBuffer(const std::string& uri) {
  const json root = {{"asset", {{"version", "2.0"}}}, {"buffers", json::array({{{"byteLength", 4}, {"uri", uri}}})}};
  return importFile(writeFile("scene/level.gltf", root.dump()));
}

TEST(HostileFiles, urisDoNotLeaveTheFolder) {
  writeFile("secret.bin", Bytes{1, 2, 3, 4});
  writeFile("scene/inside.bin", Bytes{1, 2, 3, 4});
  writeFile("scene/..trap/x.bin", Bytes{1, 2, 3, 4});
  EXPECT_TRUE(importWithBuffer("inside.bin"));
  EXPECT_TRUE(importWithBuffer("./inside.bin"));
  EXPECT_TRUE(importWithBuffer("%69nside.bin"));
  EXPECT_TRUE(importWithBuffer("..trap/x.bin"));
  for (const char* uri : {"..trap/../inside.bin", "no/such/folder/../../../inside.bin", "no%2F..%2Finside.bin"}) {
    const Result<Scene> back = importWithBuffer(uri);
    ASSERT_TRUE(back) << back.error().message;
    ASSERT_EQ(back->files.size(), 2u);
    EXPECT_EQ(back->files[1], back->files[0].parent_path() / "inside.bin");
  }
  const std::string outside = (testFolder() / "secret.bin").string();
  for (const std::string& uri :
       {std::string("../secret.bin"), std::string("%2e%2e/secret.bin"), std::string("..%2Fsecret.bin"),
        std::string("scene/../../secret.bin"), std::string("no/%2e%2e/%2E./secret.bin"),
        std::string("./../scene/inside.bin"), outside, "%2F" + outside.substr(1), outside + "/../scene/inside.bin"})
    expectRefused(importWithBuffer(uri), ErrorCode::invalidFile,
                  "leaves the scene's folder; put the file into it, or export the level as one .glb");
  for (const char* uri : {"..\\secret.bin", "%2E%2E%5Csecret.bin", "..trap\\x.bin"})
    expectRefused(importWithBuffer(uri), ErrorCode::invalidFile, "has a backslash; expected /");
  expectRefused(importWithBuffer("file://" + outside), ErrorCode::invalidFile, "has a scheme");
  expectRefused(importWithBuffer("http://example.org/a.bin"), ErrorCode::invalidFile, "has a scheme");
  expectRefused(importWithBuffer("a%00b.bin"), ErrorCode::invalidFile, "malformed URI");
  expectRefused(importWithBuffer("a%zz.bin"), ErrorCode::invalidFile, "malformed URI");
  expectRefused(importWithBuffer(""), ErrorCode::invalidFile, "malformed URI");
  expectRefused(importWithBuffer("none.bin"), ErrorCode::io, "'none.bin' not found beside the scene");
  expectRefused(importWithBuffer("%252e%252e/secret.bin"), ErrorCode::io, "not found");  // decoded once only
}

TEST(HostileFiles, aColonIsPartOfANameUnlessItEndsAScheme) {
  writeFile("scene/a:b.bin", Bytes{1, 2, 3, 4});
  writeFile("scene/sub/a:b.bin", Bytes{1, 2, 3, 4});
  for (const char* uri : {"./a:b.bin", "sub/a:b.bin", "sub/../a:b.bin", "a%3Ab.bin"}) {
    const Result<Scene> scene = importWithBuffer(uri);
    EXPECT_TRUE(scene) << uri << ": " << scene.error().message;
  }
  for (const char* uri : {"a:b.bin", "c:/a.bin", ":a.bin"})
    expectRefused(importWithBuffer(uri), ErrorCode::invalidFile, "has a scheme");
  expectRefused(importWithBuffer("./../a:b.bin"), ErrorCode::invalidFile, "leaves the scene's folder");
}

TEST(HostileFiles, linksMayPointInsideTheFolderOnly) {
  writeFile("secret.bin", Bytes{1, 2, 3, 4});
  const fs::path inside = writeFile("scene/inside.bin", Bytes{1, 2, 3, 4});
  const fs::path folder = inside.parent_path();
  fs::remove(folder / "good.bin");
  fs::remove(folder / "out.bin");
  fs::remove(folder / "up");
  fs::create_symlink("inside.bin", folder / "good.bin");
  fs::create_symlink("../secret.bin", folder / "out.bin");
  fs::create_directory_symlink("..", folder / "up");
  const Result<Scene> linked = importWithBuffer("good.bin");
  ASSERT_TRUE(linked) << linked.error().message;
  // By the scene's own path: the link, and what it leads to.
  ASSERT_EQ(linked->files.size(), 3u);
  EXPECT_EQ(linked->files[1], linked->files[0].parent_path() / "good.bin");
  EXPECT_EQ(linked->files[2], linked->files[0].parent_path() / "inside.bin");
  expectRefused(importWithBuffer("out.bin"), ErrorCode::invalidFile, "a link that leaves the scene's folder");
  expectRefused(importWithBuffer("up/secret.bin"), ErrorCode::invalidFile, "a link that leaves the scene's folder");
}

TEST(HostileFiles, dataUrisAreReadInAnyCaseAndPercentEncoded) {
  for (const char* uri : {"DATA:Application/Octet-Stream;BASE64,AAAAAA==", "data:;Base64,AAAAAA%3d%3D",
                          "data:;base64,%41AAAAA", "data:;base64,%2B/%2f+AA"}) {
    const Result<Scene> scene = importWithBuffer(uri);
    EXPECT_TRUE(scene) << uri << ": " << scene.error().message;
  }
  for (const char* uri : {"data:;base64,AAAA%", "data:;base64,AAAA%4", "data:;base64,%zzAAAAAA"})
    expectRefused(importWithBuffer(uri), ErrorCode::invalidFile,
                  "buffers[0]: data URI with a malformed % in its base64");
  expectRefused(importWithBuffer("data:;base64,AAAA%0AAAA="), ErrorCode::invalidFile, "a blank or line break");
  expectRefused(importWithBuffer("data:;base64,AA%2541AA"), ErrorCode::invalidFile, "broken base64");  // decoded once
  for (const char* uri : {"data:base64,AAAA", "data", "DATA:", "data:,", "data:;base6,AAAA"})
    EXPECT_FALSE(importWithBuffer(uri)) << uri;
}

TEST(HostileFiles, brokenDataUrisAreNamed) {
  expectRefused(importWithBuffer("data:application/octet-stream;base64,AA=A"), ErrorCode::invalidFile, "broken base64");
  // As encoders for mail write it; RFC 4648, section 3.3, has it refused, and so does the glTF validator.
  for (const char* blank : {"\n", "\r\n", " "}) {
    expectRefused(importWithBuffer("data:application/octet-stream;base64,AAAA" + std::string(blank) + "AAA="),
                  ErrorCode::invalidFile, "buffers[0]: data URI with a blank or line break in its base64, after 4 ");
  }
  expectRefused(importWithBuffer("data:application/octet-stream,abcd"), ErrorCode::invalidFile, "not base64");
  expectRefused(importWithBuffer("data:application/octet-stream;base64,AAA="), ErrorCode::invalidFile,
                "byteLength is 4, its data has 2");
}

GltfBuilder withImage(const Bytes& file) {
  GltfBuilder b;
  const int texture = b.texture(file);
  b.quad({{"material", b.material({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}})}});
  return b;
}

TEST(HostileFiles, imageBombsAreRefusedBeforeDecoding) {
  const Bytes good = png(1, 1, {1, 2, 3, 255});
  const auto sized = [&](std::uint32_t width, std::uint32_t height) {
    Bytes bytes = good;
    for (int i = 0; i < 4; ++i) {
      bytes[static_cast<std::size_t>(16 + i)] = static_cast<std::uint8_t>(width >> (24 - 8 * i));
      bytes[static_cast<std::size_t>(20 + i)] = static_cast<std::uint8_t>(height >> (24 - 8 * i));
    }
    return withImage(bytes).import();
  };
  expectRefused(sized(16384, 16384), ErrorCode::invalidFile, "images[0]");
  expectRefused(sized(8192, 8192), ErrorCode::invalidFile, "claims 8192 x 8192 texels in");
  for (const auto& [width, height] : {std::pair{32768u, 32768u}, {100000u, 1u}, {1u, 0x7FFFFFFFu}, {0u, 1u}}) {
    const std::string size = std::to_string(width) + " x " + std::to_string(height);
    expectRefused(sized(width, height), ErrorCode::invalidFile, "images[0]");
    expectRefused(sized(width, height), ErrorCode::invalidFile, size + " texels; expected 1 to 16384 a side");
  }
}

// What stb_image says of a JPEG is its own; the size is in the frame's header.
TEST(HostileFiles, jpegsThatAreTooLargeAreToldTheirSize) {
  const Bytes file = {0xFF, 0xD8, 0xFF, 0xC0, 0, 11, 8, 0xEA, 0x60, 0x9C, 0x40, 1, 1, 0x11, 0};
  expectRefused(withImage(file).import(), ErrorCode::invalidFile, "40000 x 60000 texels; expected 1 to 16384 a side");
}

TEST(HostileFiles, manyImagesOverTheSameBytesAreRefused) {
  // Each image alone could hold what its header claims; all of them over the same bytes could not.
  Bytes file = png(32, 32, [] {
    std::mt19937 random(3);
    Bytes noise(4096);
    for (std::uint8_t& v : noise) v = static_cast<std::uint8_t>(random() % 256);
    return noise;
  }());
  ASSERT_GT(file.size(), 2100u);
  for (const std::size_t at : {std::size_t{18}, std::size_t{22}}) file[at] = 4096 >> 8;  // IHDR: 4096 + 32 a side
  GltfBuilder b;
  const int view = b.view(file);
  for (std::size_t i = 0; i < 3; ++i) {
    b.root["images"].push_back({{"bufferView", view}});
    b.root["textures"].push_back({{"source", i}});
    b.material({{"emissiveFactor", {1, 1, 1}}, {"emissiveTexture", {{"index", i}}}});
  }
  b.quad();
  expectRefused(b.import(), ErrorCode::invalidFile, "images: claim 51121152 texels in");
}

TEST(HostileFiles, jpegTablesThatOverflowTheDecoderAreRefused) {
  // SOI, a frame of 8 x 8 and a Huffman table of 16 x 255 symbols, in both orders: one is met by whoever asks for the
  // size.
  const Bytes frame = {0xFF, 0xC0, 0, 11, 8, 0, 8, 0, 8, 1, 1, 0x11, 0};
  Bytes table = {0xFF, 0xC4, 0x10, 0x02, 0x00};
  table.insert(table.end(), 16, 255);
  table.resize(table.size() + 16 * 255, 1);
  for (const auto& [first, second] : {std::pair(frame, table), std::pair(table, frame)}) {
    Bytes jpeg;
    for (const Bytes& part : {Bytes{0xFF, 0xD8}, first, second})
      std::copy(part.begin(), part.end(), std::back_inserter(jpeg));
    jpeg.resize(jpeg.size() + 1000, 1);
    expectRefused(withImage(jpeg).import(), ErrorCode::invalidFile, "Huffman table of more than 256 symbols");
  }
  Bytes scans = {0xFF, 0xD8, 0xFF, 0xC0, 0, 11, 8, 0, 8, 0, 8, 1, 1, 0x11, 0};
  for (int i = 0; i < 200; ++i) scans.insert(scans.end(), {0xFF, 0xDA, 0, 8, 1, 1, 0, 0, 63, 0});
  expectRefused(withImage(scans).import(), ErrorCode::invalidFile, "too many scans");
}

TEST(HostileFiles, emptyChunksOfAPngAreNothing) {
  const Bytes whole = png(8, 8, Bytes(256, 77));
  const Bytes empty = {0, 0, 0, 0, 'I', 'D', 'A', 'T', 0x35, 0xAF, 0x06, 0x1E};
  const std::size_t data = 33;  // behind the signature and IHDR
  Bytes padded = whole;
  padded.insert(padded.begin() + static_cast<std::ptrdiff_t>(data), empty.begin(), empty.end());
  const Result<Image> image = decodeImage(padded, "padded");
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->levels[0].rgba, Bytes(256, 77));
  // Nothing but an empty one.
  Bytes none(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(data));
  none.insert(none.end(), empty.begin(), empty.end());
  none.insert(none.end(), whole.end() - 12, whole.end());
  const Result<Image> nothing = decodeImage(none, "none");
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::invalidFile);
}

TEST(HostileFiles, noMemoryForAnImageIsNotTheImagesFault) {
  if (std::string(RELUME_SANITIZE) != "")
    GTEST_SKIP() << "built with " RELUME_SANITIZE ", which needs its own addresses";
  const Bytes large = png(4096, 4096, Bytes(4 * 4096 * 4096, 77));
  const auto decodeWith = [&](std::size_t mebibytes) {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlimit limit{(pages << 12) + (mebibytes << 20), RLIM_INFINITY};
    ::setrlimit(RLIMIT_AS, &limit);
    const Result<Image> image = decodeImage(large, "large");
    const bool told =
        !image && image.error().code == ErrorCode::failed && image.error().message == "large: out of memory";
    std::_Exit(told ? 0 : image ? 2 : 3);
  };
  // Too little for the inflated rows; enough for those, too little for the texels.
  for (const std::size_t mebibytes : {std::size_t{8}, std::size_t{80}}) {
    EXPECT_EXIT(decodeWith(mebibytes), ::testing::ExitedWithCode(0), "") << mebibytes;
  }
  // What an earlier image had is not said of a later one.
  const Result<Image> broken = decodeImage(Bytes{0xFF, 0xD8, 0xFF, 0xD9}, "broken");
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().code, ErrorCode::invalidFile);
}

TEST(HostileFiles, brokenAndMissingImagesAreNamed) {
  expectRefused(withImage({1, 2, 3, 4}).import(), ErrorCode::invalidFile, "images[0] 'image0': not a PNG or JPEG");
  Bytes cut = png(8, 8, Bytes(256, 77));
  cut.resize(cut.size() / 2);
  expectRefused(withImage(cut).import(), ErrorCode::invalidFile, "images[0]");
  // The decoder has no reason of its own for bytes that are no stream.
  Bytes blank = png(64, 64, Bytes(4 * 64 * 64, 77));
  std::fill(blank.end() - 30, blank.end(), std::uint8_t{0});
  const Result<Scene> unread = withImage(blank).import();
  ASSERT_FALSE(unread);
  EXPECT_TRUE(unread.error().message.ends_with("broken image")) << unread.error().message;
  GltfBuilder missing = withImage(cut);
  missing.root["images"][0] = {{"uri", "gone.png"}, {"name", "bricks"}};
  expectRefused(missing.import(), ErrorCode::io, "images[0]: 'gone.png' not found beside the scene");
  missing.root["images"][0] = {{"name", "bricks"}};
  expectRefused(missing.import(), ErrorCode::invalidFile, "images[0]: neither uri nor bufferView");
}

// What glTF has by extensions alone, where a texture says PNG or JPEG.
TEST(HostileFiles, imagesOfOtherFormatsAreNamedWithWhatConvertsThem) {
  const struct {
    Bytes bytes;
    const char* message;
  } cases[] = {{{'R', 'I', 'F', 'F', 1, 2, 3, 4, 'W', 'E', 'B', 'P', 'V', 'P', '8'},
                "WebP, not PNG or JPEG; convert its images"},
               {{0, 0, 0, 32, 'f', 't', 'y', 'p', 'a', 'v', 'i', 'f', 0}, "AVIF, not PNG or JPEG; convert its images"},
               {{0xAB, 'K', 'T', 'X', ' ', '2', '0', 0xBB, 13, 10, 26, 10},
                "KTX2, not PNG or JPEG; convert its images by gltf-transform ktxdecompress IN OUT"},
               {{'D', 'D', 'S', ' ', 124, 0, 0, 0}, "DDS, not PNG or JPEG; export the level with PNG or JPEG images"}};
  for (const auto& c : cases) {
    GltfBuilder b = withImage(c.bytes);
    expectRefused(b.import(), ErrorCode::unsupported, std::string("images[0]: is ") + c.message);
    writeFile("a.png", c.bytes);
    for (const std::string& uri : {std::string("a.png"), "data:image/png;base64," + base64(c.bytes)}) {
      b.root["images"][0] = {{"uri", uri}};
      expectRefused(b.import(), ErrorCode::unsupported, std::string("images[0]: is ") + c.message);
    }
  }
  expectRefused(withImage({'R', 'I', 'F', 'F', 1, 2, 3, 4, 'W', 'A', 'V', 'E', 0}).import(), ErrorCode::invalidFile,
                "images[0] 'image0': not a PNG or JPEG");
}

TEST(HostileFiles, cancellingStopsTheImport) {
  GltfBuilder b;
  b.quad();
  b.onProgress = [](std::string_view, double) { return false; };
  const Result<Scene> scene = b.import();
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().message, cancelledError().message);
}

}  // namespace
}  // namespace relume
