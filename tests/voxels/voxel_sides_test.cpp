// SPDX-License-Identifier: MIT
// What the sides of voxels are, and how they are kept.
#include "runtime/voxels/packed_sides.h"
#include "runtime/voxels/voxel_volume.h"
#include "tests/voxels/boxes.h"
#include "tests/voxels/closed_surface.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace relume {
namespace {

using test::closedSurface, test::unit, test::VoxelLevel;

glm::ivec3 inBytes(const glm::vec3& normal) { return glm::ivec3(glm::floor(127.0f * normal + 0.5f)); }

// A voxel's sides by chance: one or both are faced, flat or curved, along an axis or not, of planes that pass through
// the voxel and of places that are on none.
MadeSides someSides(std::mt19937& random) {
  std::uniform_real_distribution<float> place(-1.9f, 1.9f), share(0.0f, 1.0f);
  std::uniform_int_distribution<int> step(-32, 32), kind(0, 11);
  const auto three = [&](auto& from) { return glm::vec3(from(random), from(random), from(random)); };
  MadeSides made;
  const int faced = kind(random) % 3;
  for (std::size_t s = 0; s < 2; ++s) {
    VoxelSide& side = made.side[s];
    side = {three(place), unit(random), three(share), faced == 2 || faced == static_cast<int>(s)};
    // Along axes and diagonals as well, where the octahedron has its edges
    if (kind(random) < 4) side.normal = glm::normalize(glm::round(2.0f * side.normal) + glm::vec3(0.0f, 0.0f, 1e-30f));
    if (!side.isFaced) continue;
    made.area[s] = 4e-5f * share(random) + 1e-9f;
    const int curved = kind(random), off = kind(random);
    glm::vec3 normal = side.normal;
    int plane = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      if (i == 0 || curved % 4 == 3) {
        normal = kind(random) < 4 ? glm::vec3(0.0f, 0.0f, kind(random) < 6 ? -1.0f : 1.0f) : unit(random);
        plane = (kind(random) - 6) * (kind(random) == 0 ? 12700 : 127);
      }
      const glm::ivec3 n = inBytes(normal);
      made.places[s][i] = {subPlaceOn(i, n, plane), n, plane};
      if (off < 3 && kind(random) < 5) made.places[s][i].place = glm::ivec3(three(step));
    }
  }
  if (faced != 2) {
    made.side[static_cast<std::size_t>(1 - faced)].normal = -made.side[static_cast<std::size_t>(faced)].normal;
    made.side[static_cast<std::size_t>(1 - faced)].albedo = made.side[static_cast<std::size_t>(faced)].albedo;
  }
  return made;
}

void expectHeld(const MadeSides& made, const std::array<VoxelSide, 2>& sides,
                const std::array<SideSurface, 2>& surfaces) {
  for (std::size_t s = 0; s < 2; ++s) {
    const VoxelSide &was = made.side[s], &held = sides[s];
    ASSERT_EQ(held.isFaced, was.isFaced);
    for (int k = 0; k < 3; ++k) {
      ASSERT_LE(std::abs(held.place[k] - was.place[k]), 0x1p-9f);
      ASSERT_LE(std::abs(held.albedo[k] - was.albedo[k]), 0x1.01p-13f);
      ASSERT_LE(std::abs(held.normal[k] - was.normal[k]), 2e-3f);
    }
    ASSERT_NEAR(glm::length(held.normal), 1.0f, 1e-6f);
    ASSERT_NEAR(surfaces[s].area, made.area[s], 0x1.01p-10f * made.area[s]);
    const std::size_t from = was.isFaced ? s : 1 - s;
    std::uint32_t count = 0;
    for (const SideSample& sample : surfaces[s].samples) {
      const glm::ivec3 normal = was.isFaced ? sample.normal() : -sample.normal();
      if (sample.count() > 0) {
        const auto same = std::count_if(made.places[from].begin(), made.places[from].end(), [&](const SubPlace& place) {
          return place.place == sample.place() && place.normal == normal;
        });
        ASSERT_EQ(sample.count(), static_cast<std::uint32_t>(same));
      }
      count += sample.count();
    }
    ASSERT_EQ(count, 4u);
  }
}

