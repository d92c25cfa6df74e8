// SPDX-License-Identifier: MIT
// The voxel volume as a whole: threads, what moves, edits, levels far away, and what is refused.
#include "runtime/voxels/voxel_volume.h"
#include "tests/voxels/boxes.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace relume {
namespace {

using test::unit, test::VoxelLevel;

template <class T>
bool sameBytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

TEST(VoxelVolume, sameBytesOnTwoThreads) {
  VoxelLevel level;
  level.surfaces = {{{0.3f, 0.6f, 0.9f}, {1, 2, 3}, 0.7f, true}};
  std::mt19937 random(5);
  for (int i = 0; i < 20; ++i) {
    const glm::vec3 at = 3.0f * unit(random);
    level.addBox(at, at + glm::vec3(1.3f), i % 2 == 0);
  }
  const auto one = VoxelVolume::create(level.geometry(), {});
  VoxelOptions options;
  options.parallelFor = test::onTwoThreads;
  const auto two = VoxelVolume::create(level.geometry(), options);
  ASSERT_TRUE(one && two);
  EXPECT_TRUE(sameBytes(one->standing().bits, two->standing().bits));
  EXPECT_TRUE(one->standing().sides == two->standing().sides);
  EXPECT_TRUE(sameBytes(one->standing().axis, two->standing().axis));
  EXPECT_TRUE(one->standing().subVoxels == two->standing().subVoxels);
}

TEST(VoxelVolume, whatMovesIsVoxelisedAsWhatStands) {
  VoxelLevel standing, moving;
  for (VoxelLevel* level : {&standing, &moving}) {
    level->addBox({-4, -4, -4}, {4, 4, 4}, true);
    level->addBox({-1, -1, -1}, {1, 1, 1}, false);
  }
  const glm::mat4x3 to({0.6f, 0.8f, 0}, {0.8f, -0.6f, 0}, {0, 0, 1}, {1.2f, 0.3f, -0.7f});  // turned and mirrored
  standing.parts[1].toWorld = to;
  moving.parts[1].moves = true;
  const auto still = VoxelVolume::create(standing.geometry(), {});
  VoxelOptions options;
  options.boxMin = {-4, -4, -4};
  options.boxMax = {4, 4, 4};
  auto volume = VoxelVolume::create(moving.geometry(), options);
  ASSERT_TRUE(still && volume);
  const std::vector<std::uint64_t> before(volume->bits().begin(), volume->bits().end());
  ASSERT_TRUE(volume->move({&to, 1}));
  EXPECT_TRUE(std::equal(volume->bits().begin(), volume->bits().end(), still->bits().begin()));
  const MarchHit hit = volume->march({1.2f, 0.3f, 3}, {0, 0, -1}, 8.0f);
  ASSERT_TRUE(hit.found);
  const std::uint32_t side = volume->sideAt(hit.voxel, {0, 0, -1});
  EXPECT_GE(side, volume->standingSides());
  EXPECT_TRUE(volume->side(side).isFaced) << "the front of a mirrored part faces outward";
  // Refused: nothing changes.
  const std::vector<std::uint64_t> moved(volume->bits().begin(), volume->bits().end());
  glm::mat4x3 bad = to;
  bad[3].x = std::numeric_limits<float>::quiet_NaN();
  const Status refused = volume->move({&bad, 1});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("part 1"), std::string::npos) << refused.error().message;
  EXPECT_FALSE(volume->move({}));
  EXPECT_TRUE(std::equal(moved.begin(), moved.end(), volume->bits().begin()));
}

