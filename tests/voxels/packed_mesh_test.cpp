// SPDX-License-Identifier: MIT
// Meshes as a volume keeps them are those of the host; runs that are passed over have no triangle in the box.
#include "runtime/voxels/packed_mesh.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace relume {
namespace {

struct SmallTriangles {
  std::vector<glm::vec3> position;
  std::vector<glm::uvec3> triangle;
  std::vector<std::uint32_t> surface;
  std::array<VoxelSurface, 2> surfaces{};

  // In a box of that size; each run is some 0.1 of it wide. Half of them are leaves, of which a part is there.
  SmallTriangles(std::uint32_t count, float size, std::mt19937& random) {
    std::uniform_real_distribution<float> uniform(-0.5f, 0.5f);
    const auto somewhere = [&] { return glm::vec3(uniform(random), uniform(random), uniform(random)); };
    surfaces[1].coverage = 0.4f;
    glm::vec3 middle(0.0f);
    for (std::uint32_t t = 0; t < count; ++t) {
      if (t % kTrianglesOfRun == 0) middle = somewhere();
      const std::uint32_t first = 3 * t;
      for (int k = 0; k < 3; ++k) position.push_back(size * (middle + 0.1f * somewhere()));
      triangle.push_back({first, first + 1, first + 2});
      surface.push_back(t % 2);
    }
  }
  VoxelMesh mesh() const { return {position, triangle, surface}; }
};

glm::mat4x3 someTransform(float scale, float distance, std::mt19937& random) {
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  glm::mat4x3 toWorld;
  for (int c = 0; c < 4; ++c) {
    for (int k = 0; k < 3; ++k) toWorld[c][k] = (c < 3 ? scale : distance) * uniform(random);
  }
  return toWorld;
}

// The mesh without what is not there, as a host would hand it over.
SmallTriangles thoseThere(const SmallTriangles& made) {
  SmallTriangles there = made;
  there.triangle.clear();
  there.surface.clear();
  for (std::uint32_t t = 0; t < made.triangle.size(); ++t) {
    if (!isThere(made.surfaces[made.surface[t]].coverage, t)) continue;
    there.triangle.push_back(made.triangle[t]);
    there.surface.push_back(made.surface[t]);
  }
  return there;
}

PackedGeometry packed(const SmallTriangles& made) {
  const VoxelMesh mesh = made.mesh();
  return packGeometry({made.surfaces, {&mesh, 1}, {}}, {});
}

std::vector<SnappedTriangle> snapped(const VolumeGrid& grid, const SnapBox& box, const SmallTriangles& made,
                                     const glm::mat4x3& toWorld, SnapCounts& counts) {
  std::vector<SnappedTriangle> out;
  EXPECT_TRUE(snapTriangles(grid, box, made.mesh(), toWorld, out, counts));
  return out;
}

struct Place {
  glm::vec3 position{0.0f};
};

struct Unpacked {
  std::array<glm::vec3, 3> corner;
  std::uint32_t surface;
};

std::vector<Unpacked> unpacked(const PackedMesh& mesh) {
  std::vector<Unpacked> triangles;
  const auto placeAt = [](const glm::vec3& position) { return Place{position}; };
  RunReader<Place, decltype(placeAt)> reader(mesh, placeAt);
  for (std::size_t r = 0; r < mesh.run.size(); ++r) {
    reader.visit(r, [&](const std::array<Place, 3>& t, std::uint32_t surface) {
      triangles.push_back({{t[0].position, t[1].position, t[2].position}, surface});
      return true;
    });
  }
  return triangles;
}

// Triangles cut as hosts cut them, in the order that piece_trees.h tells.
struct CutTriangles {
  struct Rule : MiddleOfPlaces {
    float width;
    bool isLong(const glm::vec3& a, const glm::vec3& b) const { return glm::distance(a, b) > width; }
  };
  std::vector<glm::vec3> position;
  std::vector<glm::uvec3> triangle;
  std::vector<std::uint32_t> surface;
  std::vector<VoxelSurface> surfaces;

