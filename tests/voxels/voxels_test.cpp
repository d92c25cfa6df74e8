// SPDX-License-Identifier: MIT
// Which voxels are set, and what rays meet.
#include "runtime/voxels/overlap.h"
#include "runtime/voxels/step_place.h"
#include "runtime/voxels/voxel_pairs.h"
#include "runtime/voxels/voxel_volume.h"
#include "tests/voxels/boxes.h"
#include "tests/voxels/closed_surface.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <vector>

namespace relume {
namespace {

using test::closedSurface, test::unit, test::VoxelLevel;

VolumeGrid gridOf(int cells) {
  VolumeGrid grid;
  grid.cells = glm::ivec3(cells);
  return grid;
}

std::vector<SnappedTriangle> snapped(const VolumeGrid& grid, const std::vector<glm::vec3>& corners) {
  std::vector<glm::uvec3> triangles;
  for (unsigned i = 0; i + 2 < corners.size(); i += 3) triangles.push_back({i, i + 1, i + 2});
  const std::vector<std::uint32_t> surface(triangles.size(), 0);
  std::vector<SnappedTriangle> out;
  SnapCounts counts;
  EXPECT_TRUE(snapTriangles(grid, SnapBox::of(grid), {corners, triangles, surface}, glm::mat4x3(1.0f), out, counts));
  return out;
}

std::uint32_t indexIn(const glm::ivec3& size, const glm::ivec3& v) {
  return static_cast<std::uint32_t>((v.z * size.y + v.y) * size.x + v.x);
}

// The definition of thin voxels (Schwarz and Seidel 2010), in integers of 64 bits, of all voxels of the grid that may
// be in the triangle's bounds; or of sub-voxels. [steps of an edge, 1/64 voxel]
std::set<std::uint32_t> oracle(const VolumeGrid& grid, const SnappedTriangle& t, int steps) {
  using I = glm::vec<3, std::int64_t>;
  const auto corner = [&](std::size_t i) { return I(t.corner[i][0], t.corner[i][1], t.corner[i][2]); };
  const I p = corner(1) - corner(0), q = corner(2) - corner(0);
  const I n(p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x);
  const std::int64_t half = steps / 2;
  const glm::ivec3 size = kVoxelSteps / steps * grid.voxels();
  std::set<std::uint32_t> found;
  glm::ivec3 begin, end;
  for (int a = 0; a < 3; ++a) {
    const auto [low, high] = std::minmax({corner(0)[a], corner(1)[a], corner(2)[a]});
    begin[a] = std::clamp(static_cast<int>(low) / steps - 3, 0, size[a]);
    end[a] = std::clamp(static_cast<int>(high) / steps + 3, 0, size[a]);
  }
  for (int z = begin.z; z < end.z; ++z) {
    for (int y = begin.y; y < end.y; ++y) {
      for (int x = begin.x; x < end.x; ++x) {
        const I c = I(x, y, z) * std::int64_t{steps} + half;
        bool in = true;
        for (int a = 0; a < 3; ++a) {
          const std::int64_t low = std::min({corner(0)[a], corner(1)[a], corner(2)[a]}),
                             high = std::max({corner(0)[a], corner(1)[a], corner(2)[a]});
          in = in && c[a] + half >= low && c[a] - half <= high;
        }
        const std::int64_t most = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
        const I d0 = c - corner(0);
        in = in && std::abs(n.x * d0.x + n.y * d0.y + n.z * d0.z) <= half * most;
        for (int a = 0; a < 3 && in; ++a) {
          const int u = (a + 1) % 3, v = (a + 2) % 3;
          for (std::size_t e = 0; e < 3; ++e) {
            const I d = corner((e + 1) % 3) - corner(e);
            const std::int64_t s = n[a] < 0 ? -1 : 1, eu = -s * d[v], ev = s * d[u];
            const std::int64_t reach = half * std::max(std::abs(eu), std::abs(ev));
            in = in && eu * (c[u] - corner(e)[u]) + ev * (c[v] - corner(e)[v]) + reach >= 0;
          }
        }
        if (in) found.insert(indexIn(size, {x, y, z}));
      }
    }
  }
  return found;
}

// Each cut of a sliver makes its pieces thinner, and there are as many layers of them as the sliver has lengths.
TEST(Voxelise, aSliverOfManyGridsLengthIsCutShort) {
  const VolumeGrid grid = gridOf(32);
  const std::vector<glm::vec3> corners{{-1e5f, 64.0f, 64.0f}, {1e5f, 64.3f, 64.0f}, {50.0f, 64.9f, 65.0f}};
  const std::vector<glm::uvec3> triangle{{0, 1, 2}};
  const std::vector<std::uint32_t> surface{0};
  std::vector<SnappedTriangle> out;
  SnapCounts counts;
  EXPECT_TRUE(snapTriangles(grid, SnapBox::of(grid), {corners, triangle, surface}, glm::mat4x3(1.0f), out, counts));
  EXPECT_LE(out.size() + counts.zeroArea, 1u << 17);
  // One that fills the grid, and reaches as far, is whole.
  const std::vector<SnappedTriangle> wall = snapped(grid, {{-1e3f, -1e3f, 40}, {1e3f, -1e3f, 90}, {0, 1e3f, 60}});
  std::vector<std::uint64_t> bits(grid.cellCount(), 0);
  addBits(grid, wall, {}, bits);
  for (int x = 0; x < 128; x += 5) {
    for (int y = 0; y < 128; y += 5) {
      bool found = false;
      for (int z = 0; z < 128; ++z) found = found || (bits[grid.cellOf({x, y, z})] >> brickBit({x, y, z}) & 1u) != 0;
      ASSERT_TRUE(found) << x << ' ' << y;
    }
  }
}

TEST(Voxelise, setsWhatTheDefinitionSets) {
  const VolumeGrid grid = gridOf(8);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-2.0f, 34.0f), size(-4.5f, 4.5f);
  int checked = 0;
  for (int i = 0; i < 300; ++i) {
    const glm::vec3 a(place(random), place(random), place(random));
    const auto other = [&] { return a + glm::vec3(size(random), i % 7 == 0 ? 0.0f : size(random), size(random)); };
    for (const SnappedTriangle& t : snapped(grid, {a, other(), other()})) {
      std::set<std::uint32_t> found, foundSub;
      TriangleOverlap(t).visit(
          grid, [&](const glm::ivec3& v) { EXPECT_TRUE(found.insert(indexIn(grid.voxels(), v)).second); });
      ASSERT_EQ(found, oracle(grid, t, kVoxelSteps)) << "triangle " << i;
      TriangleOverlap(t).visitSubVoxels(grid, [&](const glm::ivec3& v, std::uint64_t subVoxels) {
        for (std::uint64_t rest = subVoxels; rest != 0; rest &= rest - 1) {
          const glm::ivec3 at = 4 * v + voxelOfBit(std::countr_zero(rest));
          EXPECT_TRUE(foundSub.insert(indexIn(4 * grid.voxels(), at)).second);
        }
      });
      ASSERT_EQ(foundSub, oracle(grid, t, kVoxelSteps / 4)) << "triangle " << i;
      ++checked;
    }
  }
  EXPECT_GT(checked, 200);
}

// Down columns along each axis: by the plane's equation and the signs of areas, in fractions of 64 bits.
TEST(Voxelise, columnsAreCrossedWhereTheTriangleIs) {
  VolumeGrid grid;
  grid.cells = {6, 6, 6};
  std::mt19937 random(17);
  std::uniform_real_distribution<float> place(2.0f, 22.0f), size(-3.0f, 3.0f);
  int crossed = 0, onEdges = 0;
  for (int i = 0; i < 60; ++i) {
    glm::vec3 a(place(random), place(random), place(random));
    if (i % 5 == 0) a = glm::floor(a) + 0.125f;  // through columns
    const glm::vec3 b = a + glm::vec3(2, i % 3 == 0 ? 0.0f : size(random), size(random)),
                    c = a + glm::vec3(i % 2 == 0 ? 0.0f : size(random), 2, size(random));
    // Both halves of a quad: a column on the edge between them is one's.
    std::map<std::array<int, 5>, int> found, inside, touched;
    for (const auto& corners : {std::array{a, b, c}, std::array{b, b + c - a, c}}) {
      for (const SnappedTriangle& t : snapped(grid, {corners[0], corners[1], corners[2]})) {
        for (int axis = 0; axis < 3; ++axis) {
          const CrossedColumns columns(t, axis);
          TriangleOverlap(t).visitAll([&](const glm::ivec3& v) {
            columns.visit(v, [&](std::size_t column, int height) {
              ++found[{axis, v.x, v.y, v.z, static_cast<int>(column)}];
              EXPECT_LE(std::abs(height), kVoxelSteps / 2);
              // The column's place at this height is within a step of the plane.
              const int wide = kVoxelSteps / 4, at = static_cast<int>(column);
              const glm::ivec3 p =
                  kVoxelSteps * v + turnedBack(glm::ivec3(wide * (at / 4) + wide / 2, wide * (at % 4) + wide / 2,
                                                          kVoxelSteps / 2 + height),
                                               axis);
              const glm::ivec3 n = areaNormal(t), d = p - glm::ivec3(t.corner[0][0], t.corner[0][1], t.corner[0][2]);
              EXPECT_LT(std::abs(n.x * d.x + n.y * d.y + n.z * d.z), std::abs(n[axis]));
            });
            for (int at = 0; at < 16; ++at) {
              const int wide = kVoxelSteps / 4;
              const glm::ivec3 p =
                  turned(kVoxelSteps * v, axis) + glm::ivec3(wide * (at / 4) + wide / 2, wide * (at % 4) + wide / 2, 0);
              std::array<glm::ivec3, 3> corner;
              for (std::size_t k = 0; k < 3; ++k)
                corner[k] = turned({t.corner[k][0], t.corner[k][1], t.corner[k][2]}, axis);
              const auto areaOf = [&](std::size_t k) {
                const glm::ivec3 e = corner[(k + 1) % 3] - corner[k], q = p - corner[k];
                return std::int64_t{e.x} * q.y - std::int64_t{e.y} * q.x;
              };
              const std::int64_t one = areaOf(0), two = areaOf(1), three = areaOf(2), all = one + two + three;
              if (all == 0 || std::min({one, two, three}) * std::max({one, two, three}) < 0) continue;
              const std::int64_t up = two * corner[0].z + three * corner[1].z + one * corner[2].z - all * p.z;
              if (up * (all > 0 ? 1 : -1) < 0 || up * (all > 0 ? 1 : -1) > kVoxelSteps * std::abs(all)) continue;
              const bool strictly = one != 0 && two != 0 && three != 0 && up != 0 && up != kVoxelSteps * all;
              ++(strictly ? inside : touched)[{axis, v.x, v.y, v.z, at}];
            }
          });
        }
      }
    }
    for (const auto& [column, times] : inside) {
      ASSERT_EQ(found[column], times) << i;
      ++crossed;
    }
    for (const auto& [column, times] : found) {
      if (times == 0 || inside.count(column) != 0) continue;
      ASSERT_TRUE(touched.count(column) != 0) << i;
      ASSERT_EQ(times, 1) << i;
      ++onEdges;
    }
  }
  EXPECT_GT(crossed, 5000);
  EXPECT_GT(onEdges, 100);
}

// What is found for some voxels at a time is what is found for all at once.
TEST(Voxelise, pairsOfSomeVoxelsAreThoseOfAll) {
  VolumeGrid grid;
  grid.cells = {7, 5, 6};
  std::mt19937 random(23);
  std::vector<SnappedTriangle> triangles;
  for (int i = 0; i < 12; ++i) {
    std::uniform_real_distribution<float> place(-1.0f, 26.0f);
    const auto more = snapped(grid, closedSurface(random, {place(random), place(random), place(random)}, 5.0f));
    triangles.insert(triangles.end(), more.begin(), more.end());
  }
  for (const bool roams : {false, true}) {
    grid.roams = roams;
    VoxelLayer layer;
    voxelise(grid, triangles, {}, layer);
    layer.kept = layer.occupied - 10;
    const VoxelPairs all = findPairs(grid, triangles, 0, layer.kept, {}, layer);
    EXPECT_GT(all.pair.size(), layer.kept);
    for (std::uint32_t first = 0; first < layer.kept;) {
      const std::uint32_t end = std::min(first + 1 + static_cast<std::uint32_t>(random() % 300), layer.kept);
      const VoxelPairs some = findPairs(grid, triangles, first, end, {}, layer);
      for (std::uint32_t v = first; v < end; ++v) {
        const auto &is = some.of(v), &was = all.of(v);
        ASSERT_GT(was.size(), 0u) << "voxel " << v;
        ASSERT_TRUE(std::equal(is.begin(), is.end(), was.begin(), was.end(),
                               [](const VoxelPair& a, const VoxelPair& b) {
                                 return a.triangle == b.triangle && a.share == b.share && a.touches == b.touches;
                               }))
            << "voxel " << v << " of " << first << " to " << end;
      }
      first = end;
    }
    EXPECT_EQ(findPairs(grid, triangles, 0, 0, {}, layer).pair.size(), 0u);
  }
}

// Whether shapes are shared or not, each voxel has the one that it came with.
TEST(SubVoxelShapes, areThoseThatCame) {
  std::mt19937_64 random(31);
  for (const std::size_t shapes : {std::size_t{1}, std::size_t{500}, (std::size_t{1} << 16) - 1, std::size_t{1} << 16,
                                   (std::size_t{1} << 16) + 1, std::size_t{1} << 17}) {
    std::vector<std::uint64_t> some(shapes);
    for (std::uint64_t& each : some) each = random();
    some[0] = 0;
    std::vector<std::uint64_t> all(std::max<std::size_t>(2 * shapes, 100));
    for (std::size_t v = 0; v < all.size(); ++v) all[v] = some[v < shapes ? v : random() % shapes];
    const SubVoxelShapes kept(all);
    ASSERT_EQ(kept.size(), all.size());
    EXPECT_EQ(kept.ofVoxels(), all);
    EXPECT_EQ(kept.bytes(), shapes < 1u << 16 ? 8 * shapes + 2 * all.size() : 8 * all.size()) << shapes;
    EXPECT_TRUE(kept == SubVoxelShapes(all));
  }
  // So few are alike that numbers would only add to them.
  std::vector<std::uint64_t> apart(1000);
  for (std::uint64_t& each : apart) each = random();
  EXPECT_EQ(SubVoxelShapes(apart).bytes(), 8 * apart.size());
  EXPECT_EQ(SubVoxelShapes(std::vector<std::uint64_t>()).size(), 0u);
}

// Integers stand for the sums of floating-point numbers: transforms of any scale, far away, mirrored, without extent.
TEST(Voxelise, verticesAreOnTheNearestStep) {
  std::mt19937 random(6);
  std::size_t checked = 0;
  for (int i = 0; i < 20000; ++i) {
    const float scale = i % 3 == 0 ? std::ldexp(1.0f, static_cast<int>(random() % 60) - 33) : 1.0f;
    const float far = i % 4 == 0 ? 1e5f : 20.0f;
    glm::mat4x3 toWorld(scale * unit(random), scale * unit(random), scale * unit(random), far * unit(random));
    if (i % 11 == 0) toWorld[1] = glm::vec3(0.0f);
    VolumeGrid grid = gridOf(32);
    grid.voxel = i % 2 == 0 ? 0.1f : 0.0073f;
    grid.originWorld = i % 4 == 0 ? toWorld[3] - 3.0f : glm::vec3(-4.0f);
    const glm::vec3 position = (i % 3 == 0 ? 1.0f / scale : 1.0f) * 7.0f * unit(random);
    const glm::ivec3 found = StepPlace::of(grid, toWorld).stepsOf(position);
    for (int k = 0; k < 3; ++k) {
      double world = double{toWorld[3][k]} - double{grid.originWorld[k]}, size = 0.0;
      for (int c = 0; c < 3; ++c) {
        world += double{toWorld[c][k]} * double{position[c]};
        for (int row = 0; row < 3; ++row)
          size = std::max(size, double{std::abs(toWorld[c][row])} * double{glm::length(position)});
      }
      const double toSteps = 64.0 / double{grid.voxel};
      if (std::abs(toSteps * world) > 1e6) continue;
      ASSERT_NEAR(found[k], toSteps * world, 0.5001 + 3.0 * toSteps * size * 0x1p-30) << i << " along " << k;
      ++checked;
    }
  }
  EXPECT_GT(checked, 40000u);
}

TEST(Voxelise, piecesOfALongTriangleAreJoinedAndSmall) {
  const VolumeGrid grid = gridOf(64);
  const auto pieces = snapped(grid, {{1, 2, 3}, {250, 20, 90}, {30, 240, 199}});
  double area = 0.0;
  std::map<std::pair<std::array<std::int16_t, 3>, std::array<std::int16_t, 3>>, int> edges;
  for (const SnappedTriangle& t : pieces) {
    area += 0.5 * t.area;
    for (std::size_t e = 0; e < 3; ++e) {
      const auto &a = t.corner[e], &b = t.corner[(e + 1) % 3];
      int length2 = 0;
      for (std::size_t k = 0; k < 3; ++k) length2 += (a[k] - b[k]) * (a[k] - b[k]);
      EXPECT_LE(length2, kMaxEdge * kMaxEdge);
      ++edges[{a, b}];
    }
  }
  const glm::dvec3 whole = glm::cross(glm::dvec3(249, 18, 87), glm::dvec3(29, 238, 196));
  EXPECT_NEAR(area / 4096.0, 0.5 * glm::length(whole), 0.002 * glm::length(whole));
  // Every edge but the outline's has its opposite.
  int open = 0;
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    if (edges.count({edge.second, edge.first}) == 0) ++open;
  }
  EXPECT_GT(pieces.size(), 1000u);
  EXPECT_LT(open, 200);
  EXPECT_GT(open, 60);
}

