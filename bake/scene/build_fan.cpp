// SPDX-License-Identifier: MIT
// See fan_tree.h. Embree splits in two by the surface area heuristic until a leaf's lanes hold the rest; full leaves
// make fans twice as fast as those of a tree that is split in eight at once. Then each node takes its largest
// descendants for children, up to eight (Wald, Benthin and Boulos, "Getting Rid of Packets", RT 2008).
#include "bake/scene/fan_tree.h"

#include <glm/common.hpp>

#include <cmath>
#include <limits>
#include <memory>
#include <new>

namespace relume {
namespace {

// A node of two, or a leaf, in the memory of Embree's builder.
struct Built {
  bool isLeaf = false;
  Built* child[2] = {};
  RTCBounds bounds[2] = {};
  std::uint32_t count = 0;
  std::uint32_t triangle[kFanLanes] = {};
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

std::vector<RTCBuildPrimitive> primitivesOf(std::span<const FanTriangle> triangles) {
  std::vector<RTCBuildPrimitive> primitives;
  primitives.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Corners& c = triangles[i].corners;
    const glm::vec3 low = glm::min(c[0], glm::min(c[1], c[2])), high = glm::max(c[0], glm::max(c[1], c[2]));
    const glm::vec3 sum = c[0] + c[1] + c[2];
    if (!std::isfinite(sum.x + sum.y + sum.z)) continue;
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
  Flatten(std::span<const FanTriangle> triangles, FanTree& tree) : triangles_(triangles), tree_(tree) {}

  void addRoot(Built* root) {
    if (!root->isLeaf) {
      addNode(*root, 1);
      return;
    }
    // A node above the only leaf, which any ray may meet.
    Built above;
    constexpr float kAll = std::numeric_limits<float>::max() / 4;
    above.child[0] = root;
    above.bounds[0] = {-kAll, -kAll, -kAll, 0.0f, kAll, kAll, kAll, 0.0f};
    addNode(above, 1);
  }

 private:
  struct Child {
    Built* built;
    RTCBounds bounds;
  };

  std::uint32_t addNode(const Built& built, std::uint32_t depth) {
    tree_.depth = std::max(tree_.depth, depth);
    const auto at = static_cast<std::uint32_t>(tree_.nodes.size());
    tree_.nodes.emplace_back();

    // Open the largest child while there is room.
    std::vector<Child> children;
    const auto open = [&](const Built& node) {
      for (std::size_t i = 0; i < 2; ++i) {
        if (node.child[i] != nullptr) children.push_back({node.child[i], node.bounds[i]});
      }
    };
    open(built);
    while (children.size() < kFanLanes) {
      auto largest = children.end();
      for (auto c = children.begin(); c != children.end(); ++c) {
        if (!c->built->isLeaf && (largest == children.end() || halfArea(c->bounds) > halfArea(largest->bounds)))
          largest = c;
      }
      if (largest == children.end()) break;
      const Built& inner = *largest->built;
      children.erase(largest);
      open(inner);
    }

    FanNode node;
    for (std::size_t i = 0; i < kFanLanes; ++i) {
      constexpr float kInfinity = std::numeric_limits<float>::infinity();
      const bool used = i < children.size();
      const RTCBounds b = used ? children[i].bounds
                               : RTCBounds{kInfinity, kInfinity, kInfinity, 0, -kInfinity, -kInfinity, -kInfinity, 0};
      node.low[0][i] = b.lower_x, node.low[1][i] = b.lower_y, node.low[2][i] = b.lower_z;
      node.high[0][i] = b.upper_x, node.high[1][i] = b.upper_y, node.high[2][i] = b.upper_z;
      if (!used) {
        node.child[i] = 0;
      } else if (children[i].built->isLeaf) {
        node.child[i] = kFanLeaf | addLeaf(*children[i].built);
      } else {
        node.child[i] = addNode(*children[i].built, depth + 1);
      }
    }
    tree_.nodes[at] = node;
    return at;
  }

  std::uint32_t addLeaf(const Built& built) {
    FanLeaf& leaf = tree_.leaves.emplace_back();
    for (std::uint32_t i = 0; i < kFanLanes; ++i) {
      const bool used = i < built.count;
      const FanTriangle& triangle = triangles_[built.triangle[used ? i : 0]];
      for (std::size_t k = 0; k < 9; ++k) {
        leaf.corner[k][i] = triangle.corners[used ? k / 3 : 0][static_cast<int>(k % 3)];
      }
      leaf.geometry[i] = triangle.geometry;
      leaf.triangle[i] = triangle.triangle;
    }
    return static_cast<std::uint32_t>(tree_.leaves.size() - 1);
  }

  std::span<const FanTriangle> triangles_;
  FanTree& tree_;
};

}  // namespace

FanTree buildFanTree(RTCDevice device, std::span<const FanTriangle> triangles) {
  FanTree tree;
  std::vector<RTCBuildPrimitive> primitives = primitivesOf(triangles);
  if (primitives.empty()) return tree;
  const std::unique_ptr<RTCBVHTy, BvhDeleter> bvh(rtcNewBVH(device));
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM;
  arguments.maxBranchingFactor = 2;
  arguments.maxDepth = 64;
  arguments.sahBlockSize = kFanLanes;
  arguments.minLeafSize = 1;
  arguments.maxLeafSize = kFanLanes;
  arguments.bvh = bvh.get();
  arguments.primitives = primitives.data();
  arguments.primitiveCount = arguments.primitiveArrayCapacity = primitives.size();
  arguments.createNode = createNode;
  arguments.setNodeChildren = setChildren;
  arguments.setNodeBounds = setBounds;
  arguments.createLeaf = createLeaf;
  if (auto* root = static_cast<Built*>(rtcBuildBVH(&arguments))) Flatten(triangles, tree).addRoot(root);
  return tree;
}

}  // namespace relume