// What is rounded of sides, and what is kept as it was found; cells copied, and those made from voxels of two.
TEST(VoxelSides, areRoundedByLessThanTheirBounds) {
  std::mt19937 random(11);
  const float face = 1e-4f;
  PackedSides packed(face), other(face), copy(face), merged(face);
  std::vector<std::vector<MadeSides>> cells(200), others(200);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    for (auto* const to : {&cells[c], &others[c]}) {
      to->resize(random() % 5 == 0 ? 0 : random() % 65);
      for (MadeSides& each : *to) each = someSides(random);
    }
    packed.addCell(cells[c]);
    other.addCell(others[c]);
  }
  const auto expectCell = [](const PackedSides& from, std::size_t c, const std::vector<MadeSides>& made) {
    const auto voxels = static_cast<std::uint32_t>(made.size());
    if (voxels == 0) return;
    CellSides sides(from, c, voxels), skipping(from, c, voxels);
    CellSurfaces surfaces(from, c, voxels);
    std::uint32_t v = 0;
    for (const MadeSides& each : made) {
      for (std::uint32_t s = 0; s < 2; ++s) ASSERT_EQ(CellSides::isFaced(from, c, v, s), each.side[s].isFaced);
      expectHeld(each, sides.next(), surfaces.next());
      ++v;
    }
    skipping.skip(voxels - 1);
    ASSERT_EQ(skipping.next()[1].isFaced, made.back().side[1].isFaced);
  };
  for (std::size_t c = 0; c < cells.size(); ++c) {
    ASSERT_NO_FATAL_FAILURE(expectCell(packed, c, cells[c]));
    copy.copyCell(packed, c);
    // Voxels of both, by turns
    std::vector<PackedSides::Source> sources;
    std::vector<MadeSides> made;
    const auto cell = static_cast<std::uint32_t>(c);
    for (std::uint32_t v = 0; v < std::max(cells[c].size(), others[c].size()) && made.size() < 63; ++v) {
      for (const bool own : {true, false}) {
        const std::vector<MadeSides>& from = own ? cells[c] : others[c];
        if (v >= from.size() || (v + (own ? 1 : 0)) % 3 == 0) continue;
        sources.push_back({own ? &packed : &other, cell, v, static_cast<std::uint32_t>(from.size())});
        made.push_back(from[v]);
      }
    }
    merged.mergeCell(sources);
    ASSERT_NO_FATAL_FAILURE(expectCell(merged, c, made));
  }
  EXPECT_TRUE(copy == packed);
  copy.append(other);
  for (std::size_t c = 0; c < others.size(); ++c)
    ASSERT_NO_FATAL_FAILURE(expectCell(copy, cells.size() + c, others[c]));
  // White stays white, and black black: energy is kept.
  MadeSides plain;
  plain.side = {VoxelSide{{}, {0, 1, 0}, glm::vec3(1.0f), true}, VoxelSide{{}, {0, 0, 1}, glm::vec3(0.0f), true}};
  plain.area = {face, face};
  for (auto& places : plain.places) places.fill({glm::ivec3(0), glm::ivec3(0, 127, 0), 0});
  PackedSides two(face);
  two.addCell({&plain, 1});
  const std::array<VoxelSide, 2> held = CellSides(two, 0, 1).next();
  EXPECT_EQ(held[0].albedo, glm::vec3(1.0f));
  EXPECT_EQ(held[0].normal, glm::vec3(0, 1, 0));
  EXPECT_EQ(held[1].albedo, glm::vec3(0.0f));
}

TEST(VoxelSides, areaIsTheMeshs) {
  VoxelLevel level;
  std::mt19937 random(4);
  const std::vector<glm::vec3> corners = closedSurface(random, glm::vec3(0.0f), 3.0f);
  VoxelLevel::Mesh mesh{corners, {}, {}};
  double expected = 0.0;
  for (unsigned i = 0; i + 2 < corners.size(); i += 3) {
    mesh.triangle.push_back({i, i + 1, i + 2});
    mesh.surface.push_back(0);
    expected +=
        0.5 * glm::length(glm::cross(glm::dvec3(corners[i + 1] - corners[i]), glm::dvec3(corners[i + 2] - corners[i])));
  }
  level.meshes.push_back(mesh);
  level.parts.push_back({});
  const auto volume = VoxelVolume::create(level.geometry(), {});
  ASSERT_TRUE(volume);
  double area = 0.0;
  std::uint32_t number = 0;
  for (const float each : volume->areas()) area += each;
  EXPECT_NEAR(area, expected, 0.01 * expected);
  // Numbers are the voxels' order: cells, and bits in them.
  const VoxelLayer& layer = volume->standing();
  for (std::uint32_t c = 0; c < layer.bits.size(); ++c) {
    for (int bit = 0; bit < 64; ++bit) {
      if ((layer.bits[c] >> bit & 1u) == 0) continue;
      const glm::ivec3 v = 4 * volume->grid().cellAt(c) + glm::ivec3(bit & 3, bit >> 2 & 3, bit >> 4);
      ASSERT_EQ(layer.numberOf(volume->grid(), v), number);
      ASSERT_EQ(volume->voxelOfSide(2 * number++), v);
    }
  }
  EXPECT_EQ(number, layer.occupied);
}