TEST(March, neverPassesAClosedThinMesh) {
  std::mt19937 random(2);
  for (int i = 0; i < 12; ++i) {
    const VolumeGrid grid = gridOf(i % 2 == 0 ? 16 : 32);
    const float side = static_cast<float>(grid.voxels().x);
    VoxelLayer layer;
    const auto mesh = snapped(grid, closedSurface(random, glm::vec3(0.5f * side + 0.13f), 0.45f * side));
    voxelise(grid, mesh, {}, layer);
    int passes = 0;
    for (int r = 0; r < 2000; ++r) {
      const glm::vec3 from =
          glm::vec3(0.5f * side + 0.2f) +
          0.1f * side * (glm::vec3(random() % 1000, random() % 1000, random() % 1000) / 1000.0f - 0.5f);
      const glm::vec3 direction = unit(random);
      const MarchHit hit = VoxelMarch(grid, layer.bits.data(), from, direction).first(1e9f);
      ASSERT_TRUE(hit.found) << "mesh " << i << " ray " << r;
      VoxelMarch finer(grid, layer.subVoxels.bits.data(), from, direction);
      const MarchHit in = finer.first(1e9f, [&](const glm::ivec3& v) { return layer.subVoxels.in(grid, v); });
      ASSERT_TRUE(in.found) << "mesh " << i << " ray " << r;
      ASSERT_NE(layer.numberBehind(grid, in.voxel, in.subVoxel), kNoVoxel);
      passes += in.voxel != hit.voxel ? 1 : 0;
    }
    EXPECT_GT(passes, 0) << "rays that pass a voxel beside its surface";
  }
}