// Where nothing moves no bits are kept for it, and those of both are those of what stands.
TEST(VoxelVolume, aPartThatLeavesTakesItsBitsAlong) {
  VoxelLevel level;
  level.addBox({-4, -4, -4}, {4, 4, 4}, true);
  level.addBox({-1, -1, -1}, {1, 1, 1}, false);
  level.parts[1].moves = true;
  VoxelOptions options;
  options.boxMin = {-4, -4, -4};
  options.boxMax = {4, 4, 4};
  auto volume = VoxelVolume::create(level.geometry(), options);
  ASSERT_TRUE(volume);
  const auto bytes = [&] {
    std::size_t sum = 0;
    for (const auto& [name, size] : volume->bufferSizes()) sum += size;
    return sum;
  };
  const auto voxelAt = [&](const glm::vec3& p) { return glm::ivec3(glm::floor(volume->grid().toGrid(p))); };
  const std::vector<std::uint64_t> within(volume->bits().begin(), volume->bits().end());
  const std::size_t full = bytes(), cells = volume->grid().cellCount();
  glm::mat4x3 to(1.0f);
  for (const float x : {20.0f, 0.0f, 20.0f, 0.0f}) {
    to[3].x = x;
    ASSERT_TRUE(volume->move({&to, 1}));
    const bool isIn = x == 0.0f;
    EXPECT_EQ(volume->hasMoving(), isIn);
    const std::vector<std::uint64_t>&bits = isIn ? within : volume->standing().bits,
          &rays = volume->standing().subVoxels.bits;
    EXPECT_TRUE(std::equal(volume->bits().begin(), volume->bits().end(), bits.begin(), bits.end()));
    EXPECT_EQ(std::equal(volume->rayBits().begin(), volume->rayBits().end(), rays.begin(), rays.end()), !isIn);
    EXPECT_EQ(volume->isOccupied(voxelAt({0.999f, 0, 0})), isIn);
    EXPECT_EQ(volume->march({0, 0, 3}, {0, 0, -1}, 3.0f).found, isIn);
    EXPECT_EQ(volume->sideCount() > volume->standingSides(), isIn);
    EXPECT_EQ(volume->radianceAt(voxelAt({-3.999f, 0, 0}), {-1, 0, 0}), glm::vec3(0.0f));
    // Four numbers of 64 bits a cell, and two of 32
    EXPECT_EQ(bytes() == full, isIn);
    EXPECT_EQ(bytes() + 40 * cells <= full, !isIn);
  }
}

TEST(VoxelVolume, anEditedPartGoesAndComesBack) {
  VoxelLevel level;
  level.addBox({-4, -4, -4}, {4, 4, 4}, true);
  level.addBox({-1, -1, -1}, {1, 1, 1}, false);
  auto volume = VoxelVolume::create(level.geometry(), {});
  ASSERT_TRUE(volume);
  const std::vector<std::uint64_t> before(volume->bits().begin(), volume->bits().end());
  const auto seesBox = [&] { return volume->march({0, 0, 3}, {0, 0, -1}, 3.0f).found; };
  EXPECT_TRUE(seesBox());
  ASSERT_TRUE(volume->edit(std::vector<PartEdit>{{1, glm::mat4x3(1.0f), false}}));
  EXPECT_FALSE(seesBox());
  ASSERT_TRUE(volume->edit(std::vector<PartEdit>{{1}}));
  EXPECT_TRUE(std::equal(before.begin(), before.end(), volume->bits().begin()));
  EXPECT_FALSE(volume->edit(std::vector<PartEdit>{{2}}));
}

// Voxels, their sides, and what the volume counted, to the bit.
void expectSame(const VoxelVolume& a, const VoxelVolume& b) {
  const VoxelLayer &x = a.standing(), &y = b.standing();
  EXPECT_EQ(x.bits, y.bits);
  EXPECT_EQ(x.first, y.first);
  EXPECT_EQ(x.axis, y.axis);
  EXPECT_TRUE(x.subVoxels == y.subVoxels);
  EXPECT_EQ(x.kept, y.kept);
  EXPECT_TRUE(x.sides == y.sides) << "bytes of the sides";
  EXPECT_EQ(x.emitters, y.emitters);
  ASSERT_EQ(x.emission.size(), y.emission.size());
  for (std::size_t i = 0; i < x.emission.size(); ++i)
    ASSERT_TRUE(x.emission[i].side == y.emission[i].side && x.emission[i].emission == y.emission[i].emission) << i;
  const VoxelStats p = a.stats(), q = b.stats();
  EXPECT_EQ(p.occupied, q.occupied);
  EXPECT_EQ(p.dropped, q.dropped);
  EXPECT_EQ(p.triangles, q.triangles);
  EXPECT_EQ(p.split, q.split);
  EXPECT_EQ(p.outside, q.outside);
  EXPECT_EQ(p.zeroArea, q.zeroArea);
}

