// SPDX-License-Identifier: MIT
// Sums over what a cache sees, cuts, projections and pull weights, on random trees and random rays.
#include "bake/links/project.h"
#include "bake/links/pull_weights.h"
#include "bake/links/select_cut.h"
#include "bake/links/visible_subtree.h"
#include "formats/sh.h"
#include "tests/links/links_fixture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace relume {
namespace {

using test::kY0;
using test::parentsOf;
using test::pullRadiosity;
using test::randomArrivals;
using test::randomHierarchy;

const auto kTransfer = LinkOptions::CutKey::transfer;

// Is `node` the root of a subtree that holds `leaf`?
bool holds(const std::vector<std::uint32_t>& parent, std::uint32_t node, std::uint32_t leaf) {
  while (leaf > node) leaf = parent[leaf];
  return leaf == node;
}

std::vector<CutLink> cutOf(const VisibleSubtree& tree, const Hierarchy& h, std::uint32_t maxNodes,
                           LinkOptions::CutKey key = kTransfer) {
  std::vector<CutCandidate> queue;
  std::vector<CutLink> cut;
  std::vector<CutNode> cutNode(h.nodeCount());
  for (std::uint32_t node = 0; node < h.nodeCount(); ++node) cutNode[node] = {h.firstWeight[node], 1.0f};
  sumHidden(h, cutNode);
  CutKeys keys;
  cutKeys(tree, cutNode, key, keys);
  selectCut(tree, keys, CutLimit{maxNodes}, queue, cut);
  return cut;
}

// Slot of a node, kNoSlot where no ray or a single part of it is seen.
std::uint32_t slotOf(const VisibleSubtree& tree, std::uint32_t node) {
  for (std::uint32_t slot = 0; slot < tree.nodes().size(); ++slot) {
    if (tree[slot].node == node) return slot;
  }
  return kNoSlot;
}

// Nodes 1 and 2 under the root, leaves 3 to 6 under them, all of equal areas.
Hierarchy fourLeaves() {
  Hierarchy h;
  h.child = std::vector<std::uint32_t>{1, 3, 5, kLeafBit, kLeafBit | 1, kLeafBit | 2, kLeafBit | 3};
  h.firstWeight = std::vector<float>{0.5f, 0.5f, 0.5f, 0, 0, 0, 0};
  h.leafNode = std::vector<std::uint32_t>{3, 4, 5, 6};
  h.groupRoot = std::vector<std::uint32_t>{0};
  h.levelBegin = std::vector<std::uint32_t>{0, 1, 3, 7};
  return h;
}

TEST(LeafOrder, leavesMeetInTheLowestNodeThatHoldsBoth) {
  for (const std::uint32_t n : {1u, 2u, 40u, 1000u, 5000u}) {
    const Hierarchy h = randomHierarchy(n, n);
    const LeafOrder order(h);
    const std::vector<std::uint32_t> parent = parentsOf(h);
    RandomStream random(1, 2, n);
    ASSERT_EQ(order.count(), n);
    for (int i = 0; i < 300 && n > 1; ++i) {
      const std::uint32_t a = random.below(n - 1), b = a + 1 + random.below(std::min(n - 1 - a, i % 2 ? 40u : n));
      std::uint32_t x = order.leaf(a), y = order.leaf(b);
      EXPECT_EQ(order.rank(x), a);
      while (x != y) (x > y ? x : y) = parent[std::max(x, y)];
      ASSERT_EQ(order.lowestCommonAncestor(a, b), x) << a << ' ' << b << " of " << n;
    }
  }
}

TEST(VisibleSubtree, sumsEqualADenseSum) {
  const Hierarchy h = randomHierarchy(3000, 1);
  const LeafOrder order(h);
  const std::vector<std::uint32_t> parent = parentsOf(h);
  VisibleSubtree tree(order);
  for (std::uint64_t round = 0; round < 3; ++round) {  // the memory of one cache must not leak into the next
    const auto arrivals = randomArrivals(h, 700, round);
    tree.build(arrivals, 1.0f);
    std::vector<double> weight(h.nodeCount(), 0), received(h.nodeCount(), 0), x(h.nodeCount(), 0);
    for (const Arrival& a : arrivals) {
      for (std::uint32_t node = a.leaf;; node = parent[node]) {
        weight[node] += a.weight;
        received[node] += double{a.weight} * a.cosine;
        x[node] += double{a.weight} * a.direction.x;
        if (node == 0) break;
      }
    }
    // In the tree are the visible leaves and the nodes with two visible children.
    std::size_t expected = 0;
    for (std::uint32_t node = 0; node < h.nodeCount(); ++node) {
      expected += h.isLeaf(node) ? weight[node] > 0 : weight[h.child[node]] > 0 && weight[h.child[node] + 1] > 0;
    }
    EXPECT_EQ(tree.nodes().size(), expected);
    for (std::uint32_t slot = 0; slot < tree.nodes().size(); ++slot) {
      const VisibleNode& t = tree[slot];
      EXPECT_NEAR(t.weight, weight[t.node], 1e-4 * weight[t.node]);
      EXPECT_NEAR(t.received, received[t.node], 1e-4 * weight[t.node]);
      EXPECT_NEAR(t.direction.x, x[t.node], 1e-4 * weight[t.node]);
      EXPECT_EQ(tree.isLeaf(slot), h.isLeaf(t.node));
      if (tree.isLeaf(slot)) continue;
      for (const std::uint32_t k : {0u, 1u}) {
        ASSERT_LT(t.child[k], slot);
        EXPECT_TRUE(holds(parent, h.child[t.node] + k, tree[t.child[k]].node));
      }
    }
    // With the number of nodes, that is: the visible leaves are there, and each once.
    ASSERT_EQ(tree.slotOfArrival().size(), arrivals.size());
    for (std::size_t i = 0; i < arrivals.size(); ++i) {
      ASSERT_LT(tree.slotOfArrival()[i], tree.leaves().size());
      EXPECT_EQ(tree[tree.slotOfArrival()[i]].node, arrivals[i].leaf);
    }
    ASSERT_EQ(tree.roots().size(), 1u);
    EXPECT_EQ(tree.roots()[0], tree.nodes().size() - 1);
  }
}

// keys of readError, against the sum over all nodes of the tree, those seen through one child with the others.
TEST(CutKeys, readErrorCountsTheNodesSeenThroughOneChild) {
  const Hierarchy h = randomHierarchy(800, 12);
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  const auto arrivals = randomArrivals(h, 60, 12);
  tree.build(arrivals, 1.0f);
  RandomStream random(12, 1, 1);
  std::vector<CutNode> cutNode(h.nodeCount());
  for (std::uint32_t node = 0; node < h.nodeCount(); ++node) cutNode[node] = {h.firstWeight[node], random.uniform(), 0};
  sumHidden(h, cutNode);
  CutKeys keys;
  cutKeys(tree, cutNode, LinkOptions::CutKey::readError, keys);

  struct Sum {
    double received = 0, weight = 0, key = 0;
    glm::dvec3 direction{0.0};
  };
  std::vector<Sum> sums(h.nodeCount());
  for (const Arrival& a : arrivals) {
    sums[a.leaf].received += double{a.weight} * a.cosine;
    sums[a.leaf].weight += a.weight;
    sums[a.leaf].direction += double{a.weight} * glm::dvec3(a.direction);
  }
  for (std::uint32_t node = h.nodeCount(); node-- > 0;) {
    if (h.isLeaf(node)) continue;
    const Sum &a = sums[h.child[node]], &b = sums[h.child[node] + 1];
    const double w = cutNode[node].firstWeight;
    Sum& s = sums[node] = {a.received + b.received, a.weight + b.weight, 0, a.direction + b.direction};
    const double received = a.received - w * s.received, weight = a.weight - w * s.weight;
    const glm::dvec3 direction = a.direction - w * s.direction;
    s.key =
        a.key + b.key +
        (received * received + 0.3 * (weight * weight + 3 * glm::dot(direction, direction)) / (4 * 3.14159265358979)) *
            cutNode[node].extent;
  }
  ASSERT_GT(tree.nodes().size(), tree.leaves().size());
  for (std::size_t slot = tree.leaves().size(); slot < tree.nodes().size(); ++slot) {
    EXPECT_NEAR(keys.average[slot], sums[tree.nodes()[slot].node].key, 1e-4 * keys.average[slot]);
  }
}

TEST(SelectCut, holdsEveryVisibleLeafExactlyOnceInAtMostTheAskedNodes) {
  const Hierarchy h = randomHierarchy(2000, 2);
  const std::vector<std::uint32_t> parent = parentsOf(h);
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  for (const std::uint32_t rays : {1u, 5u, 300u, 20000u}) {
    tree.build(randomArrivals(h, rays, rays), 1.0f);
    for (const std::uint32_t maxNodes : {1u, 2u, 17u, 254u, 1999u, 65535u}) {
      for (const auto key : {kTransfer, LinkOptions::CutKey::readError}) {
        const auto cut = cutOf(tree, h, maxNodes, key);
        EXPECT_LE(cut.size(), maxNodes);
        EXPECT_EQ(cut.size(), std::min<std::size_t>(maxNodes, tree.leaves().size()));
        for (const VisibleNode& leaf : tree.leaves()) {
          const auto holding = std::count_if(cut.begin(), cut.end(), [&](const CutLink& link) {
            return holds(parent, tree[link.slot].node, leaf.node);
          });
          ASSERT_EQ(holding, 1) << leaf.node;
        }
        for (std::size_t i = 1; i < cut.size(); ++i) EXPECT_LT(tree[cut[i - 1].reads].node, tree[cut[i].reads].node);
        for (const auto [slot, reads] : cut) EXPECT_TRUE(holds(parent, tree[slot].node, tree[reads].node));
      }
    }
  }
}

TEST(SelectCut, enoughLinksGiveTheVisibleLeaves) {
  const Hierarchy h = randomHierarchy(500, 3);
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  tree.build(randomArrivals(h, 400, 3), 1.0f);
  const auto cut = cutOf(tree, h, static_cast<std::uint32_t>(tree.leaves().size()));
  EXPECT_EQ(cut.size(), tree.leaves().size());
  for (const CutLink& link : cut) EXPECT_TRUE(h.isLeaf(tree[link.slot].node));
}

TEST(SelectCut, refinesTheLargestTransferFirst) {
  // Four leaves, two pairs; the second pair is twice as bright a view.
  const Hierarchy h = fourLeaves();
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  const glm::vec3 z(0, 0, 1);
  tree.build(std::vector<Arrival>{{3, 1, 1, z}, {4, 1, 1, z}, {5, 2, 1, z}, {6, 2, 1, z}}, 1.0f);
  const auto nodes = [&](std::uint32_t maxNodes) {
    std::vector<std::uint32_t> n;
    for (const CutLink& link : cutOf(tree, h, maxNodes)) n.push_back(tree[link.reads].node);
    return n;
  };
  EXPECT_EQ(nodes(1), (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(nodes(2), (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(nodes(3), (std::vector<std::uint32_t>{1, 5, 6}));
  EXPECT_EQ(nodes(4), (std::vector<std::uint32_t>{3, 4, 5, 6}));
}

// A node seen whole is read without error however large it is; one seen by half is not.
TEST(SelectCut, readErrorRefinesWhatIsSeenInPart) {
  Hierarchy h;
  h.child = std::vector<std::uint32_t>{1, 3, 5, kLeafBit, kLeafBit | 1, kLeafBit | 2, 7, kLeafBit | 3, kLeafBit | 4};
  h.firstWeight = std::vector<float>{0.5f, 0.5f, 0.5f, 0, 0, 0, 0.5f, 0, 0};
  h.leafNode = std::vector<std::uint32_t>{3, 4, 5, 7, 8};
  h.groupRoot = std::vector<std::uint32_t>{0};
  h.levelBegin = std::vector<std::uint32_t>{0, 1, 3, 7, 9};
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  const glm::vec3 z(0, 0, 1);
  // Node 1: both halves alike, and most of the light. Node 2: leaf 5 alike with half of node 6, the other half hidden.
  tree.build(std::vector<Arrival>{{3, 9, 1, z}, {4, 9, 1, z}, {5, 1, 1, z}, {7, 1, 1, z}}, 1.0f);
  std::vector<CutNode> cutNode(h.nodeCount());
  for (std::uint32_t node = 0; node < h.nodeCount(); ++node) cutNode[node] = {h.firstWeight[node], 1.0f};
  sumHidden(h, cutNode);
  CutKeys keys;
  cutKeys(tree, cutNode, LinkOptions::CutKey::readError, keys);
  EXPECT_EQ(keys.key[slotOf(tree, 1)], 0.0f);
  // Leaves 5 and 7 alike; node 6, seen by half: e² = |C_a - w C_s|² with received 1, band 0 y_0 and band 1 sqrt(3) y_0,
  // weighted 0.3.
  EXPECT_EQ(slotOf(tree, 6), kNoSlot);
  EXPECT_NEAR(keys.average[slotOf(tree, 2)], 0.25 * (1 + 0.3 * (1 + 3) / (4 * 3.14159265)), 1e-5);
  std::vector<std::uint32_t> nodes;
  for (const CutLink& link : cutOf(tree, h, 3, LinkOptions::CutKey::readError)) nodes.push_back(tree[link.reads].node);
  EXPECT_EQ(nodes, (std::vector<std::uint32_t>{1, 5, 7}));
}

// Where nearly all light is one child's, the link gives all of it to that child; where halves are alike, to their mean.
TEST(SelectCut, linksPickTheChildThatErrsLessThanTheAverage) {
  const Hierarchy h = fourLeaves();
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  const glm::vec3 z(0, 0, 1);
  const auto readError = LinkOptions::CutKey::readError;
  const auto reads = [&](std::uint32_t maxNodes) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> nodes;
    for (const auto [slot, read] : cutOf(tree, h, maxNodes, readError))
      nodes.push_back({tree[slot].node, tree[read].node});
    return nodes;
  };
  using Nodes = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  tree.build(std::vector<Arrival>{{3, 10, 1, z}, {4, 1, 1, z}, {5, 1, 1, z}, {6, 1, 1, z}}, 1.0f);
  EXPECT_EQ(reads(1), (Nodes{{0, 3}}));
  EXPECT_EQ(reads(2), (Nodes{{2, 2}, {1, 3}}));  // ascending by what is read
  tree.build(std::vector<Arrival>{{3, 10, 1, z}, {4, 10, 1, z}, {5, 10, 1, z}, {6, 10, 1, z}}, 1.0f);
  EXPECT_EQ(reads(1), (Nodes{{0, 0}}));
  // The paper's key never picks.
  tree.build(std::vector<Arrival>{{3, 10, 1, z}, {4, 1, 1, z}, {5, 1, 1, z}, {6, 1, 1, z}}, 1.0f);
  const auto paper = cutOf(tree, h, 1);
  EXPECT_EQ(tree[paper[0].reads].node, 0u);
  // A key is the error of what is read: here b's light at the distance of a and b, twice.
  std::vector<CutNode> cutNode(h.nodeCount());
  for (std::uint32_t node = 0; node < h.nodeCount(); ++node) cutNode[node] = {h.firstWeight[node], 1.0f};
  sumHidden(h, cutNode);
  CutKeys keys;
  cutKeys(tree, cutNode, readError, keys);
  const double unit = 1 + 0.3 * (1 + 3) / (4 * 3.14159265);  // |C|² of received 1
  EXPECT_NEAR(keys.key[slotOf(tree, 1)], unit, 1e-4);
  EXPECT_NEAR(keys.key[slotOf(tree, 0)], 4 * unit + 13.0 * 13.0 / (11.0 * 11.0) * unit, 1e-3);
}

// A part that is given more than four times its own light would make a spot: the average is read.
TEST(SelectCut, linksDoNotPickWhatIsTooSmall) {
  const Hierarchy h = randomHierarchy(2000, 31);
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    tree.build(randomArrivals(h, 300, seed), 1.0f);
    std::size_t picked = 0;
    for (const auto [slot, read] : cutOf(tree, h, 16, LinkOptions::CutKey::readError)) {
      picked += slot != read;
      if (slot == read) continue;
      // Step by step down to what is read.
      for (std::uint32_t at = slot; at != read;) {
        const auto [a, b] = tree[at].child;
        const std::uint32_t next =
            tree[a].firstLeaf <= tree[read].firstLeaf && tree[read].endLeaf <= tree[a].endLeaf ? a : b;
        EXPECT_LE(tree[at].weight, 8.0f * tree[next].weight);  // |C| counts directions as well
        at = next;
      }
    }
    EXPECT_GT(picked, 0u);
  }
}

TEST(SelectCut, whatNoRayReachedIsNeverLinked) {
  const Hierarchy h = randomHierarchy(1000, 4);
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  const auto arrivals = randomArrivals(h, 3, 4);
  tree.build(arrivals, 1.0f);
  // Three rays, links to spare: the leaves themselves, not the clusters around them.
  for (const CutLink& link : cutOf(tree, h, 254)) EXPECT_TRUE(h.isLeaf(tree[link.slot].node));
  tree.build({}, 1.0f);
  EXPECT_TRUE(cutOf(tree, h, 254).empty());
}

TEST(Project, shLinksAreTheRaysOwnProjection) {
  const Hierarchy h = randomHierarchy(400, 5);
  const std::vector<std::uint32_t> parent = parentsOf(h);
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  const auto arrivals = randomArrivals(h, 900, 5);
  tree.build(arrivals, 1.0f);
  const auto cut = cutOf(tree, h, 40);
  for (const std::uint32_t bands : {1u, 2u, 4u, 8u}) {
    const std::uint32_t size = bands * bands;
    LinkRowBuilder rows(LinkKind::sh);
    ProjectScratch scratch;
    appendShRow(tree, cut, arrivals, LinkKind::sh, bands, scratch, rows);
    ASSERT_EQ(rows.shNode.size(), cut.size());
    ASSERT_EQ(rows.shCoefficients.size(), cut.size() * size);
    for (std::size_t link = 0; link < cut.size(); ++link) {
      std::vector<double> c(size, 0.0);
      std::vector<float> y(size);
      for (const Arrival& a : arrivals) {
        if (!holds(parent, rows.shNode[link], a.leaf)) continue;
        evaluateSh(static_cast<int>(bands), a.direction, y);
        for (std::uint32_t i = 0; i < size; ++i) c[i] += double{a.weight} * y[i];
      }
      for (std::uint32_t i = 0; i < size; ++i) {
        EXPECT_NEAR(unpackHalf(rows.shCoefficients[link * size + i]), c[i],
                    1e-3 * std::abs(c[0]) + 1e-3 * std::abs(c[i]));
      }
    }
  }
}

TEST(Project, coneLinksMatchBandsZeroAndOneOfTheRays) {
  const Hierarchy h = randomHierarchy(400, 6);
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  const auto arrivals = randomArrivals(h, 900, 6);
  tree.build(arrivals, 1.0f);
  const auto cut = cutOf(tree, h, 40);
  LinkRowBuilder sh(LinkKind::sh), cone(LinkKind::cone);
  ProjectScratch scratch;
  appendShRow(tree, cut, arrivals, LinkKind::sh, 2, scratch, sh);
  appendConeRow(tree, cut, LinkKind::cone, cone);
  ASSERT_EQ(cone.cone.size(), cut.size());
  for (std::size_t link = 0; link < cut.size(); ++link) {
    const ConeLink& l = cone.cone[link];
    EXPECT_EQ(l.node, sh.shNode[link]);
    std::array<float, 2> ratio;
    std::array<float, 4> y;
    coneBandRatios(2, unpackHalf(l.cosAlpha), ratio);
    evaluateSh(2, unpackOctahedral(l.direction), y);
    const float f = unpackHalf(l.transfer);
    for (int i = 0; i < 4; ++i) {
      const double c = f * ratio[i == 0 ? 0 : 1] * y[i] / kY0;
      EXPECT_NEAR(c, unpackHalf(sh.shCoefficients[link * 4 + i]), 4e-3 * f) << i;
    }
  }
}

// The light of all caches together, read through cuts and averages, is what the leaves that they read send, under any
// lighting: of a link that picks, those below its pick, with the light of all its own.
TEST(PullWeights, importanceKeepsTheLightOfAllCachesTogether) {
  const Hierarchy h = randomHierarchy(1500, 7);
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  using Read = std::pair<std::uint32_t, double>;
  for (const auto key : {kTransfer, LinkOptions::CutKey::readError}) {
    for (const std::uint32_t maxNodes : {1u, 8u, 60u}) {
      PullSums sums(h, LinkOptions::PullWeight::importance);
      std::vector<Read> links, leaves;
      for (std::uint64_t cache = 0; cache < 40; ++cache) {
        tree.build(randomArrivals(h, 300, 100 + cache), 1.0f);
        const auto cut = cutOf(tree, h, maxNodes, key);
        sums.add(tree, cut);
        for (const auto [slot, reads] : cut) {
          const VisibleNode& target = tree[reads];
          links.push_back({target.node, tree[slot].received});
          const double scale = double{tree[slot].received} / target.received;
          for (std::uint32_t leaf = target.firstLeaf; leaf < target.endLeaf; ++leaf)
            leaves.push_back({tree[leaf].node, tree[leaf].received * scale});
        }
      }
      const auto weights = sums.weights(h);
      for (std::uint64_t light = 0; light < 4; ++light) {
        RandomStream random(light, 3, 0);
        std::vector<double> sender(h.senderCount());
        for (double& b : sender) b = std::pow(random.uniform(), 8.0);
        const auto exact = pullRadiosity(h, weights, sender), equal = pullRadiosity(h, h.firstWeight, sender);
        const auto total = [](const std::vector<Read>& reads, const std::vector<double>& radiosity) {
          double sum = 0;
          for (const auto& [node, received] : reads) sum += received * radiosity[node];
          return sum;
        };
        const double byLeaves = total(leaves, exact);
        EXPECT_NEAR(total(links, exact) / byLeaves, 1.0, 1e-5);
        if (key == kTransfer && maxNodes < 60) {
          EXPECT_GT(std::abs(total(links, equal) / byLeaves - 1.0), 1e-3);  // the test can tell
        }
      }
    }
  }
}

TEST(PullWeights, areIndependentOfHowCachesAreSharedOut) {
  const Hierarchy h = randomHierarchy(300, 8);
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  constexpr auto kImportance = LinkOptions::PullWeight::importance;
  PullSums one(h, kImportance), even(h, kImportance), odd(h, kImportance);
  for (std::uint64_t cache = 0; cache < 20; ++cache) {
    const auto arrivals = randomArrivals(h, 100, cache);
    tree.build(arrivals, 1.0f);
    const auto cut = cutOf(tree, h, 20);
    one.add(tree, cut);
    (cache % 2 ? odd : even).add(tree, cut);
  }
  odd.merge(even);
  EXPECT_EQ(one.weights(h), odd.weights(h));
}

TEST(PullWeights, areaIsThePapersEqualAreas) {
  const Hierarchy h = randomHierarchy(300, 9);
  EXPECT_EQ(PullSums(h, LinkOptions::PullWeight::area).weights(h), h.firstWeight.toVector());
}

TEST(PullWeights, unseenNodesFallBackOnEqualAreas) {
  const Hierarchy h = randomHierarchy(300, 10);
  EXPECT_EQ(PullSums(h, LinkOptions::PullWeight::importance).weights(h), h.firstWeight.toVector());
}

}  // namespace
}  // namespace relume