// Voxel by voxel with the same times of crossing.
MarchHit plainWalk(const VolumeGrid& grid, const std::vector<std::uint64_t>& bits, const glm::vec3& o,
                   const glm::vec3& d) {
  MarchHit hit;
  glm::ivec3 v(glm::floor(o));
  float t = 0.0f;
  const glm::vec3 inverse = 1.0f / d;
  while (grid.holds(v)) {
    if (bits[grid.cellOf(v)] >> brickBit(v) & 1u) return {v, t, true};
    int axis = 0;
    float next[3];
    for (int a = 0; a < 3; ++a) next[a] = (static_cast<float>(v[a] + (d[a] > 0 ? 1 : 0)) - o[a]) * inverse[a];
    for (int a = 1; a < 3; ++a) axis = next[a] < next[axis] ? a : axis;
    t = next[axis];
    v[axis] += d[axis] > 0 ? 1 : -1;
  }
  return hit;
}

TEST(March, crossesEmptyBricksAsVoxelByVoxel) {
  const VolumeGrid grid = gridOf(16);
  std::mt19937 random(3);
  std::vector<std::uint64_t> bits(grid.cellCount(), 0);
  for (int i = 0; i < 600; ++i) bits[random() % bits.size()] |= std::uint64_t{1} << random() % 64;
  std::uniform_real_distribution<float> place(0.0f, 63.99f);
  int found = 0;
  for (int i = 0; i < 20000; ++i) {
    glm::vec3 o(place(random), place(random), place(random)), d = unit(random);
    if (i % 3 == 0) o = glm::floor(o);                                     // on corners of voxels
    if (i % 5 == 0) d = glm::normalize(glm::vec3(1, -1, i % 2 ? 1 : -1));  // through edges and corners
    const MarchHit a = VoxelMarch(grid, bits.data(), o, d).first(1e9f), b = plainWalk(grid, bits, o, d);
    ASSERT_EQ(a.found, b.found) << i;
    if (!a.found) continue;
    ASSERT_EQ(a.voxel, b.voxel) << i;
    ASSERT_EQ(a.t, b.t) << i;
    ++found;
  }
  EXPECT_GT(found, 1500);
}