  CutTriangles(std::uint32_t wholes, float width, std::mt19937& random) {
    std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
    const auto somewhere = [&] { return glm::vec3(uniform(random), uniform(random), uniform(random)); };
    Rule rule;
    rule.width = width;
    std::vector<std::array<glm::vec3, 3>> stack;
    for (std::uint32_t w = 0; w < wholes; ++w) {
      const glm::vec3 at = 5.0f * somewhere();
      const float size = 0.5f + 0.5f * uniform(random);
      stack.push_back({at + size * somewhere(), at + size * somewhere(), at + size * somewhere()});
      while (!stack.empty()) {
        const std::array<glm::vec3, 3> piece = stack.back();
        stack.pop_back();
        if (splitOnce(rule, piece, stack)) continue;
        const auto first = static_cast<std::uint32_t>(position.size());
        position.insert(position.end(), piece.begin(), piece.end());
        triangle.push_back({first, first + 1, first + 2});
        surface.push_back(static_cast<std::uint32_t>(surfaces.size()));
        surfaces.emplace_back().albedo = 0.5f + 0.05f * somewhere();
        // Neighbours as far apart as colours are
        if (surfaces.size() % 200 < 3) surfaces.back().albedo = {1.0f, surfaces.size() % 2 == 0 ? 1.0f : 0.0f, 0.0f};
        if (surfaces.size() % 200 == 3) surfaces.back().albedo = {0.0f, 1.0f, 0.0f};
        if (surfaces.size() % 150 > 70) surfaces.back().emission = glm::vec3(static_cast<float>(surfaces.size()));
      }
    }
  }
};

// Colours of materials are kept as they are; those of a texture to a 16th of what they vary by, and their mean.
TEST(PackedMesh, albedoIsOffByALittleOfWhatNeighboursVaryBy) {
  std::mt19937 random(29);
  std::uniform_real_distribution<float> uniform;
  const auto stepsOf = [](const VoxelSurface& surface) {
    return glm::ivec3(glm::floor(surface.albedo * float{kAlbedoSteps} + 0.5f));
  };
  const auto colour = [&] { return glm::vec3(uniform(random), uniform(random), uniform(random)); };
  for (const bool textured : {false, true}) {
    std::vector<VoxelSurface> surfaces(64 * 40 + 11);
    std::vector<glm::vec3> material(30);
    for (glm::vec3& each : material) each = colour();
    for (std::size_t i = 0; i < surfaces.size(); ++i)
      surfaces[i].albedo =
          textured ? 0.1f + 0.2f * colour() + static_cast<float>(i / 64) / 60.0f : material[random() % material.size()];
    SummedSurfaces kept;
    for (const VoxelSurface& each : surfaces) kept.add(each, textured);
    glm::dvec3 sum(0.0);
    for (std::uint32_t i = 0; i < surfaces.size(); ++i) {
      const glm::ivec3 off = kept.albedo(i) - stepsOf(surfaces[i]);
      if (!textured || i >= 64 * 40) {
        ASSERT_EQ(off, glm::ivec3(0)) << i;
      }
      // Green varies by 0.2, what red and blue are off it by twice that; steps are of powers of two.
      ASSERT_LE(std::abs(off.y), 2 * kAlbedoSteps / 5 / 31) << i;
      ASSERT_LE(std::max(std::abs(off.x), std::abs(off.z)), 6 * kAlbedoSteps / 5 / 31) << i;
      sum += glm::dvec3(off);
    }
    const glm::dvec3 mean = sum / static_cast<double>(surfaces.size());
    for (int k = 0; k < 3; ++k) EXPECT_LT(std::abs(mean[k]), 1.0) << k;
    EXPECT_LT(static_cast<double>(kept.bytes()) / static_cast<double>(surfaces.size()), textured ? 2.4 : 5.1);
  }
  // Whatever is beside them, colours that reflect more or less than all are not made.
  std::vector<VoxelSurface> surfaces(64);
  for (std::size_t i = 0; i < 64; ++i)
    surfaces[i].albedo = i == 5 ? glm::vec3(1.0f) : i == 6 ? glm::vec3(0.0f) : colour();
  SummedSurfaces kept;
  for (const VoxelSurface& each : surfaces) kept.add(each, true);
  for (std::uint32_t i = 0; i < 64; ++i) {
    for (int k = 0; k < 3; ++k) {
      ASSERT_GE(kept.albedo(i)[k], 0);
      ASSERT_LE(kept.albedo(i)[k], kAlbedoSteps);
    }
  }
}

TEST(PackedMesh, piecesAreKeptAsWhatTheyWereCutFrom) {
  std::mt19937 random(11);
  for (const float width : {0.2f, 0.4f, 0.8f}) {
    const std::uint32_t wholes = 600;
    const CutTriangles made(wholes, width, random);
    const VoxelMesh host{made.position, made.triangle, made.surface};
    const PackedGeometry geometry = packGeometry({made.surfaces, {&host, 1}, {}}, {});
    SummedSurfaces alone;  // in the same order, as each triangle has its own
    for (const VoxelSurface& each : made.surfaces) alone.add(each, true);
    const std::vector<Unpacked> triangles = unpacked(geometry.mesh[0]);
    ASSERT_EQ(triangles.size(), made.triangle.size());
    ASSERT_GT(triangles.size(), 2 * wholes);
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(triangles[t].corner[c], made.position[3 * t + c]) << t;
      const VoxelSurface& own = made.surfaces[t];
      ASSERT_EQ(geometry.surfaces.albedo(triangles[t].surface), alone.albedo(static_cast<std::uint32_t>(t)));
      const SurfaceEmission* const emits = geometry.surfaces.emission(triangles[t].surface);
      ASSERT_EQ(emits != nullptr, own.emission != glm::vec3(0.0f));
      if (emits != nullptr) {
        ASSERT_EQ(emits->emission, own.emission);
      }
    }
    // Vertices of what was cut and of what ends of runs leave of it: where triangles are cut often, next to none.
    const double bits = 8.0 * static_cast<double>(geometry.mesh[0].bytes()),
                 count = static_cast<double>(triangles.size());
    EXPECT_LT(bits / count, width < 0.5f ? 60.0 : 140.0) << width;
    EXPECT_LT(static_cast<double>(geometry.surfaces.bytes()), 2.4 * count + 20.0 * count + 1100.0);
  }
}