// An edit looks at few voxels and leaves what making the volume of the edited level would: boxes that overlap, some
// emitting, some half there, moved, turned, taken away and put back.
TEST(VoxelVolume, anEditedVolumeIsThatOfTheEditedLevel) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-3.5f, 3.5f), size(0.1f, 1.5f);
  VoxelLevel level;
  level.surfaces.resize(3);
  level.surfaces[1].emission = {2.0f, 1.0f, 0.5f};
  level.surfaces[2].coverage = 0.6f;
  level.addBox({-4, -4, -4}, {4, 4, 4}, true);
  for (std::uint32_t i = 0; i < 40; ++i) {
    const glm::vec3 low(place(random), place(random), place(random));
    level.addBox(low, low + glm::vec3(size(random), size(random), size(random)), false, i % 3);
  }
  VoxelOptions options;
  options.boxMin = glm::vec3(-4.0f);
  options.boxMax = glm::vec3(4.0f);
  options.cells = 16;
  for (const std::uint32_t budget : {0u, 3000u}) {
    options.surfaceBudget = budget;
    auto edited = VoxelVolume::create(level.geometry(), options);
    ASSERT_TRUE(edited);
    EXPECT_EQ(edited->stats().dropped > 0, budget > 0);
    VoxelLevel now = level;
    std::vector<std::uint8_t> present(now.parts.size(), 1);
    for (int step = 0; step < 12; ++step) {
      std::vector<PartEdit> edits;
      for (int i = 0; i <= step % 3; ++i) {
        // Part 0 is the room: a tenth of all triangles, in most of the voxels' cells.
        const std::uint32_t part = step == 5 && i == 0 ? 0 : 1 + static_cast<std::uint32_t>(random() % 40);
        glm::mat4x3 to(1.0f);
        to[3] = 0.3f * glm::vec3(place(random), place(random), place(random));
        if (i == 1) to[0] = {0.6f, 0.8f, 0.0f}, to[1] = {-0.8f, 0.6f, 0.0f};
        edits.push_back({part, to, random() % 4 != 0});
        now.parts[part].toWorld = to;
        present[part] = edits.back().present ? 1 : 0;
      }
      ASSERT_TRUE(edited->edit(edits));
      VoxelLevel there = now;
      for (std::size_t p = 0; p < present.size(); ++p) {
        if (present[p] == 0) there.meshes[p].triangle.clear(), there.meshes[p].surface.clear();
      }
      auto made = VoxelVolume::create(there.geometry(), options);
      ASSERT_TRUE(made);
      expectSame(*edited, *made);
      if (HasFatalFailure()) return;
    }
  }
}

// Who keeps what is found of a volume is not to take another for it.
TEST(VoxelVolume, versionsAreOfOneVolumeAlone) {
  VoxelLevel level;
  level.addBox({-4, -4, -4}, {4, 4, 4}, true);
  level.addBox({-1, -1, -1}, {1, 1, 1}, false);
  level.parts[1].moves = true;
  auto one = VoxelVolume::create(level.geometry(), {}), two = VoxelVolume::create(level.geometry(), {});
  ASSERT_TRUE(one && two);
  const VoxelVolume copy = *one;
  EXPECT_EQ(copy.standingVersion(), one->standingVersion());
  EXPECT_NE(one->standingVersion(), two->standingVersion());
  EXPECT_NE(one->movingVersion(), two->movingVersion());
  const glm::mat4x3 here(1.0f);
  ASSERT_TRUE(one->move({&here, 1}) && two->move({&here, 1}));
  EXPECT_NE(one->movingVersion(), two->movingVersion());
  EXPECT_NE(one->movingVersion(), copy.movingVersion());
  const PartEdit gone{0, here, false};
  ASSERT_TRUE(one->edit({&gone, 1}) && two->edit({&gone, 1}));
  EXPECT_NE(one->standingVersion(), two->standingVersion());
}

TEST(VoxelVolume, aLevelFarAwayHasTheSameVoxels) {
  VoxelLevel here, there;
  const glm::vec3 far(131072.0f, 0.0f, -65536.0f);
  here.addBox({0, 0, 0}, {8, 4, 8}, true);
  here.addBox({2, 0, 3}, {3.5f, 2.25f, 5}, false);
  there = here;
  for (VoxelPart& part : there.parts) part.toWorld[3] = far;
  VoxelOptions options;
  options.cells = 8;
  const auto a = VoxelVolume::create(here.geometry(), options), b = VoxelVolume::create(there.geometry(), options);
  ASSERT_TRUE(a && b);
  ASSERT_EQ(a->bits().size(), b->bits().size());
  EXPECT_TRUE(std::equal(a->bits().begin(), a->bits().end(), b->bits().begin()));
}