TEST(VoxelSides, aThinWallHasTwoColours) {
  VoxelLevel level;
  level.surfaces = {{{0.8f, 0.1f, 0.1f}}, {{0.1f, 0.1f, 0.8f}, {0, 0, 2}}};
  level.addQuad({0.01f, 0, 0}, {0.01f, 0, 4}, {0.01f, 4, 4}, {0.01f, 4, 0}, 0);      // faces -x
  level.addQuad({0.014f, 0, 0}, {0.014f, 4, 0}, {0.014f, 4, 4}, {0.014f, 0, 4}, 1);  // faces +x
  VoxelOptions options;
  options.boxMin = {-2, 0, 0};
  options.boxMax = {2, 4, 4};
  auto volume = VoxelVolume::create(level.geometry(), options);
  ASSERT_TRUE(volume);
  const MarchHit red = volume->march({-1, 2.1f, 1.9f}, {1, 0, 0}, 4.0f),
                 blue = volume->march({1, 2.1f, 1.9f}, {-1, 0, 0}, 4.0f);
  ASSERT_TRUE(red.found && blue.found);
  EXPECT_EQ(red.voxel, blue.voxel);
  const std::uint32_t left = volume->sideAt(red.voxel, {1, 0, 0}), right = volume->sideAt(blue.voxel, {-1, 0, 0});
  EXPECT_NEAR(volume->side(left).albedo.x, 0.8f, 1e-3f);
  EXPECT_NEAR(volume->side(right).albedo.z, 0.8f, 1e-3f);
  EXPECT_EQ(volume->emissionOfSide(left), glm::vec3(0.0f));
  EXPECT_LT(volume->positionOfSide(left).x, 0.01f);
  EXPECT_GT(volume->positionOfSide(right).x, 0.014f);
  // Emitted flux is the quad's: pi times 2 W/m²/sr times 16 m², and voxels have Δ² each.
  double flux = 0.0;
  for (std::uint32_t i = 0; i < volume->sideCount(); ++i)
    flux += double{volume->emissionOfSide(i).z} * volume->grid().voxel * volume->grid().voxel;
  EXPECT_NEAR(flux, 32.0, 1.0);  // voxels at its outline are not full
  volume->reflect({}, glm::vec3(1.0f));
  EXPECT_EQ(volume->radianceAt(red.voxel, {1, 0, 0}), glm::vec3(0.0f));
  EXPECT_NEAR(volume->radianceAt(blue.voxel, {-1, 0, 0}).z, 2.0f, 0.7f);
}

// A cloth that hangs before a wall, in the same voxels, is what is seen of them.
TEST(VoxelSides, aClothBeforeAWallHidesIt) {
  const glm::vec3 wall(0.8f), cloth(0.1f, 0.6f, 0.1f);
  VoxelOptions options;
  options.boxMin = {-4, -4, -4};
  options.boxMax = {4, 4, 4};
  options.cells = 16;
  const VolumeGrid grid = VoxelVolume::create(VoxelLevel().geometry(), options)->grid();
  const glm::vec3 corner = grid.toWorld(glm::vec3(grid.voxels() / 2));  // of a voxel
  // How much of the wall the cloth is before, in strips; it hangs straight or aslant.
  for (const float covered : {0.0f, 0.5f, 1.0f}) {
    for (const float aslant : {0.0f, 0.2f}) {
      VoxelLevel level;
      level.surfaces = {{wall}, {cloth}};
      const float behind = corner.x + 0.2f * grid.voxel, before = corner.x + 0.5f * grid.voxel;
      const float under = before + aslant * grid.voxel;
      level.addQuad({behind, -4, -4}, {behind, 4, -4}, {behind, 4, 4}, {behind, -4, 4}, 0);  // faces +x
      for (int row = -8; covered > 0.0f && row < 8; ++row) {
        const float from = corner.y + static_cast<float>(row) * grid.voxel, to = from + covered * grid.voxel;
        level.addQuad({before, from, -4}, {under, to, -4}, {under, to, 4}, {before, from, 4}, 1);
      }
      const auto volume = VoxelVolume::create(level.geometry(), options);
      ASSERT_TRUE(volume);
      const glm::vec3 expected = glm::mix(wall, cloth, covered);
      const float about = covered == 0.5f ? 0.08f : 2e-3f;  // shares of area are in sixteenths of a voxel
      int seen = 0;
      for (std::uint32_t i = 0; i < volume->sideCount(); ++i) {
        const VoxelSide& side = volume->side(i);
        const glm::ivec3 from = volume->voxelOfSide(i) - grid.voxels() / 2;
        if (side.normal.x < 0.9f || from.x != 0 || std::max(std::abs(from.y), std::abs(from.z)) > 6) continue;
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(side.albedo[k], expected[k], about) << covered << ' ' << aslant;
        ++seen;
      }
      EXPECT_EQ(seen, 13 * 13) << covered << ' ' << aslant;
    }
  }
}

