// SPDX-License-Identifier: MIT
// Small smooth parts get texels that follow their curvature; and what the log advises where they or small pieces do
// not.
#include "bake/caches/charts/smooth_parts.h"

#include "bake/caches/charts/patches.h"
#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"
#include "tests/caches/reads.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <utility>

namespace relume {
namespace {

using test::addBox;
using test::addInstance;
using test::addTriangle;
using test::Placed;
using test::readLightmap;

// A ball with normals of its own.
Mesh smoothBall(float radius, int rings = 24, int sectors = 48) {
  Mesh mesh = test::sphere(radius, rings, sectors);
  for (const glm::vec3& p : mesh.position) mesh.normal.push_back(glm::normalize(p));
  return mesh;
}

void moveBy(Mesh& mesh, const glm::vec3& way) {
  for (glm::vec3& p : mesh.position) p += way;
}

void append(Mesh& mesh, const Mesh& other) {
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  mesh.position.insert(mesh.position.end(), other.position.begin(), other.position.end());
  mesh.normal.insert(mesh.normal.end(), other.normal.begin(), other.normal.end());
  for (const glm::uvec3& t : other.triangle) mesh.triangle.push_back(t + first);
}

TEST(SmoothParts, curvatureOfABallIsTwoOverItsRadius) {
  for (const float radius : {0.3f, 2.0f}) {
    const MeshParts parts = findSmoothParts(smoothBall(radius));
    ASSERT_EQ(parts.curvature.size(), 1u);
    EXPECT_NEAR(parts.curvature[0] * radius, 2.0f, 0.05f);
    EXPECT_EQ(std::count(parts.partOf.begin(), parts.partOf.end(), 0u), 2 * 48 * 23);
  }
}

TEST(SmoothParts, facetsCreasesAndPlanesAreNotSmooth) {
  Mesh facets = smoothBall(0.3f, 12, 16);  // neighbours turn by five degrees at least
  facets.normal.clear();
  EXPECT_TRUE(findSmoothParts(facets).partOf.empty());
  for (const glm::uvec3& t : facets.triangle) {
    const glm::vec3 n = glm::normalize(
        glm::cross(facets.position[t.y] - facets.position[t.x], facets.position[t.z] - facets.position[t.x]));
    facets.normal.insert(facets.normal.end(), 3, n);
  }
  EXPECT_TRUE(findSmoothParts(facets).partOf.empty());
  Mesh plane;
  for (int i = 0; i < 20; ++i) test::addQuad(plane, {i, 0, 0}, {i + 1, 0, 0}, {i + 1, 1, 0}, {i, 1, 0});
  plane.normal.assign(plane.position.size(), {0, 0, 1});
  EXPECT_TRUE(findSmoothParts(plane).partOf.empty());
  EXPECT_TRUE(findSmoothParts(Mesh{}).partOf.empty());
}

TEST(SmoothParts, piecesOfAMeshAreKeptApart) {
  Mesh mesh = smoothBall(0.3f);
  Mesh other = smoothBall(0.6f);
  moveBy(other, {3, 0, 0});
  append(mesh, other);
  const MeshParts parts = findSmoothParts(mesh);
  ASSERT_EQ(parts.curvature.size(), 2u);
  EXPECT_NEAR(parts.curvature[0] / parts.curvature[1], 2.0f, 1e-3f);
}

constexpr float kRadius = 0.3f;
const glm::vec3 kBallAt(0.4f, 1.0f, 0.2f);

// A room of 4 x 3 x 4 m with a ball in it.
Placed roomWithBall() {
  Placed p{{}, {}, {}, {}};
  Mesh room;
  addBox(room, {-2, 0, -2}, {2, 3, 2}, true);
  room.normal.assign(room.position.size(), glm::vec3(0.0f));
  for (const glm::uvec3& t : room.triangle) {
    for (int k = 0; k < 3; ++k)
      room.normal[t[k]] =
          glm::normalize(glm::cross(room.position[t.y] - room.position[t.x], room.position[t.z] - room.position[t.x]));
  }
  addInstance(p.scene, std::move(room), "room");
  addInstance(p.scene, smoothBall(kRadius), "ball", glm::translate(glm::mat4(1.0f), kBallAt));
  p.scene.cameras = {test::cameraAt({-1.2f, 1.4f, 1.2f})};
  return p;
}

void place(Placed& p, std::uint32_t caches, Context& context, float minChartTexels = 1.0f) {
  CacheOptions options;
  options.lightmapCaches = caches;
  options.gridCaches = 200;
  options.minChartTexels = minChartTexels;
  test::place(p, options, test::walks(1u << 16), context);
}

// Root mean square angle between the normal of the ball and that of the caches its points read. [rad]
double normalError(const Placed& p, std::uint32_t instance) {
  const Instance& ball = p.scene.instances[instance];
  double sum = 0.0, count = 0.0;
  for (std::uint32_t t = 0; t < p.scene.meshes[ball.mesh].triangle.size(); ++t) {
    const auto read = readLightmap(p.caches, instance, t, glm::vec2(1.0f / 3.0f), false);
    const SurfacePoint point{instance, t, glm::vec2(1.0f / 3.0f)};
    const glm::vec3 n = geometricNormal(p.scene, point);
    if (read.gridLit || glm::length(read.normal) == 0.0f) continue;
    const double cosine = std::min(1.0, static_cast<double>(glm::dot(glm::normalize(read.normal), n)));
    sum += std::acos(cosine) * std::acos(cosine);
    ++count;
  }
  EXPECT_GT(count, 0.9 * static_cast<double>(p.scene.meshes[ball.mesh].triangle.size()));
  return std::sqrt(sum / count);
}

TEST(SmoothParts, texelsOfASmallBallFollowItsNormals) {
  Context context;
  Placed smooth = roomWithBall(), faceted = roomWithBall();
  faceted.scene.meshes[1].normal.clear();
  place(smooth, 3000, context);
  place(faceted, 3000, context);
  const double followed = normalError(smooth, 1), left = normalError(faceted, 1);
  EXPECT_LT(followed, 0.75 * left) << left;
  EXPECT_LT(followed, 0.06);
  // The count is kept.
  EXPECT_NEAR(smooth.caches.count(), faceted.caches.count(), 200);
}

// More nodes with the ball's mesh.
void addBalls(Placed& p, int count) {
  for (int i = 0; i < count; ++i) {
    Instance ball = p.scene.instances[1];
    ball.nodeIndex = static_cast<std::uint32_t>(p.scene.instances.size());
    ball.node += "." + std::to_string(i + 1);
    ball.firstTriangle = p.scene.triangleCount();
    ball.toWorld = glm::translate(glm::mat4(1.0f), glm::vec3(-1.5 + 0.6 * (i % 6), 0.4 + 0.5 * (i / 6), -1.0));
    p.scene.instances.push_back(ball);
  }
}

TEST(SmoothParts, densityFollowsCurvatureWithinABudget) {
  Context context;
  for (const bool many : {false, true}) {
    Placed p = roomWithBall();
    if (many) addBalls(p, 30);
    auto tracer = RayTracer::create(p.scene, "avx2", context);
    ASSERT_TRUE(tracer);
    PlaySpaceOptions all;
    all.mode = PlaySpaceOptions::Mode::all;
    const auto space = findPlaySpace(*tracer, all, 1, context);
    ASSERT_TRUE(space);
    PatchSet set = makePatches(p.scene, *space, {}, context);
    for (const float texel : {0.02f, 0.1f, 0.3f}) {
      followCurvature(set, texel);
      double even = 0.0, now = 0.0;
      for (const Patch& patch : set.patches) {
        even += static_cast<double>(patch.area) / (texel * texel);
        now += static_cast<double>(patch.area * patch.density * patch.density) / (texel * texel);
        EXPECT_GE(patch.density, patch.levelDensity);
        if (patch.instance == 0) {
          EXPECT_EQ(patch.density, 1.0f);
        }
        if (patch.instance == 0 || many) continue;
        const float turn = 2.0f / kRadius * texel / patch.density;
        if (texel == 0.1f) {
          EXPECT_NEAR(turn, kMaxTurn, 0.02f);
        }
        if (texel != 0.1f) {
          EXPECT_EQ(patch.density, 1.0f) << (texel < 0.1f ? "fine as it is" : "the budget would not mend it");
        }
      }
      EXPECT_LE(now, 1.101 * even) << texel;
      if (many && texel == 0.1f) {
        EXPECT_GT(now, 1.05 * even) << "the budget is used";
      }
    }
  }
}

// A bust: more texels than a small part, but turning far from one to the next.
TEST(SmoothParts, largerOnesGetTexelsTwiceAsDenseAtMost) {
  constexpr float kTexel = 0.067f;
  for (const auto& [area, factor] : {std::pair{0.5f, 2.68f}, {2.0f, 2.0f}, {14.0f, 1.0f}}) {
    PatchSet set;
    set.patches.resize(2);
    set.patches[0].area = area;
    set.patches[0].part = 0;
    set.patches[1].area = 200.0f;
    set.parts.push_back({0, area, 12.0f});
    followCurvature(set, kTexel);
    EXPECT_NEAR(set.parts[0].factor, factor, 0.01f) << area;
    EXPECT_EQ(set.patches[0].density, set.parts[0].factor);
    EXPECT_EQ(set.patches[1].density, 1.0f);
  }
}

std::vector<std::string> messagesOf(Placed& p, std::uint32_t caches, const std::string& about) {
  std::vector<std::string> found;
  Context context;
  context.onMessage = [&](Severity, std::string_view text) {
    if (text.find(about) != std::string_view::npos) found.emplace_back(text);
  };
  place(p, caches, context);
  return found;
}

// The number behind a word.
float numberAfter(const std::string& text, const std::string& word) {
  const std::size_t at = text.find(word);
  return at == std::string::npos ? 0.0f : std::strtof(text.c_str() + at + word.size(), nullptr);
}

double gridLitArea(const Placed& p, std::uint32_t instance) {
  double lit = 0.0, all = 0.0;
  const Instance& leaves = p.scene.instances[instance];
  for (std::uint32_t t = 0; t < p.scene.meshes[leaves.mesh].triangle.size(); ++t) {
    const double area = p.playSpace.seenArea[2 * (leaves.firstTriangle + t)];
    all += area;
    if (readLightmap(p.caches, instance, t, glm::vec2(0.3f), false).gridLit) lit += area;
  }
  EXPECT_GT(all, 0.0);
  return lit / all;
}

// A room with confetti, each piece much smaller than a texel and far from all others; and, of the same node, a block.
Placed confettiRoom(int pieces, float density, bool block = false) {
  Placed p = roomWithBall();
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  Mesh confetti;
  for (int i = 0; i < pieces; ++i) {
    const glm::vec3 c(1.8f * uniform(random), 1.5f + 1.3f * uniform(random), 1.8f * uniform(random));
    addTriangle(confetti, c, c + glm::vec3(0.018f, 0, 0), c + glm::vec3(0, 0.018f, 0.006f));
  }
  if (block) addBox(confetti, {-1.8f, 0.2f, -1.8f}, {-0.6f, 2.6f, -0.8f}, false);
  const std::uint32_t at = addInstance(p.scene, std::move(confetti), "confetti");
  p.scene.instances[at].texelDensity = density;
  return p;
}

TEST(LightmapAdvice, theDensityItNamesGivesSmallPiecesCaches) {
  Placed before = confettiRoom(1200, 1.0f);
  const auto said = messagesOf(before, 8192, "\"confetti\"");
  ASSERT_EQ(said.size(), 1u);
  EXPECT_GT(gridLitArea(before, 2), 0.4);
  const float density = numberAfter(said[0], " from 1 to ");
  ASSERT_GT(density, 1.0f) << said[0];
  EXPECT_NE(said[0].find("texelDensity of node \"confetti\""), std::string::npos) << said[0];
  EXPECT_NE(said[0].find("gridLit"), std::string::npos) << said[0];

  // With a cache more for each side of each piece, so that texels stay as they were.
  Placed after = confettiRoom(1200, density);
  messagesOf(after, 8192 + 2600, "");
  EXPECT_LT(gridLitArea(after, 2), 0.5 * gridLitArea(before, 2)) << said[0];
}

// A draft has large texels by intent: a density that mends it would be wrong in what follows.
TEST(LightmapAdvice, coarseBakesTellOfNoSmallPieces) {
  Placed p = confettiRoom(1200, 1.0f);
  EXPECT_TRUE(messagesOf(p, 4000, "too small for texels").empty());
  EXPECT_GT(gridLitArea(p, 2), 0.4);
}

// Where little of a node is small, its density would take texels from all else: few pieces are not worth a word then.
TEST(LightmapAdvice, aDensityThatTakesTheOthersTexelsIsNotAdvised) {
  Placed few = confettiRoom(1200, 1.0f, true), many = confettiRoom(15000, 1.0f, true);
  EXPECT_TRUE(messagesOf(few, 8192, "too small for texels").empty());
  const auto said = messagesOf(many, 8192, "too small for texels");
  ASSERT_EQ(said.size(), 1u);
  EXPECT_EQ(said[0].find(" from 1 to "), std::string::npos) << said[0];
  EXPECT_NE(said[0].find("join the pieces"), std::string::npos) << said[0];
}

TEST(LightmapAdvice, smoothPartsBeyondTheBudgetAreNamedWithTheirDensity) {
  Placed p = roomWithBall();
  const auto said = messagesOf(p, 450, "facets");
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("node \"ball\""), std::string::npos) << said[0];
  const float density = numberAfter(said[0], "texelDensity of ");
  ASSERT_GT(density, 1.0f) << said[0];
  Placed mended = roomWithBall();
  mended.scene.instances[1].texelDensity = density;
  EXPECT_TRUE(messagesOf(mended, 1000, "facets").empty());
}

TEST(LightmapAdvice, nodesThatShareASmoothMeshHaveOneLine) {
  Placed p = roomWithBall();
  addBalls(p, 3);
  p.scene.instances[3].texelDensity = 1.5f;
  const auto said = messagesOf(p, 450, "facets");
  ASSERT_EQ(said.size(), 2u);
  EXPECT_NE(said[0].find("node \"ball\" and 2 more of its mesh: 3."), std::string::npos) << said[0];
  EXPECT_NE(said[1].find("node \"ball.2\": 1."), std::string::npos) << said[1];
  EXPECT_NE(said[1].find("(now 1.5)"), std::string::npos) << said[1];
}

// A shelf that is thinner than what the play space tells apart is in order; faces that were forgotten or turned over
// are not.
TEST(LightmapAdvice, backsOfThinPlatesAreNotToldOf) {
  const auto said = [](const std::function<void(Scene&)>& change) {
    Placed p = roomWithBall();
    change(p.scene);
    std::vector<std::string> found;
    Context context;
    context.onMessage = [&](Severity, std::string_view text) {
      if (text.find("backs of its one-sided faces") != std::string_view::npos) found.emplace_back(text);
    };
    CacheOptions options;
    options.lightmapCaches = 400;
    options.gridCaches = 200;
    test::place(p, options, test::walks(1u << 10), context);  // few of them: coarse voxels
    return found;
  };
  EXPECT_TRUE(said([](Scene& scene) {
                Mesh shelf;
                addBox(shelf, {-1.5f, 1.0f, -1.9f}, {1.5f, 1.08f, -0.9f}, false);
                addInstance(scene, std::move(shelf), "shelf");
              }).empty());
  // This is closed, too.
  const auto room = said([](Scene& scene) {
    Mesh& mesh = scene.meshes[0];
    for (glm::uvec3& t : mesh.triangle) std::swap(t.y, t.z);
    mesh.normal.clear();
  });
  ASSERT_EQ(room.size(), 1u);
  EXPECT_NE(room[0].find("node \"room\""), std::string::npos) << room[0];
  // So is a hut that is seen from inside and outside.
  const auto hut = said([](Scene& scene) {
    Mesh mesh;
    addBox(mesh, {-1.9f, 0.05f, -0.5f}, {0.4f, 2.6f, 1.9f}, false);
    addInstance(scene, std::move(mesh), "hut");
    scene.cameras.push_back(test::cameraAt({1.2f, 1.4f, -1.2f}));
  });
  ASSERT_EQ(hut.size(), 1u);
  EXPECT_NE(hut[0].find("node \"hut\""), std::string::npos) << hut[0];
}

}  // namespace
}  // namespace relume
