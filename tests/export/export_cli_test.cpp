// SPDX-License-Identifier: MIT
// `relume export` and `relume bake --export-glb` as a user runs them.
#include "tests/cli/cli_fixture.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace relume {
namespace {

// A .glb in its two pieces: the JSON, and the bytes that its accessors are views of.
struct Glb {
  nlohmann::json root;
  std::string binary;

  static Glb of(const std::string& file) {
    std::uint32_t jsonBytes = 0;
    std::memcpy(&jsonBytes, file.data() + 12, sizeof jsonBytes);
    return {nlohmann::json::parse(file.substr(20, jsonBytes)), file.substr(20 + jsonBytes + 8)};
  }
  std::string file() const {
    std::string json = root.dump();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string out = "glTF";
    const auto put = [&](std::uint32_t word) { out.append(reinterpret_cast<const char*>(&word), sizeof word); };
    for (const std::size_t word :
         {std::size_t{2}, 28 + json.size() + binary.size(), json.size(), std::size_t{0x4E4F534A}})
      put(static_cast<std::uint32_t>(word));
    out += json;
    put(static_cast<std::uint32_t>(binary.size()));
    put(0x004E4942);
    return out + binary;
  }
  // The first byte of an accessor's elements, which lie one after the other.
  char* elements(std::size_t accessor) {
    const nlohmann::json& a = root["accessors"][accessor];
    const nlohmann::json& view = root["bufferViews"][a["bufferView"].get<std::size_t>()];
    return binary.data() + view.value("byteOffset", 0) + a.value("byteOffset", 0);
  }
  nlohmann::json& primitive() { return root["meshes"][0]["primitives"][0]; }
};

class ExportCommand : public CliFixture {
 protected:
  std::vector<std::string> exported(const std::string& output, std::vector<std::string> more = {}) const {
    std::vector<std::string> list = {"export", room_, out_, "-o", output, "--progress", "none"};
    list.insert(list.end(), more.begin(), more.end());
    return list;
  }
  void expectRefused(const std::vector<std::string>& arguments, int status, const std::string& message) {
    const std::string scene = readAll(room_), baked = readAll(out_);
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.status, status) << result.err;
    EXPECT_NE(result.err.find(message), std::string::npos) << result.err;
    EXPECT_EQ(readAll(room_), scene);
    EXPECT_EQ(readAll(out_), baked);
  }
};

TEST_F(ExportCommand, bakeAndExportWriteTheSameLevel) {
  bake(room_, out_, {"--export-glb", at("a.glb")});
  const ProgramResult made = run(exported(at("b.glb")));
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(made.out.find("TEXCOORD_1"), std::string::npos) << made.out;
  const std::string a = readAll(at("a.glb"));
  EXPECT_EQ(a.substr(0, 4), "glTF");
  EXPECT_EQ(a, readAll(at("b.glb")));
  // It names the bake's file by what stands at byte 32 of it.
  const std::string file = readAll(out_);
  std::string hex;
  for (std::size_t i = 40; i-- > 32;) {
    constexpr const char* kDigits = "0123456789abcdef";
    hex += kDigits[static_cast<unsigned char>(file[i]) >> 4];
    hex += kDigits[static_cast<unsigned char>(file[i]) & 15];
  }
  EXPECT_NE(a.find("\"bake\":\"" + hex + "\""), std::string::npos);
  // A bake that is up to date writes the level all the same, and over its own.
  std::filesystem::remove(at("a.glb"));
  for (int i = 0; i < 2; ++i) {
    bake(room_, out_, {"--export-glb", at("a.glb")});
    EXPECT_EQ(readAll(at("a.glb")), a);
    EXPECT_EQ(run(exported(at("b.glb"))).status, 0);
  }
  const ProgramResult told = run(exported(at("b.glb"), {"--json"}));
  EXPECT_EQ(nlohmann::json::parse(told.out)["texcoord"], 1);
}

TEST_F(ExportCommand, progressEndsWithTheWholeLevel) {
  bake(room_, out_);
  const ProgramResult made = run({"export", room_, out_, "-o", at("a.glb"), "--progress", "json"});
  ASSERT_EQ(made.status, 0) << made.err;
  const std::size_t last = made.err.rfind("{\"");
  ASSERT_NE(last, std::string::npos) << made.err;
  const nlohmann::json line = nlohmann::json::parse(made.err.substr(last));
  EXPECT_EQ(line["stage"], "export") << made.err;
  EXPECT_EQ(line["fraction"], 1.0) << made.err;
}

