// SPDX-License-Identifier: MIT
// Every .glb and .gltf of the conformance set is imported and checked, or refused by name; and the large levels have
// what their description says.
#include "bake/import/check_mesh.h"
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace relume {
namespace {

namespace fs = std::filesystem;

const fs::path kScenes = fs::path(RELUME_SHARED_DIR) / "scenes";

// Files that must be refused: those the set's own description lists, and bad_*.
constexpr std::array<std::string_view, 9> kRefused = {"IndexOutOfRange",  "MissingBin", "RecursiveNodes",
                                                      "SchemaFailures",   "wrongTypes", "IncorrectVertexArrays",
                                                      "BoxWithInfinites", "notfound",   "encoded-uris"};

bool mustBeRefused(const fs::path& file) {
  const std::string path = fs::relative(file, kScenes).string();
  const auto has = [&](std::string_view part) { return path.find(part) != std::string::npos; };
  return std::any_of(kRefused.begin(), kRefused.end(), has) || file.filename().string().starts_with("bad_") ||
         has("invalid");
}

// Files that must be imported: ours are all good but bad_*, and so are those of exporters.
bool mustBeImported(const fs::path& file) {
  const std::string path = fs::relative(file, kScenes).string();
  return !mustBeRefused(file) &&
         (path.find("/made/") != std::string::npos || path.find("gltf-blender-io") != std::string::npos ||
          path.find("gltf-transform") != std::string::npos || path.find("playcanvas") != std::string::npos ||
          path.find("glTF-Asset-Generator") != std::string::npos);
}

std::vector<fs::path> sceneFiles(const fs::path& folder) {
  std::vector<fs::path> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (entry.is_regular_file() && (extension == ".glb" || extension == ".gltf")) out.push_back(entry.path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

TEST(Conformance, everyFileIsImportedOrRefusedByName) {
  if (!fs::exists(kScenes / "conformance")) GTEST_SKIP() << kScenes << " is not there: set RELUME_SHARED_DIR";
  std::size_t imported = 0;
  for (const fs::path& file : sceneFiles(kScenes / "conformance")) {
    SCOPED_TRACE(file.string());
    Context context;
    const Result<Scene> scene = importGltf(file, context);
    if (!scene) {
      EXPECT_FALSE(mustBeImported(file)) << scene.error().message;
      EXPECT_NE(scene.error().code, ErrorCode::failed) << scene.error().message;
      EXPECT_EQ(scene.error().message.find(file.filename().string() + ": "), 0u) << scene.error().message;
      continue;
    }
    ++imported;
    EXPECT_FALSE(mustBeRefused(file));
    for (const MeshFinding& finding : checkMeshes(*scene, context)) EXPECT_GT(finding.count, 0u);
    for (std::uint32_t i = 0; i < scene->instances.size(); ++i) {
      const SurfacePoint p{i, 0, {0.25f, 0.25f}};
      const glm::vec3 albedo = albedoAt(*scene, p, 0.1f);
      EXPECT_TRUE(albedo.r >= 0.0f && albedo.r <= 1.0f);
      EXPECT_GE(emissionAt(*scene, p, 0.1f).r, 0.0f);
      opaqueAt(*scene, p);
    }
  }
  EXPECT_GT(imported, 70u);
}

TEST(Conformance, levelsHaveTheirTrianglesCamerasAndLights) {
  const struct {
    const char* file;
    std::uint32_t triangles;
    std::size_t cameras, lights;
  } levels[] = {{"cornell", 36, 2, 1},        {"sponza", 262087, 3, 3}, {"breakfast_room", 262687, 3, 3},
                {"gas_station", 99002, 2, 1}, {"pandora", 60810, 2, 2}, {"fortitude", 48358, 2, 1},
                {"house", 10497, 2, 1}};
  for (const auto& level : levels) {
    const fs::path file = kScenes / level.file / (std::string(level.file) + ".glb");
    if (!fs::exists(file)) GTEST_SKIP() << file << " is not there: set RELUME_SHARED_DIR";
    Context context;
    const Result<Scene> scene = importGltf(file, context);
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->triangleCount(), level.triangles) << level.file;
    EXPECT_EQ(scene->cameras.size(), level.cameras) << level.file;
    EXPECT_EQ(scene->lights.size(), level.lights) << level.file;
  }
}

TEST(Conformance, degenerateTrianglesOfTheLevelsAreCounted) {
  const struct {
    const char* file;
    std::uint32_t degenerate;
  } levels[] = {{"pandora", 116}, {"fortitude", 37}};
  for (const auto& level : levels) {
    const fs::path file = kScenes / level.file / (std::string(level.file) + ".glb");
    if (!fs::exists(file)) GTEST_SKIP() << file << " is not there: set RELUME_SHARED_DIR";
    Context context;
    const Result<Scene> scene = importGltf(file, context);
    ASSERT_TRUE(scene) << scene.error().message;
    std::uint32_t count = 0;
    for (const MeshFinding& finding : checkMeshes(*scene, context))
      count += finding.kind == MeshFinding::Kind::degenerateTriangle ? finding.count : 0;
    EXPECT_EQ(count, level.degenerate) << level.file;
  }
}

}  // namespace
}  // namespace relume
