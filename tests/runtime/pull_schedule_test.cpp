// SPDX-License-Identifier: MIT
// The order in which the GPU pulls: every inner node once, after its children, whatever the tree's shape.
#include "runtime/gl/pull_schedule.h"

#include "tests/runtime/random_tree.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace relume::gl {
namespace {

struct Case {
  std::uint32_t leaves;
  float evenness;
  std::uint32_t nodesPerGroup;
};
const Case kCases[] = {{1, 0.5f, 8},   {2, 0.5f, 8},     {3, 0.5f, 1},        {500, 0.5f, 1},
                       {500, 0.5f, 8}, {3000, 0.0f, 64}, {20000, 0.05f, 512}, {20000, 0.5f, 4096}};

TEST(PullSchedule, hasEveryInnerNodeOnceWithItsChildAndWeight) {
  for (const Case& each : kCases) {
    const Hierarchy tree = test::makeRandomTree(each.leaves, each.evenness, 7);
    const PullSchedule schedule = makePullSchedule(tree, each.nodesPerGroup);
    ASSERT_EQ(schedule.node.size(), each.leaves - 1u);
    std::vector<std::uint32_t> seen;
    for (const PullSchedule::Node& node : schedule.node) {
      EXPECT_EQ(node.firstChild, tree.child[node.node]);
      EXPECT_EQ(node.firstWeight, tree.firstWeight[node.node]);
      const auto [first, second] = packPullNode(node);
      EXPECT_EQ(first & 0x1FFFFFFu, node.node);
      EXPECT_EQ(1 + 2 * (second & 0xFFFFFFu), node.firstChild);
      EXPECT_NEAR(static_cast<float>(first >> 25 | second >> 24 << 7), 32767.0f * node.firstWeight, 0.51f);
      seen.push_back(node.node);
    }
    std::sort(seen.begin(), seen.end());
    EXPECT_EQ(std::adjacent_find(seen.begin(), seen.end()), seen.end());
  }
}

TEST(PullSchedule, childrenComeInAnEarlierRoundOfTheGroupAndInEarlierGroupsOfTheLast) {
  for (const Case& each : kCases) {
    const Hierarchy tree = test::makeRandomTree(each.leaves, each.evenness, 11);
    const PullSchedule schedule = makePullSchedule(tree, each.nodesPerGroup);
    constexpr std::uint32_t kNever = 0xFFFFFFFFu;
    std::vector<std::uint32_t> group(tree.nodeCount(), kNever), round(tree.nodeCount(), kNever);
    const std::uint32_t last = schedule.groupCount() - 1;
    for (std::uint32_t g = 0; g <= last; ++g) {
      for (std::uint32_t r = schedule.groupBegin[g]; r < schedule.groupBegin[g + 1]; ++r) {
        for (std::uint32_t i = schedule.roundBegin[r]; i < schedule.roundBegin[r + 1]; ++i) {
          const PullSchedule::Node& node = schedule.node[i];
          for (const std::uint32_t child : {node.firstChild, node.firstChild + 1}) {
            if (tree.isLeaf(child)) continue;
            ASSERT_NE(group[child], kNever);
            ASSERT_TRUE(g == last || group[child] == g);
            ASSERT_LT(round[child], r);
          }
          group[node.node] = g;
          round[node.node] = r;
        }
      }
    }
  }
}

TEST(PullSchedule, groupsKeepToTheirSizeAndAreFewerThanTwiceWhatIsNeeded) {
  for (const Case& each : kCases) {
    const Hierarchy tree = test::makeRandomTree(each.leaves, each.evenness, 3);
    const PullSchedule schedule = makePullSchedule(tree, each.nodesPerGroup);
    const auto first = [&](std::uint32_t g) { return schedule.roundBegin[schedule.groupBegin[g]]; };
    for (std::uint32_t g = 0; g + 1 < schedule.groupCount(); ++g) {
      EXPECT_LE(first(g + 1) - first(g), each.nodesPerGroup);
      EXPECT_GT(first(g + 1) - first(g), 0u);
    }
    EXPECT_LE(schedule.groupCount(), 2 * each.leaves / each.nodesPerGroup + 2);
  }
}

}  // namespace
}  // namespace relume::gl
