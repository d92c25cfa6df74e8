// SPDX-License-Identifier: MIT
// Chooses the nodes a cache is linked to (PIC 4.5): starting from the groups' roots, the node with the largest key is
// replaced by its visible children until there are n_L.
#pragma once

#include "bake/hierarchy/hierarchy.h"
#include "bake/links/visible_subtree.h"
#include "relume/bake/options.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// What the keys need to know of a node. [Size nodes]
struct CutNode {
  float firstWeight = 0.0f;  // share of the first child in the average a link reads, equal areas
  float extent = 0.0f;       // readError: distance of the children's centres and a surfel's width [m]; 0 at leaves
  double hidden = 0.0;       // readError: sum over the ancestors of extent * (share of the child that is not on the
                             // way to this node)²: what seeing only this node of them costs
};

// Fill in CutNode::hidden from weights and extents.
void sumHidden(const Hierarchy& hierarchy, std::span<CutNode> nodes);

// The sky stands on a sphere of the level's radius; an emitter's light counts kEmitterWeight times, for it is that much
// stronger. Sky senders start at emission.size().
inline constexpr float kEmitterWeight = 8.0f;
std::vector<CutNode> cutNodes(const Hierarchy& hierarchy, const NodeGeometry& geometry, LinkOptions::CutKey key,
                              std::span<const glm::vec3> emission);

// RMS radius of the largest group that is not the sky [m]; 1 where there is none.
float levelRadius(const Hierarchy& hierarchy, const NodeGeometry& geometry);

// readError's model takes E (B_a - B_b)² to be kContrast B² x distance / levelRadius(), so keys of a cut that add up to
// this much leave about that relative error e of a cache's light. Errors saturate where neighbours are not independent:
// the model's is e / (1 - e). docs/notes/cuts.md has what lights that no bake knew find of what is asked for.
inline constexpr float kContrast = 28.0f;
inline float keySumOf(float relativeError, float levelRadius) {  // [0..1], [m]
  const float modelled = relativeError / (1.0f - relativeError);
  return modelled * modelled * levelRadius / kContrast;
}

// What a link at each visible node costs and reads, by slot. Memory is kept from cache to cache.
struct CutKeys {
  std::vector<float> key;            // the larger, the sooner refined; 0 at leaves
  std::vector<std::uint32_t> reads;  // slot of the node that a link reads with all of its weight: its own, or one below
  std::vector<float> average;        // readError: what reading the node's own average costs
};

// A link reads the average of nodes below it, or of those it picks:
//   transfer        f, the paper's. Links read their own nodes.
//   readError       the expected square of the error made by what a link reads in place of its visible leaves. A link
//                   of coefficients C_s that averages reads children a and b with C_s w and C_s (1-w); exact would be
//                   C_a and C_b with C_a + C_b = C_s. So the error is (C_s w - C_a)(B_a - B_b), plus what reading a
//                   and b as averages costs; with E (B_a - B_b)² taken to grow with the distance of a and b,
//                   average_s = |C_a - w C_s|² extent + average_a + average_b.
//                   Reading a alone with all of C_s errs by B_a - B_b for b's light, and scales a's error:
//                   pick_a = |C_b|² extent + (C_s / C_a)² key_a. The key is the least of the three, bottom up.
//                   It refines where a node is seen in part: there light leaks. C is the received irradiance, and with
//                   less weight bands 0 and 1, for other normals than the cache's. docs/notes/cuts.md compares the
//                   keys. Nodes of which one child is seen are not in the tree: their sum comes from CutNode::hidden.
void cutKeys(const VisibleSubtree& tree, std::span<const CutNode> cutNode, LinkOptions::CutKey key, CutKeys& keys);

struct CutCandidate {
  float key;
  std::uint32_t slot;
};

// When to stop refining: whichever comes first.
struct CutLimit {
  std::uint32_t maxNodes = 0;  // [>= 1]
  float minKey = -1.0f;        // nodes with keys up to this one stay whole
  float maxKeySum = 0.0f;      // [>= 0] stop when the nodes of the cut have keys of together at most this; 0 = never
};

// A link of a cut, as slots of the visible tree: it carries the light of all leaves under `slot`, and reads `reads`.
struct CutLink {
  std::uint32_t slot, reads;
};

// The cut, ascending by the nodes that are read. It has at most maxNodes links (but never fewer than the visible
// groups), and every visible leaf lies under exactly one of their slots. Children no ray reached are in no cut; a node
// with a single visible child is replaced by it, for that costs no link. `queue` is scratch.
void selectCut(const VisibleSubtree& tree, const CutKeys& keys, const CutLimit& limit, std::vector<CutCandidate>& queue,
               std::vector<CutLink>& cut);

}  // namespace relume