// What an author says in extras.relume of the asset stands before the bake's name.
TEST_F(ExportCommand, anExportedLevelWithExtrasIsWrittenOver) {
  nlohmann::json level = nlohmann::json::parse(readAll(room_));
  level["asset"]["extras"]["relume"]["lightUnit"] = "radiometric";
  put("room.gltf", level.dump());
  for (int i = 0; i < 2; ++i) bake(room_, out_, {"--export-glb", at("a.glb")});
  for (int i = 0; i < 2; ++i) {
    const ProgramResult made = run(exported(at("b.glb")));
    EXPECT_EQ(made.status, 0) << made.err;
  }
}

TEST_F(ExportCommand, nothingElseIsWrittenOver) {
  bake(room_, out_);
  const std::string notes = put("notes.txt", "years of work");
  const std::string level = put("other.glb", readAll(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb"));
  for (const std::string& other : {notes, level}) {
    const std::string before = readAll(other);
    expectRefused(exported(other), 1, "exists and is not a level of relume export");
    expectRefused(bakeArguments(room_, out_, {"--export-glb", other}), 1, "is not a level of relume export");
    EXPECT_EQ(readAll(other), before);
  }
  expectRefused(exported(room_, {"--force"}), 1, "is the scene and would be written over");
  expectRefused(exported(out_, {"--force"}), 1, "is the bake and would be written over");
  expectRefused(bakeArguments(room_, out_, {"--export-glb", out_}), 1, "is what -o writes");
  expectRefused(exported(""), 1, "-o");
  EXPECT_EQ(run(exported(notes, {"--force"})).status, 0);
}

TEST_F(ExportCommand, exportedLevelsAreRefusedBeforeTheBake) {
  bake(room_, out_, {"--export-glb", at("a.glb")});
  const ProgramResult again = run(bakeArguments(at("a.glb"), at("b.relume"), {"--export-glb", at("b.glb")}));
  EXPECT_EQ(again.status, 1);
  EXPECT_NE(again.err.find("already"), std::string::npos) << again.err;
  EXPECT_EQ(again.err.find("surfels"), std::string::npos) << again.err;
  EXPECT_FALSE(std::filesystem::exists(at("b.relume")));
}

// "hash" of a bake's info, "exportedWith" of its level's, and both in text.
TEST_F(ExportCommand, infoNamesTheBakeAsTheLevelDoes) {
  bake(room_, out_, {"--export-glb", at("a.glb")});
  const std::string hash = nlohmann::json::parse(run({"info", out_, "--json"}).out)["hash"];
  EXPECT_EQ(hash.size(), 16u);
  EXPECT_NE(readAll(at("a.glb")).find("\"bake\":\"" + hash + "\""), std::string::npos) << hash;
  EXPECT_EQ(nlohmann::json::parse(run({"info", at("a.glb"), "--json"}).out)["exportedWith"], hash);
  EXPECT_TRUE(nlohmann::json::parse(run({"info", room_, "--json"}).out)["exportedWith"].is_null());
  EXPECT_NE(run({"info", out_}).out.find("hash                     " + hash), std::string::npos);
}

TEST_F(ExportCommand, statusKnowsTheExportedLevel) {
  bake(room_, out_, {"--export-glb", at("a.glb")});
  const ProgramResult same = run({"status", at("a.glb"), out_});
  EXPECT_EQ(same.status, 0) << same.out;
  EXPECT_NE(same.out.find("relume export made this level with this bake"), std::string::npos) << same.out;
  const auto told = nlohmann::json::parse(run({"status", at("a.glb"), out_, "--json"}).out);
  EXPECT_TRUE(told["exportedLevel"] && told["upToDate"]);
  EXPECT_FALSE(nlohmann::json::parse(run({"status", room_, out_, "--json"}).out)["exportedLevel"]);

  // Commands that need the baked vertices say which level to give.
  const ProgramResult drawn = run({"render", at("a.glb"), "--bake", out_, "-o", at("p.png"), "--size", "8x8"});
  EXPECT_EQ(drawn.status, 3);
  EXPECT_NE(drawn.err.find("give the level that it was exported from"), std::string::npos) << drawn.err;

  // Another bake of the same level has other coordinates.
  bake(room_, at("other.relume"), {"--seed", "7"});
  const ProgramResult other = run({"status", at("a.glb"), at("other.relume")});
  EXPECT_EQ(other.status, 7);
  EXPECT_NE(other.out.find("with another bake"), std::string::npos) << other.out;
}

TEST_F(ExportCommand, statusNoticesAChangedExportedLevel) {
  bake(room_, out_, {"--export-glb", at("a.glb")});
  const std::string level = readAll(at("a.glb"));
  const auto replaced = [&](const std::string& what, const std::string& by) {
    std::string changed = level;
    const std::size_t found = changed.find(what);
    EXPECT_NE(found, std::string::npos) << what;
    EXPECT_EQ(what.size(), by.size());
    changed.replace(found, what.size(), by);
    return put("changed.glb", changed);
  };
  const std::string material = level.substr(level.find("\"baseColorFactor\":["), 24);
  std::string darker = material;
  darker[darker.find("0.") + 2] = darker[darker.find("0.") + 2] == '1' ? '2' : '1';
  const ProgramResult painted = run({"status", replaced(material, darker), out_});
  EXPECT_EQ(painted.status, 7);
  EXPECT_NE(painted.out.find("material"), std::string::npos) << painted.out;
  EXPECT_NE(painted.out.find("change its source"), std::string::npos) << painted.out;
  EXPECT_EQ(painted.out.find("geometry"), std::string::npos) << painted.out;
}

TEST_F(ExportCommand, statusNoticesAMovedVertexOfAnExportedLevel) {
  bake(room_, out_, {"--export-glb", at("a.glb")});
  const Glb level = Glb::of(readAll(at("a.glb")));
  ASSERT_EQ(run({"status", put("same.glb", level.file()), out_}).status, 0);
  // The first vertex, and the last, which is a copy where a chart ends or as good as one.
  Glb moved = level;
  const std::size_t position = moved.primitive()["attributes"]["POSITION"].get<std::size_t>();
  const std::size_t count = moved.root["accessors"][position]["count"];
  for (const std::size_t vertex : {std::size_t{0}, count - 1}) {
    moved = level;
    float x = 0.0f;
    char* at = moved.elements(position) + 12 * vertex;
    std::memcpy(&x, at, sizeof x);
    x += 1e-3f;
    std::memcpy(at, &x, sizeof x);
    const ProgramResult told = run({"status", put("moved.glb", moved.file()), out_});
    EXPECT_EQ(told.status, 7) << told.out;
    EXPECT_NE(told.out.find("geometry"), std::string::npos) << told.out;
    EXPECT_NE(told.out.find("change its source"), std::string::npos) << told.out;
  }

  // A tool that draws the triangles in another order changes nothing.
  Glb reordered = level;
  const std::size_t index = reordered.primitive()["indices"].get<std::size_t>();
  ASSERT_EQ(reordered.root["accessors"][index]["componentType"], 5123);
  const std::size_t corners = reordered.root["accessors"][index]["count"];
  char* first = reordered.elements(index);
  std::swap_ranges(first, first + 6, first + 2 * (corners - 3));
  ASSERT_NE(reordered.binary, level.binary);
  const ProgramResult same = run({"status", put("reordered.glb", reordered.file()), out_});
  EXPECT_EQ(same.status, 0) << same.out;

  // Levels of before say nothing of their surfaces.
  Glb old = level;
  old.root["asset"]["extras"]["relume"]["lightmap"].erase("surfaces");
  const ProgramResult unsure = run({"status", put("old.glb", old.file()), out_});
  EXPECT_EQ(unsure.status, 0) << unsure.out;
  EXPECT_NE(unsure.out.find("cannot be told"), std::string::npos) << unsure.out;
}

// What a level says of itself may be anything.
TEST_F(ExportCommand, brokenHashesOfSurfacesAreNone) {
  bake(room_, out_, {"--export-glb", at("a.glb")});
  for (const nlohmann::json& broken :
       {nlohmann::json("text"), nlohmann::json(7), nlohmann::json::array({1, 2}), nlohmann::json{{"xyz", "12"}},
        nlohmann::json{{"0123456789abcdef", 3}}, nlohmann::json()}) {
    Glb level = Glb::of(readAll(at("a.glb")));
    level.root["asset"]["extras"]["relume"]["lightmap"]["surfaces"] = broken;
    const ProgramResult told = run({"status", put("broken.glb", level.file()), out_});
    EXPECT_EQ(told.status, 0) << broken << told.out << told.err;
    EXPECT_NE(told.out.find("cannot be told"), std::string::npos) << told.out;
  }
}

TEST_F(ExportCommand, bakesOfAnotherStateAreRefusedAsRenderDoes) {
  GltfParts parts;
  parts.room = makeBoxRoom(5.0f);
  const std::string other = put("other.gltf", makeGltf(parts));
  bake(room_, out_);
  const ProgramResult drawn = run({"render", other, "--bake", out_, "-o", at("p.png"), "--size", "8x8"});
  const ProgramResult made = run({"export", other, out_, "-o", at("a.glb"), "--progress", "none"});
  EXPECT_EQ(made.status, 3);
  EXPECT_EQ(made.status, drawn.status);
  EXPECT_NE(made.err.find("was not baked from"), std::string::npos) << made.err;
  EXPECT_EQ(made.err.substr(0, made.err.find(';')), drawn.err.substr(0, drawn.err.find(';')));
  EXPECT_FALSE(std::filesystem::exists(at("a.glb")));
  expectRefused({"export", room_, room_, "-o", at("a.glb")}, 3, "room.gltf");
}

}  // namespace
}  // namespace relume