// A voxel is a brick: what a ray meets in it is what a walk over all sub-voxels of the grid meets.
TEST(March, meetsSubVoxelsAsAWalkOverThem) {
  const VolumeGrid grid = gridOf(8);
  VolumeGrid fine = grid;
  fine.cells = 4 * grid.cells;
  std::mt19937 random(7);
  std::vector<std::uint64_t> bits(grid.cellCount(), 0), subBits(fine.cellCount(), 0);
  const auto brickOf = [&](const glm::ivec3& v) -> std::uint64_t& { return subBits[fine.cellIndex(v)]; };
  for (int i = 0; i < 4000; ++i) {
    const glm::ivec3 v(random() % 32, random() % 32, random() % 32);
    bits[grid.cellOf(v)] |= std::uint64_t{1} << brickBit(v);
    brickOf(v) |= std::uint64_t{1} << random() % 64 | std::uint64_t{1} << random() % 64;
  }
  std::uniform_real_distribution<float> place(0.0f, 31.99f);
  int found = 0, passed = 0;
  for (int i = 0; i < 20000; ++i) {
    glm::vec3 o(place(random), place(random), place(random)), d = unit(random);
    if (i % 3 == 0) o = 0.25f * glm::floor(4.0f * o);                      // on corners of sub-voxels
    if (i % 5 == 0) d = glm::normalize(glm::vec3(1, -1, i % 2 ? 1 : -1));  // through edges and corners
    VoxelMarch march(grid, bits.data(), o, d);
    const MarchHit a = march.first(1e9f, brickOf), b = plainWalk(fine, subBits, 4.0f * o, d);
    ASSERT_EQ(a.found, b.found) << i;
    if (!a.found) continue;
    ASSERT_EQ(a.voxel, b.voxel / 4) << i;
    ASSERT_EQ(a.subVoxel, brickBit(b.voxel)) << i;
    // What lies behind the ray's end is not met. (In sub-voxels t counts four times.)
    const float end = (i % 2 == 0 ? 0.24f : 0.26f) * b.t;
    if (b.t > 0.0f) {
      ASSERT_EQ(VoxelMarch(grid, bits.data(), o, d).first(end, brickOf).found, i % 2 != 0) << i;
    }
    const MarchHit whole = VoxelMarch(grid, bits.data(), o, d).first(1e9f);
    passed += whole.voxel != a.voxel ? 1 : 0;
    ++found;
  }
  EXPECT_GT(found, 5000);
  EXPECT_GT(passed, 1000);
}

TEST(March, raysFromOutsideAndAlongAxes) {
  VoxelLevel level;
  level.addBox({0, 0, 0}, {1, 1, 1}, false);
  const auto volume = VoxelVolume::create(level.geometry(), {});
  ASSERT_TRUE(volume) << volume.error().message;
  const float far = std::numeric_limits<float>::infinity();
  for (int a = 0; a < 3; ++a) {
    glm::vec3 d(0.0f), from(0.3f, 0.4f, 0.6f);
    d[a] = 1.0f;
    from[a] = -3.0f;
    const MarchHit hit = volume->march(from, d, far);
    ASSERT_TRUE(hit.found);
    EXPECT_NEAR(hit.t, 3.0f, volume->grid().voxel);
    const std::uint32_t side = volume->sideAt(hit.voxel, d);
    ASSERT_NE(side, kNoSide);
    EXPECT_LT(glm::dot(volume->side(side).normal, d), -0.99f);
    EXPECT_TRUE(volume->side(side).isFaced);
    EXPECT_FALSE(volume->meetsBack(hit.voxel, d));
    EXPECT_FALSE(volume->march(from, -d, far).found);
    EXPECT_FALSE(volume->march(from, d, 2.0f).found);
  }
}

}  // namespace
}  // namespace relume