// A wall on the face between two voxels is in both, its area in one: from either side it has its emission.
TEST(VoxelSides, anEmitterBetweenTwoVoxelsShines) {
  VoxelOptions options;
  options.boxMin = glm::vec3(-8.0f);
  options.boxMax = glm::vec3(8.0f);
  options.cells = 16;
  const float voxel = 16.0f / 63.0f, low = -8.0f - 0.5f * voxel;
  for (const float at : {40.0f, 41.0f, 40.3f, 40.5f, 40.75f}) {
    VoxelLevel level;
    level.surfaces[0] = {glm::vec3(0.0f), glm::vec3(1.0f), 1.0f, true};
    const float x = low + at * voxel;
    level.addQuad({x, -9, -9}, {x, -9, 9}, {x, 9, 9}, {x, 9, -9});
    auto volume = VoxelVolume::create(level.geometry(), options);
    ASSERT_TRUE(volume);
    volume->reflect({}, glm::vec3(1.0f));
    for (const float towards : {1.0f, -1.0f}) {
      const glm::vec3 direction(towards, 0, 0);
      const MarchHit hit = volume->march({-7.0f * towards, 0.03f, 0.02f}, direction, 100.0f);
      ASSERT_TRUE(hit.found);
      EXPECT_NEAR(volume->radianceAt(hit.voxel, direction).x, 1.0f, 0.06f) << at << ' ' << towards;
    }
  }
}

TEST(VoxelSides, directLightIsThatOfTheSurface) {
  VoxelLevel level;
  level.addQuad({-4, 0, -4}, {-4, 0, 4}, {4, 0, 4}, {4, 0, -4});
  VoxelOptions options;
  options.boxMin = {-4, -1, -4};
  options.boxMax = {4, 3, 4};
  auto volume = VoxelVolume::create(level.geometry(), options);
  ASSERT_TRUE(volume);
  const Light light{.kind = LightKind::point, .intensity = glm::vec3(3.0f), .positionWorld = {0.5f, 1.2f, 0.0f}};
  LightSetup setup;
  setup.lights = {&light, 1};
  setup.visibility = [](std::uint32_t, const glm::vec3& p, const glm::vec3&) { return p.x < 0.0f ? 0.0f : 1.0f; };
  ASSERT_TRUE(volume->lightDirectly(setup));
  int lit = 0;
  for (std::uint32_t i = 0; i < volume->sideCount(); ++i) {
    const VoxelSide& side = volume->side(i);
    const glm::vec3 p = volume->grid().toWorld(glm::vec3(volume->voxelOfSide(i)) + 0.5f);
    if (side.normal.y < 0.5f || p.x < -0.2f) {
      EXPECT_EQ(volume->directOf(i), glm::vec3(0.0f));
    } else if (p.x > 0.2f) {
      const double d2 = (p.x - 0.5) * (p.x - 0.5) + 1.44 + p.z * p.z;
      EXPECT_NEAR(volume->directOf(i).x, 3.0 * 1.2 / (d2 * std::sqrt(d2)),
                  0.03 * 3.0 * 1.2 / (d2 * std::sqrt(d2)) + 1e-3);
      ++lit;
    }
  }
  EXPECT_GT(lit, 500);
}

}  // namespace
}  // namespace relume
