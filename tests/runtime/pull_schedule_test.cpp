// SPDX-License-Identifier: MIT
// The order in which the GPU pulls: every inner node once, after its children, whatever the tree's shape.
#include "runtime/passes/pull_schedule.h"

#include "tests/runtime/random_tree.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace relume::gpu {
namespace {

struct Case {
  std::uint32_t leaves;
  float evenness;
  std::uint32_t nodesPerGroup;
};
const Case kCases[] = {{1, 0.5f, 8},   {2, 0.5f, 8},     {3, 0.5f, 1},        {500, 0.5f, 1},
                       {500, 0.5f, 8}, {3000, 0.0f, 64}, {20000, 0.05f, 512}, {20000, 0.5f, 4096}};

// Node of inner node number `firstInner + i` of a run, as the shader finds it.
std::uint32_t nodeOf(const PullSchedule& schedule, const PullSchedule::Run& run, std::uint32_t i) {
  return run.firstNode + (schedule.word[run.firstInner + i] >> 16);
}

TEST(PullSchedule, hasEveryInnerNodeOnceWithItsNumberAndWeight) {
  for (const Case& each : kCases) {
    const Hierarchy tree = test::makeRandomTree(each.leaves, each.evenness, 7);
    const PullSchedule schedule = makePullSchedule(tree, each.nodesPerGroup, std::pmr::new_delete_resource());
    ASSERT_EQ(schedule.word.size(), each.leaves - 1u);
    std::vector<std::uint32_t> seen;
    for (const PullSchedule::Run& run : schedule.run) {
      const auto [first, second] = packRun(run);
      EXPECT_EQ(first & 0x1FFFFFFu, run.firstNode);
      EXPECT_EQ(second & 0x1FFFFFFu, run.firstInner);
      EXPECT_EQ(first >> 25 | second >> 25 << 7, run.count);
      for (std::uint32_t i = 0; i < run.count; ++i) {
        const std::uint32_t node = nodeOf(schedule, run, i);
        ASSERT_FALSE(tree.isLeaf(node));
        EXPECT_EQ(tree.child[node], 1 + 2 * (run.firstInner + i));
        EXPECT_NEAR(static_cast<float>(schedule.word[run.firstInner + i] & 0xFFFFu), 65534.0f * tree.firstWeight[node],
                    0.51f);
        seen.push_back(node);
      }
    }
    ASSERT_EQ(seen.size(), each.leaves - 1u);
    std::sort(seen.begin(), seen.end());
    EXPECT_EQ(std::adjacent_find(seen.begin(), seen.end()), seen.end());
  }
}

TEST(PullSchedule, childrenComeInAnEarlierRunOfTheGroupAndInEarlierGroupsOrRoundsOfTheTop) {
  for (const Case& each : kCases) {
    const Hierarchy tree = test::makeRandomTree(each.leaves, each.evenness, 11);
    const PullSchedule schedule = makePullSchedule(tree, each.nodesPerGroup, std::pmr::new_delete_resource());
    constexpr std::uint32_t kNever = 0xFFFFFFFFu;
    std::vector<std::uint32_t> group(tree.nodeCount(), kNever), round(tree.nodeCount(), kNever);
    const auto pull = [&](const PullSchedule::Run& run, std::uint32_t g, std::uint32_t r) {
      for (std::uint32_t i = 0; i < run.count; ++i) {
        const std::uint32_t node = nodeOf(schedule, run, i);
        for (const std::uint32_t child : {tree.child[node], tree.child[node] + 1}) {
          if (tree.isLeaf(child)) continue;
          ASSERT_NE(group[child], kNever);
          ASSERT_TRUE(g == schedule.groupCount() || group[child] == g);
          ASSERT_TRUE(group[child] != g || round[child] < r);
        }
        group[node] = g;
        round[node] = r;
      }
    };
    for (std::uint32_t g = 0; g < schedule.groupCount(); ++g) {
      for (std::uint32_t r = schedule.groupBegin[g]; r < schedule.groupBegin[g + 1]; ++r) pull(schedule.run[r], g, r);
    }
    for (std::uint32_t r = 0; r < schedule.roundCount(); ++r) {
      for (std::uint32_t k = schedule.roundBegin[r]; k < schedule.roundBegin[r + 1]; ++k)
        pull(schedule.run[k], schedule.groupCount(), r);
    }
  }
}

TEST(PullSchedule, groupsKeepToTheirSizeAndEndOnlyWhenFullOrBelowTheTop) {
  for (const Case& each : kCases) {
    const Hierarchy tree = test::makeRandomTree(each.leaves, each.evenness, 3);
    const PullSchedule schedule = makePullSchedule(tree, each.nodesPerGroup, std::pmr::new_delete_resource());
    for (std::uint32_t g = 0; g < schedule.groupCount(); ++g) {
      std::uint32_t nodes = 0;
      for (std::uint32_t r = schedule.groupBegin[g]; r < schedule.groupBegin[g + 1]; ++r)
        nodes += schedule.run[r].count;
      EXPECT_LE(nodes, each.nodesPerGroup);
      EXPECT_GT(nodes, 0u);
    }
    // Of two groups in a row that a node of the top does not part, the two together would be too large.
    const auto top = static_cast<std::uint32_t>(schedule.run.size()) - schedule.groupBegin.back();
    EXPECT_LE(schedule.groupCount(), 2 * each.leaves / each.nodesPerGroup + top + 1);
  }
}

}  // namespace
}  // namespace relume::gpu
