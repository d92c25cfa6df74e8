// SPDX-License-Identifier: MIT
// See bundle_tree.h. Embree first builds a binary tree by the surface area heuristic and splits until a leaf's lanes
// hold the rest. In Sponza, 6.8 of 8 lanes are used; a tree split into eight at once uses 2.9 and is half as fast. Then
// binary nodes are merged into nodes of eight so that the sum of all nodes' areas is least.
#include "bake/rays/bundle/bundle_tree.h"

#include "relume/bake/context.h"

#include <glm/common.hpp>

#include <algorithm>
#include <limits>
#include <memory>
#include <new>

namespace relume {
namespace {

constexpr float kMaxCoordinates = 1e18f;  // [m] sum of all nine; squares of larger ones overflow

// A binary node, or a leaf, in the memory of Embree's builder.
struct Built {
  bool isLeaf = false;
  Built* child[2] = {};
  RTCBounds bounds[2] = {};
  std::uint32_t count = 0;
  std::uint32_t triangle[kBundleLanes] = {};
  float cost[kBundleLanes + 1] = {};  // of at most i nodes of eight that stand for it
  std::uint8_t first[kBundleLanes + 1] =
      {};  // how many of these stand for its first child; 0: one stands for all of it
};

struct BvhDeleter {
  void operator()(RTCBVHTy* bvh) const { rtcReleaseBVH(bvh); }
};

void* createNode(RTCThreadLocalAllocator memory, unsigned, void*) {
  return new (rtcThreadLocalAlloc(memory, sizeof(Built), alignof(Built))) Built;
}

void setChildren(void* node, void** children, unsigned count, void*) {
  for (unsigned i = 0; i < count; ++i) static_cast<Built*>(node)->child[i] = static_cast<Built*>(children[i]);
}

void setBounds(void* node, const RTCBounds** bounds, unsigned count, void*) {
  for (unsigned i = 0; i < count; ++i) static_cast<Built*>(node)->bounds[i] = *bounds[i];
}

void* createLeaf(RTCThreadLocalAllocator memory, const RTCBuildPrimitive* primitives, std::size_t count, void*) {
  auto* leaf = new (rtcThreadLocalAlloc(memory, sizeof(Built), alignof(Built))) Built;
  leaf->isLeaf = true;
  leaf->count = static_cast<std::uint32_t>(count);
  for (std::size_t i = 0; i < count; ++i) leaf->triangle[i] = primitives[i].primID;
  return leaf;
}

float halfArea(const RTCBounds& b) {
  const float x = b.upper_x - b.lower_x, y = b.upper_y - b.lower_y, z = b.upper_z - b.lower_z;
  return x * y + y * z + z * x;
}

RTCBounds merged(const RTCBounds& a, const RTCBounds& b) {
  return {std::min(a.lower_x, b.lower_x), std::min(a.lower_y, b.lower_y), std::min(a.lower_z, b.lower_z), 0.0f,
          std::max(a.upper_x, b.upper_x), std::max(a.upper_y, b.upper_y), std::max(a.upper_z, b.upper_z), 0.0f};
}

std::vector<RTCBuildPrimitive> primitivesOf(std::span<const BundleTriangle> triangles) {
  std::vector<RTCBuildPrimitive> primitives;
  primitives.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Corners& c = triangles[i].corners;
    const glm::vec3 low = glm::min(c[0], glm::min(c[1], c[2])), high = glm::max(c[0], glm::max(c[1], c[2]));
    const glm::vec3 sum = glm::abs(c[0]) + glm::abs(c[1]) + glm::abs(c[2]);
    if (!(sum.x + sum.y + sum.z < kMaxCoordinates)) continue;
    RTCBuildPrimitive p{};
    p.lower_x = low.x, p.lower_y = low.y, p.lower_z = low.z;
    p.upper_x = high.x, p.upper_y = high.y, p.upper_z = high.z;
    p.primID = static_cast<unsigned>(i);
    primitives.push_back(p);
  }
  return primitives;
}

class Flatten {
 public:
  Flatten(std::span<const BundleTriangle> triangles, BundleTree& tree) : triangles_(triangles), tree_(tree) {}

  void addRoot(Built* root) {
    if (!root->isLeaf) {
      price(*root);
      addNode(*root, 1);
      return;
    }
    // The root of a tree of one leaf, which any ray may meet.
    Built above;
    constexpr float kAll = std::numeric_limits<float>::max() / 4;
    above.child[0] = root;
    above.bounds[0] = {-kAll, -kAll, -kAll, 0.0f, kAll, kAll, kAll, 0.0f};
    above.first[kBundleLanes] = 1;
    addNode(above, 1);
  }

 private:
  struct Child {
    Built* built;
    RTCBounds bounds;
  };

  // Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs" (HPG 2017),
  // Eqs. (2) to (4): a node costs its area, a leaf nothing.
  static void price(Built& built) {
    for (Built* child : built.child) {
      if (!child->isLeaf) price(*child);
    }
    const Built &a = *built.child[0], &b = *built.child[1];
    const float area = halfArea(merged(built.bounds[0], built.bounds[1]));
    for (std::uint32_t i = kBundleLanes; i >= 1; --i) {
      float& cost = built.cost[i];
      cost = std::numeric_limits<float>::infinity();
      for (std::uint32_t k = 1; k < i; ++k) {
        const float both = a.cost[k] + b.cost[i - k];
        if (both < cost) cost = both, built.first[i] = static_cast<std::uint8_t>(k);
      }
      const float alone = area + built.cost[kBundleLanes];
      if (i < kBundleLanes && alone <= cost) cost = alone, built.first[i] = 0;
    }
  }

  // The children of a node of eight: at most `max` stand for `built`.
  static void split(const Built& built, std::uint32_t max, std::vector<Child>& children) {
    const std::uint32_t shares[2] = {built.first[max], max - built.first[max]};
    for (std::uint32_t i = 0; i < 2; ++i) {
      Built* child = built.child[i];
      if (child == nullptr) continue;
      if (child->isLeaf || child->first[shares[i]] == 0) {
        children.push_back({child, built.bounds[i]});
      } else {
        split(*child, shares[i], children);
      }
    }
  }

  std::uint32_t addNode(const Built& built, std::uint32_t depth) {
    tree_.depth = std::max(tree_.depth, depth);
    const auto at = static_cast<std::uint32_t>(tree_.nodes.size());
    tree_.nodes.emplace_back();

    std::vector<Child> children;
    split(built, kBundleLanes, children);

    BundleNode node;
    for (std::size_t i = 0; i < kBundleLanes; ++i) {
      constexpr float kInfinity = std::numeric_limits<float>::infinity();
      const bool used = i < children.size();
      const RTCBounds b = used ? children[i].bounds
                               : RTCBounds{kInfinity, kInfinity, kInfinity, 0, -kInfinity, -kInfinity, -kInfinity, 0};
      node.low[0][i] = b.lower_x, node.low[1][i] = b.lower_y, node.low[2][i] = b.lower_z;
      node.high[0][i] = b.upper_x, node.high[1][i] = b.upper_y, node.high[2][i] = b.upper_z;
      if (!used) {
        node.child[i] = 0;
      } else if (children[i].built->isLeaf) {
        node.child[i] = kBundleLeaf | addLeaf(*children[i].built);
      } else {
        node.child[i] = addNode(*children[i].built, depth + 1);
      }
    }
    tree_.nodes[at] = node;
    return at;
  }

  std::uint32_t addLeaf(const Built& built) {
    BundleLeaf& leaf = tree_.leaves.emplace_back();
    for (std::uint32_t i = 0; i < kBundleLanes; ++i) {
      const bool used = i < built.count;
      const BundleTriangle& triangle = triangles_[built.triangle[used ? i : 0]];
      for (std::size_t k = 0; k < 9; ++k) {
        leaf.corner[k][i] = triangle.corners[used ? k / 3 : 0][static_cast<int>(k % 3)];
      }
      leaf.geometry[i] = triangle.geometry;
      leaf.triangle[i] = triangle.triangle;
    }
    return static_cast<std::uint32_t>(tree_.leaves.size() - 1);
  }

  std::span<const BundleTriangle> triangles_;
  BundleTree& tree_;
};

}  // namespace

BundleTree buildBundleTree(RTCDevice device, std::span<const BundleTriangle> triangles, const Context& context) {
  BundleTree tree;
  std::vector<RTCBuildPrimitive> primitives = primitivesOf(triangles);
  if (primitives.empty()) return tree;
  const std::unique_ptr<RTCBVHTy, BvhDeleter> bvh(rtcNewBVH(device));
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM;
  arguments.maxBranchingFactor = 2;
  arguments.maxDepth = 64;
  arguments.sahBlockSize = kBundleLanes;
  arguments.minLeafSize = 1;
  arguments.maxLeafSize = kBundleLanes;
  arguments.bvh = bvh.get();
  arguments.primitives = primitives.data();
  arguments.primitiveCount = arguments.primitiveArrayCapacity = primitives.size();
  arguments.createNode = createNode;
  arguments.setNodeChildren = setChildren;
  arguments.setNodeBounds = setBounds;
  arguments.createLeaf = createLeaf;
  arguments.buildProgress = [](void* told, double) { return !static_cast<const Context*>(told)->cancelled(); };
  arguments.userPtr = const_cast<Context*>(&context);
  if (auto* root = static_cast<Built*>(rtcBuildBVH(&arguments)); root != nullptr && !context.cancelled())
    Flatten(triangles, tree).addRoot(root);
  return tree;
}

}  // namespace relume