TEST(VoxelVolume, nothingAndDegenerateThingsAreTaken) {
  const auto empty = VoxelVolume::create({}, {});
  ASSERT_TRUE(empty) << empty.error().message;
  EXPECT_EQ(empty->stats().occupied, 0u);
  VoxelLevel level;
  level.addBox({0, 0, 0}, {1, 1, 1}, true);
  level.addQuad({0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, 0.5f}, {0.6f, 0.5f, 0.5f}, {0.7f, 0.5f, 0.5f});
  level.addBox({0, 0, 0}, {1, 1, 1}, true);
  level.parts.back().toWorld = glm::mat4x3(0.0f);
  VoxelOptions options;
  options.boxMin = {0.25f, 0.25f, 0.25f};
  options.boxMax = {2, 2, 2};
  const auto volume = VoxelVolume::create(level.geometry(), options);
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_GT(volume->stats().zeroArea, 0u);
  EXPECT_GT(volume->stats().outside, 0u);
}

// Sub-meshes may share a vertex buffer, of which each uses a part.
TEST(VoxelVolume, itsBoxIsThatOfTheTriangles) {
  VoxelLevel level;
  level.addBox({-4, -4, -4}, {4, 4, 4}, true);
  level.parts[0].toWorld[3] = {1, 2, 3};
  VoxelOptions options;
  options.cells = 8;
  const auto alone = VoxelVolume::create(level.geometry(), options);
  VoxelLevel::Mesh& mesh = level.meshes[0];
  mesh.position.insert(mesh.position.begin(), {300, 0, 0});
  mesh.position.push_back({0, -200, 0});
  for (glm::uvec3& index : mesh.triangle) index += 1u;
  level.meshes.push_back({{{0, 0, 90}}, {}, {}});
  level.parts.push_back({1, glm::mat4x3(1.0f), false});
  const auto shared = VoxelVolume::create(level.geometry(), options);
  ASSERT_TRUE(alone && shared);
  EXPECT_EQ(shared->grid().originWorld, alone->grid().originWorld);
  EXPECT_EQ(shared->grid().voxel, alone->grid().voxel);
  EXPECT_EQ(shared->grid().cells, alone->grid().cells);
  EXPECT_TRUE(std::equal(shared->bits().begin(), shared->bits().end(), alone->bits().begin(), alone->bits().end()));
}

TEST(VoxelVolume, badInputIsNamed) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto refuses = [](const std::function<void(VoxelLevel&, VoxelOptions&)>& spoil, const std::string& text) {
    VoxelLevel level;
    level.addBox({0, 0, 0}, {1, 1, 1}, true);
    VoxelOptions options;
    spoil(level, options);
    const auto volume = VoxelVolume::create(level.geometry(), options);
    ASSERT_FALSE(volume) << text;
    EXPECT_EQ(volume.error().code, ErrorCode::usage);
    EXPECT_NE(volume.error().message.find(text), std::string::npos) << volume.error().message;
  };
  refuses([&](VoxelLevel& l, VoxelOptions&) { l.meshes[0].position[3].y = nan; }, "mesh 0: vertex 3");
  refuses([&](VoxelLevel& l, VoxelOptions&) { l.meshes[0].triangle[5].z = 8; }, "triangle 5 has vertex 8 of 8");
  refuses([&](VoxelLevel& l, VoxelOptions&) { l.meshes[0].surface[5] = 1; }, "triangle 5 has surface 1 of 1");
  refuses([&](VoxelLevel& l, VoxelOptions&) { l.meshes[0].surface.pop_back(); }, "11 surfaces for 12 triangles");
  refuses([&](VoxelLevel& l, VoxelOptions&) { l.surfaces[0].albedo.y = 1.01f; }, "surface 0: albedo");
  refuses([&](VoxelLevel& l, VoxelOptions&) { l.surfaces[0].emission.x = -1.0f; }, "surface 0: emission");
  refuses([&](VoxelLevel& l, VoxelOptions&) { l.surfaces[0].coverage = nan; }, "surface 0: coverage");
  refuses([&](VoxelLevel& l, VoxelOptions&) { l.parts[0].mesh = 7; }, "part 0 has mesh 7 of 1");
  refuses([&](VoxelLevel& l, VoxelOptions&) { l.parts[0].toWorld[1].z = nan; }, "part 0: column 1");
  refuses([&](VoxelLevel&, VoxelOptions& o) { o.cells = 7; }, "7 cells");
  refuses([&](VoxelLevel&, VoxelOptions& o) { o.cells = 65; }, "65 cells");
  refuses([&](VoxelLevel&, VoxelOptions& o) { o.boxMax.z = nan; }, "box");
  refuses([&](VoxelLevel&, VoxelOptions& o) { o.boxMax = {1, -1, 1}; }, "axis 1");
}

}  // namespace
}  // namespace relume
