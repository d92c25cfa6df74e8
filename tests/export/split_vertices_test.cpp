// SPDX-License-Identifier: MIT
// Which vertices become several, and how they are numbered.
#include "bake/export/split_vertices.h"
#include "relume/caches.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

using Numbers = std::vector<std::uint32_t>;

// Two triangles that share the edge 1 2.
ChartedCorners square(Numbers front) {
  ChartedCorners c;
  c.vertex = {0, 1, 2, 2, 1, 3};
  c.front = std::move(front);
  c.back.assign(6, kGridLit);
  c.unseen = {0, 0};
  return c;
}

TEST(SplitVertices, oneChartKeepsAllVertices) {
  const SplitVertices s = splitVertices(square({10, 11, 12, 12, 11, 13}), 4, false);
  EXPECT_TRUE(s.kept);
  EXPECT_EQ(s.added, 0u);
  EXPECT_EQ(s.source, (Numbers{0, 1, 2, 3}));
  EXPECT_EQ(s.corner, (Numbers{0, 1, 2, 2, 1, 3}));
  EXPECT_EQ(s.front, (Numbers{10, 11, 12, 13}));
}

TEST(SplitVertices, cornersOfTwoChartsPartAtTheirSeamAlone) {
  const SplitVertices s = splitVertices(square({10, 11, 12, 22, 11, 13}), 4, false);
  EXPECT_FALSE(s.kept);
  EXPECT_EQ(s.added, 1u);
  EXPECT_EQ(s.source, (Numbers{0, 1, 2, 3, 2}));
  EXPECT_EQ(s.corner, (Numbers{0, 1, 2, 4, 1, 3}));
  EXPECT_EQ(s.front, (Numbers{10, 11, 12, 13, 22}));
}

TEST(SplitVertices, backsPartVerticesToo) {
  ChartedCorners c = square({10, 11, 12, 12, 11, 13});
  c.back = {1, 2, 3, 4, 2, 5};
  const SplitVertices s = splitVertices(c, 4, false);
  EXPECT_EQ(s.added, 1u);
  EXPECT_EQ(s.back, (Numbers{1, 2, 3, 5, 4}));
}

TEST(SplitVertices, trianglesWithoutAreaAskForNothing) {
  ChartedCorners c = square({10, 11, 12, kGridLit, kGridLit, kGridLit});
  c.unseen = {0, 1};
  const SplitVertices s = splitVertices(c, 4, false);
  EXPECT_TRUE(s.kept);
  EXPECT_EQ(s.front, (Numbers{10, 11, 12, kGridLit}));
}

TEST(SplitVertices, gridLitTrianglesArePartedFromThoseOnTheMap) {
  const SplitVertices s = splitVertices(square({10, 11, 12, kGridLit, kGridLit, kGridLit}), 4, false);
  EXPECT_EQ(s.source, (Numbers{0, 1, 2, 3, 2, 1}));
  EXPECT_EQ(s.corner, (Numbers{0, 1, 2, 4, 5, 3}));
}

TEST(SplitVertices, verticesOfOthersCanBeLeftOut) {
  ChartedCorners c = square({10, 11, 12, 22, 11, 13});
  c.vertex = {3, 5, 7, 7, 5, 9};
  const SplitVertices s = splitVertices(c, 100, true);
  EXPECT_FALSE(s.kept);
  EXPECT_EQ(s.source, (Numbers{3, 5, 7, 9, 7}));
  EXPECT_EQ(s.corner, (Numbers{0, 1, 2, 4, 1, 3}));
}

}  // namespace
}  // namespace relume
