// SPDX-License-Identifier: MIT
// Files that are far larger than what is needed of them: their size is looked at first, and what is not needed is not
// read. The program has a third of their size in addresses.
#include "tests/cli/cli_fixture.h"

#include <sys/resource.h>

namespace relume {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kHuge = 3'000'000'000;

class Sizes : public CliFixture {
 protected:
  void SetUp() override {
    if (std::string(RELUME_SANITIZE) != "")
      GTEST_SKIP() << "built with " RELUME_SANITIZE ", which needs terabytes of addresses";
    CliFixture::SetUp();
  }
  ProgramResult runSmall(std::vector<std::string> arguments) {
    return runProgram(arguments, folder_, [] {
      const rlimit limit{1 << 30, 1 << 30};
      ::setrlimit(RLIMIT_AS, &limit);
    });
  }
  // A file that takes no room on the disk: what is behind `text` are holes.
  std::string huge(const std::string& name, const std::string& text = "") {
    const std::string path = put(name, text);
    fs::resize_file(path, kHuge);
    return path;
  }
  void expect(const ProgramResult& result, int status, const std::string& message) {
    EXPECT_EQ(result.status, status) << result.err;
    EXPECT_NE((result.out + result.err).find(message), std::string::npos) << result.out << result.err;
  }
  // The room with its buffer in a file; `tail` moves its data to the end of a buffer of that many bytes.
  std::string externalRoom(std::uintmax_t bufferBytes, bool tail) {
    std::string scene = makeGltf({});
    const std::size_t begin = scene.find("\"uri\":\"data:") + 7, end = scene.find('"', begin);
    const std::string uri = scene.substr(begin, end - begin);
    put("encoded.txt", uri.substr(uri.find("base64,") + 7));
    EXPECT_EQ(std::system(("base64 -d <'" + at("encoded.txt") + "' >'" + at("room.bin") + "'").c_str()), 0);
    const std::string data = readAll(at("room.bin"));
    scene.replace(begin, end - begin, "room.bin");
    const auto change = [&](const std::string& from, const std::string& to) {
      const std::size_t found = scene.rfind(from);
      ASSERT_NE(found, std::string::npos) << from;
      scene.replace(found, from.size(), to);
    };
    const std::uintmax_t shift = tail ? bufferBytes - data.size() : 0, split = 24 * 12;
    change("\"byteLength\":" + std::to_string(data.size()), "\"byteLength\":" + std::to_string(bufferBytes));
    change("\"byteOffset\":" + std::to_string(split), "\"byteOffset\":" + std::to_string(shift + split));
    change("\"byteOffset\":0", "\"byteOffset\":" + std::to_string(shift));
    fs::resize_file(at("room.bin"), kHuge);
    std::fstream file(at("room.bin"), std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(static_cast<std::streamoff>(shift));
    file << data;
    return put("external.gltf", scene);
  }
};

TEST_F(Sizes, textFilesThatAreTooLargeAreRefused) {
  expect(runSmall({"bake", room_, "-o", out_, "--options", huge("o.json")}), 1,
         "has 3000000000 bytes, at most 1048576");
  expect(runSmall({"render", room_, "--aov", "direct", "-o", at("p.png"), "--lights-file", huge("l.json")}), 3,
         "has 3000000000 bytes, at most");
  bake(room_, out_);
  expect(runSmall({"compare", out_, out_, "--report-a", huge("r.json")}), 3, "has 3000000000 bytes, at most");
}

TEST_F(Sizes, bakesAreToldByTheirHeader) {
  const std::string zeros = huge("zeros.relume");
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"validate", zeros}, std::vector<std::string>{"info", zeros},
        std::vector<std::string>{"bench", "--bake", zeros, "--backend", "cpu"},
        std::vector<std::string>{"render", room_, "--bake", zeros, "--size", "8x8", "-o", at("p.png")},
        std::vector<std::string>{"compare", zeros, zeros}, std::vector<std::string>{"status", room_, zeros}})
    expect(runSmall(command), 3, "header magic");
}

TEST_F(Sizes, scenesAreToldByTheirHeader) {
  expect(runSmall({"info", huge("zeros.glb")}), 3, "neither a .glb");
  expect(runSmall({"info", huge("spaces.gltf", "{")}), 3, "a .gltf of 3000000000 bytes");
  const std::string longer = "glTF" + std::string("\2\0\0\0\xff\xff\xff\xff", 8) + std::string(20, '\0');
  expect(runSmall({"info", huge("longer.glb", longer)}), 3,
         "GLB says it has 4294967295 bytes, the file has 3000000000");
  expect(runSmall({"info", huge("level.glb", readAll(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb"))}), 0,
         "triangles                2678");
}

TEST_F(Sizes, buffersAreReadWhereTheirViewsAre) {
  expect(runSmall({"info", externalRoom(24 * 12 + 36 * 2, false)}), 0, "triangles                12");
  expect(runSmall({"info", externalRoom(kHuge, false)}), 0, "triangles                12");
  const std::string tail = externalRoom(kHuge, true);
  expect(runSmall({"info", tail}), 0, "triangles                12");
  // The very same level.
  bake(room_, out_);
  expect(runSmall({"status", tail, out_}), 0, "up to date");
  fs::resize_file(at("room.bin"), 1000);
  expect(runSmall({"info", tail}), 3, "byteLength is 3000000000, its data has 1000 bytes");
}

TEST_F(Sizes, imagesAreToldByTheirBeginning) {
  const auto textured = [&](const std::string& image) {
    GltfParts parts;
    parts.material = "{\"emissiveTexture\":{\"index\":0},\"emissiveFactor\":[1,1,1]}";
    parts.extraTop = "\"images\":[{\"uri\":\"" + image + "\"}],\"textures\":[{\"source\":0}],";
    return put("textured.gltf", makeGltf(parts));
  };
  huge("zeros.png");
  expect(runSmall({"info", textured("zeros.png")}), 3, "not a PNG or JPEG image");
  huge("long.png", "\x89PNG\r\n\x1a\n");
  expect(runSmall({"info", textured("long.png")}), 3, "an image of 3000000000 bytes, at most");
}

}  // namespace
}  // namespace relume