TEST(PackedBits, areWhatWasPutIn) {
  std::mt19937_64 random(3);
  PackedBits bits;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> put;
  for (int i = 0; i < 2000; ++i) {
    const auto width = static_cast<std::uint32_t>(random() % (PackedBits::kWidest + 1));
    put.emplace_back(random() & ((std::uint64_t{1} << width) - 1), width);
    bits.add(put.back().first, width);
  }
  PackedBitsReader reader(bits, 0);
  for (const auto& [value, width] : put) ASSERT_EQ(reader.next(width), value);
  EXPECT_EQ(reader.place(), bits.size());
}

TEST(PackedMesh, hasItsTrianglesAndTheirSurfaces) {
  std::mt19937 random(4);
  SmallTriangles made(9 * kTrianglesOfRun + 5, 5.0f, random);
  made.surfaces[0].albedo = {0.25f, 0.5f, 1.0f};
  made.surfaces[1].emission = {0.0f, 2.0f, 0.5f};
  made.surfaces[1].doubleSided = true;
  // Strips, so that triangles share vertices by their places and by their numbers
  for (std::size_t t = 1; t < made.triangle.size(); t += 2) made.triangle[t].x = made.triangle[t - 1].z;
  for (std::size_t t = 2; t < made.triangle.size(); t += 3) made.position[made.triangle[t].y] = made.position[0];
  const SmallTriangles there = thoseThere(made);
  const PackedGeometry geometry = packed(made);
  const PackedMesh& mesh = geometry.mesh[0];
  ASSERT_EQ(mesh.triangles, there.triangle.size());
  ASSERT_EQ(mesh.run.size(), (there.triangle.size() + kTrianglesOfRun - 1) / kTrianglesOfRun);
  EXPECT_LT(mesh.bytes(), there.triangle.size() * 3 * sizeof(glm::vec3) * 9 / 10)
      << "vertices that triangles share are kept once";
  EXPECT_EQ(geometry.surfaces.size(), 2 * mesh.run.size());
  const std::vector<Unpacked> triangles = unpacked(mesh);
  ASSERT_EQ(triangles.size(), there.triangle.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (int c = 0; c < 3; ++c) {
      const glm::vec3& p = triangles[t].corner[static_cast<std::size_t>(c)];
      ASSERT_EQ(p, there.position[there.triangle[t][c]]) << t;
      const TriangleRun& run = mesh.run[t / kTrianglesOfRun];
      ASSERT_EQ(glm::clamp(p, run.min, run.max), p) << t;
    }
    const std::uint32_t surface = triangles[t].surface;
    const bool emits = there.surface[t] == 1;
    ASSERT_EQ(geometry.surfaces.albedo(surface), emits ? glm::ivec3(2048) : glm::ivec3(1024, 2048, 4095)) << t;
    const SurfaceEmission* const emission = geometry.surfaces.emission(surface);
    ASSERT_EQ(emission != nullptr, emits) << t;
    if (emits) {
      ASSERT_EQ(emission->emission, made.surfaces[1].emission);
      ASSERT_TRUE(emission->doubleSided);
    }
  }
  EXPECT_EQ(geometry.surfaces.brightest(), 2.0f);
}

TEST(PackedMesh, snapsAsTheHostsMesh) {
  std::mt19937 random(7);
  VolumeGrid grid;
  grid.voxel = 0.1f;
  grid.cells = glm::ivec3(16);
  std::size_t kept = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const SmallTriangles made(10 * kTrianglesOfRun + 17, 5.0f, random), there = thoseThere(made);
    const PackedGeometry geometry = packed(made);
    const auto runs = static_cast<std::uint32_t>(geometry.mesh[0].run.size());
    const glm::mat4x3 toWorld = someTransform(1.0f, 4.0f, random);
    const SnapBox all = SnapBox::of(grid);
    const SnapBox box{trial % 2 == 0 ? all.low : all.high / 3, trial % 3 == 0 ? all.high : all.high * 2 / 3};
    SnapCounts counts, expectedCounts;
    std::vector<SnappedTriangle> found;
    ASSERT_TRUE(snapRuns(grid, box, geometry.mesh[0], toWorld, 0, runs, found, counts));
    const std::vector<SnappedTriangle> expected = snapped(grid, box, there, toWorld, expectedCounts);
    ASSERT_EQ(found.size(), expected.size());
    kept += found.size();
    for (std::size_t t = 0; t < found.size(); ++t) {
      ASSERT_EQ(found[t].corner, expected[t].corner);
      ASSERT_EQ(found[t].normal, expected[t].normal);
      ASSERT_EQ(found[t].area, expected[t].area);
    }
    EXPECT_EQ(counts.outside, expectedCounts.outside);
    EXPECT_EQ(counts.split, expectedCounts.split);
    EXPECT_EQ(counts.zeroArea, expectedCounts.zeroArea);
  }
  EXPECT_GT(kept, 300u);
}

TEST(TriangleRuns, thatArePassedOverHaveNothingInTheBox) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> step(0, 16 * kBrickSide * kVoxelSteps);
  VolumeGrid grid;
  grid.voxel = 0.1f;
  grid.cells = glm::ivec3(16);
  std::size_t passedOver = 0, looked = 0;
  for (int trial = 0; trial < 60; ++trial) {
    // The last run has fewer triangles than the others.
    const SmallTriangles there = thoseThere(SmallTriangles(10 * kTrianglesOfRun + 17, 5.0f, random));
    SmallTriangles all = there;
    all.surfaces[1].coverage = 1.0f;
    const PackedGeometry geometry = packed(all);
    const VolumeGrid moved = shifted(grid, {trial % 5 - 2, trial % 3 - 1, trial % 7 - 3});
    SnapBox box;
    for (int k = 0; k < 3; ++k) {
      const int a = step(random), b = step(random);
      box.low[k] = std::min(a, b);
      box.high[k] = std::max(a, b);
    }
    const glm::mat4x3 toWorld = someTransform(1.0f, 4.0f, random);
    const RunsOutside isOutside(moved, box, toWorld);
    for (std::size_t r = 0; r < geometry.mesh[0].run.size(); ++r) {
      ++looked;
      if (!isOutside(geometry.mesh[0].run[r])) continue;
      ++passedOver;
      SmallTriangles run = all;
      const auto from = static_cast<std::ptrdiff_t>(r * kTrianglesOfRun);
      const auto to =
          std::min(from + std::ptrdiff_t{kTrianglesOfRun}, static_cast<std::ptrdiff_t>(all.triangle.size()));
      run.triangle.assign(all.triangle.begin() + from, all.triangle.begin() + to);
      run.surface.assign(all.surface.begin() + from, all.surface.begin() + to);
      SnapCounts counts;
      EXPECT_TRUE(snapped(moved, box, run, toWorld, counts).empty());
      EXPECT_EQ(counts.outside, run.triangle.size());
    }
  }
  // Boxes are a third of the grid along each axis, and the levels larger than it.
  EXPECT_GT(passedOver, looked / 2);
  EXPECT_LT(passedOver, looked);
}

// Snapping holds back what is too far off, and where sums of such places lie is not told by their bounds.
TEST(TriangleRuns, tooFarOffAreLookedAt) {
  std::mt19937 random(6);
  const SmallTriangles made(kTrianglesOfRun, 5.0f, random);
  const std::vector<TriangleRun> runs = packed(made).mesh[0].run;
  VolumeGrid grid;
  grid.cells = glm::ivec3(8);
  for (const float scale : {1e9f, 1e20f, 1e38f}) {
    glm::mat4x3 toWorld(1.0f);
    toWorld[0] *= scale;
    EXPECT_FALSE(RunsOutside(grid, SnapBox::of(grid), toWorld)(runs[0])) << scale;
  }
  glm::mat4x3 beside(1.0f);
  beside[3] = glm::vec3(1000.0f, 0.0f, 0.0f);
  EXPECT_TRUE(RunsOutside(grid, SnapBox::of(grid), beside)(runs[0]));
}

}  // namespace
}  // namespace relume
