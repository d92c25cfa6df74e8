// SPDX-License-Identifier: MIT
// See segment.h.
#include "bake/caches/charts/segment.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <queue>

namespace relume {
namespace {

// Give equal positions the same number. Numbers are in the order of the positions' bits, and so independent of the
// vertices'.
std::vector<std::uint32_t> weldPositions(const Mesh& mesh) {
  const std::size_t count = mesh.position.size();
  std::vector<std::array<std::uint32_t, 3>> key(count);
  for (std::size_t v = 0; v < count; ++v) {
    for (int k = 0; k < 3; ++k)
      key[v][static_cast<std::size_t>(k)] = std::bit_cast<std::uint32_t>(mesh.position[v][k] + 0.0f);
  }
  std::vector<std::uint32_t> order(count), welded(count);
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return key[a] != key[b] ? key[a] < key[b] : a < b; });
  for (std::size_t i = 0; i < count; ++i) {
    welded[order[i]] = i > 0 && key[order[i]] == key[order[i - 1]] ? welded[order[i - 1]] : order[i];
  }
  return welded;
}

struct Edge {
  std::uint32_t low, high, face;
};

// Find neighbours across every edge, by position. The faces of an edge of many, as in fans of foliage cards, form a
// chain.
void linkNeighbors(const Mesh& mesh, FaceGraph& graph) {
  std::vector<Edge> edges;
  edges.reserve(3 * graph.vertex.size());
  for (std::uint32_t f = 0; f < graph.vertex.size(); ++f) {
    if (graph.degenerate(f)) continue;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = graph.vertex[f][k], b = graph.vertex[f][(k + 1) % 3];
      if (a != b) edges.push_back({std::min(a, b), std::max(a, b), f});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) {
    if (x.low != y.low) return x.low < y.low;
    return x.high != y.high ? x.high < y.high : x.face < y.face;
  });

  constexpr std::size_t kAllPairs = 6;
  std::vector<Edge> links;  // face, neighbour, edge's first index in `edges`
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high) ++end;
    for (std::size_t x = i; x < end; ++x) {
      const std::size_t last = end - i <= kAllPairs ? end : std::min(end, x + 2);
      for (std::size_t y = x + 1; y < last; ++y) {
        if (edges[x].face == edges[y].face) continue;
        links.push_back({edges[x].face, edges[y].face, static_cast<std::uint32_t>(i)});
        links.push_back({edges[y].face, edges[x].face, static_cast<std::uint32_t>(i)});
      }
    }
    i = end;
  }
  std::sort(links.begin(), links.end(), [](const Edge& x, const Edge& y) {
    if (x.low != y.low) return x.low < y.low;
    return x.high != y.high ? x.high < y.high : x.face < y.face;
  });

  graph.begin.assign(graph.vertex.size() + 1, 0);
  for (const Edge& link : links) ++graph.begin[link.low + 1];
  std::partial_sum(graph.begin.begin(), graph.begin.end(), graph.begin.begin());
  for (const Edge& link : links) {
    graph.neighbor.push_back(link.high);
    const Edge& edge = edges[link.face];
    graph.edgeLength.push_back(glm::distance(mesh.position[edge.low], mesh.position[edge.high]));
  }
}

struct Candidate {
  float cost;  // 1 - cosine to the region's mean when it was found
  std::uint32_t face, from;
  bool operator<(const Candidate& other) const { return cost != other.cost ? cost > other.cost : face > other.face; }
};

constexpr std::uint32_t kUnassigned = kNone;

class Grower {
 public:
  Grower(const FaceGraph& graph, const RegionLimits& limits, const Context& context)
      : graph_(graph), limits_(limits), context_(context), region_(graph.vertex.size(), kUnassigned) {}

  std::vector<std::vector<std::uint32_t>> run() {
    std::vector<std::uint32_t> seeds(graph_.vertex.size());
    std::iota(seeds.begin(), seeds.end(), 0u);
    std::stable_sort(seeds.begin(), seeds.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return graph_.area[a] > graph_.area[b]; });
    for (const std::uint32_t seed : seeds) {
      if (context_.cancelled()) break;
      if (region_[seed] == kUnassigned && !graph_.degenerate(seed)) grow(seed);
    }
    mergeSmall();
    std::erase_if(faces_, [](const auto& faces) { return faces.empty(); });
    return std::move(faces_);
  }

 private:
  void grow(std::uint32_t seed) {
    const auto region = static_cast<std::uint32_t>(faces_.size());
    faces_.emplace_back();
    glm::vec3 sum(0.0f);
    std::priority_queue<Candidate> queue;
    queue.push({0.0f, seed, seed});
    while (!queue.empty() && !context_.cancelled()) {
      const Candidate next = queue.top();
      queue.pop();
      if (region_[next.face] != kUnassigned) continue;
      const glm::vec3& normal = graph_.normal[next.face];
      const bool fits = next.face == seed || (glm::dot(normal, sum) >= limits_.cosMean * glm::length(sum) &&
                                              glm::dot(normal, graph_.normal[seed]) >= limits_.cosSeed);
      if (!fits) continue;
      region_[next.face] = region;
      faces_[region].push_back(next.face);
      sum += normal * graph_.area[next.face];
      for (std::uint32_t i = graph_.begin[next.face]; i < graph_.begin[next.face + 1]; ++i) {
        const std::uint32_t face = graph_.neighbor[i];
        if (region_[face] != kUnassigned || glm::dot(normal, graph_.normal[face]) < limits_.cosCrease) continue;
        queue.push({1.0f - glm::dot(graph_.normal[face], sum) / glm::length(sum), face, next.face});
      }
    }
    sum_.push_back(sum);
  }

  // Join slivers that no region took to a neighbour.
  void mergeSmall() {
    constexpr std::size_t kSmallFaces = 64;
    std::vector<std::uint32_t> order(faces_.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return glm::length(sum_[a]) < glm::length(sum_[b]); });
    std::vector<std::pair<std::uint32_t, float>> border;
    for (const std::uint32_t small : order) {
      if (context_.cancelled()) return;
      if (faces_[small].size() > kSmallFaces) continue;
      border.clear();
      for (const std::uint32_t face : faces_[small]) {
        for (std::uint32_t i = graph_.begin[face]; i < graph_.begin[face + 1]; ++i) {
          const std::uint32_t other = region_[graph_.neighbor[i]];
          if (other == small || glm::dot(graph_.normal[face], graph_.normal[graph_.neighbor[i]]) < limits_.cosCrease)
            continue;
          const auto found =
              std::find_if(border.begin(), border.end(), [&](const auto& b) { return b.first == other; });
          if (found == border.end())
            border.emplace_back(other, graph_.edgeLength[i]);
          else
            found->second += graph_.edgeLength[i];
        }
      }
      std::sort(border.begin(), border.end(), [](const auto& a, const auto& b) {
        return a.second != b.second ? a.second > b.second : a.first < b.first;
      });
      for (const auto& [other, length] : border) {
        if (join(small, other)) break;
      }
    }
  }

  bool join(std::uint32_t small, std::uint32_t large) {
    const glm::vec3 sum = sum_[small] + sum_[large];
    const float length = glm::length(sum);
    // Merge only if the larger region's mean normal hardly turns, so that its own faces still agree with it.
    if (glm::dot(sum, sum_[large]) < 0.97f * length * glm::length(sum_[large])) return false;
    for (const std::uint32_t face : faces_[small]) {
      if (glm::dot(graph_.normal[face], sum) < limits_.cosMerge * length) return false;
    }
    for (const std::uint32_t face : faces_[small]) region_[face] = large;
    faces_[large].insert(faces_[large].end(), faces_[small].begin(), faces_[small].end());
    faces_[small].clear();
    sum_[large] = sum;
    return true;
  }

  const FaceGraph& graph_;
  const RegionLimits& limits_;
  const Context& context_;
  std::vector<std::uint32_t> region_;  // of a face
  std::vector<std::vector<std::uint32_t>> faces_;
  std::vector<glm::vec3> sum_;  // area-weighted sum of normals
};

}  // namespace

FaceGraph buildFaceGraph(const Mesh& mesh) {
  FaceGraph graph;
  const std::vector<std::uint32_t> welded = weldPositions(mesh);
  const std::size_t faces = mesh.triangle.size();
  graph.vertex.resize(faces);
  graph.normal.assign(faces, glm::vec3(0.0f));
  graph.area.assign(faces, 0.0f);
  for (std::size_t f = 0; f < faces; ++f) {
    const glm::uvec3& t = mesh.triangle[f];
    graph.vertex[f] = {welded[t.x], welded[t.y], welded[t.z]};
    const glm::dvec3 a = mesh.position[t.x], u = glm::dvec3(mesh.position[t.y]) - a,
                     v = glm::dvec3(mesh.position[t.z]) - a;
    const glm::dvec3 cross = glm::cross(u, v);
    const double twice = glm::length(cross);
    // Drop needles whose height is lost in the rounding of their corners.
    const double longest = std::max({glm::dot(u, u), glm::dot(v, v), glm::dot(u - v, u - v)});
    if (!std::isfinite(twice) || !(twice > 1e-6 * longest) || !(static_cast<float>(0.5 * twice) > 0.0f)) continue;
    graph.normal[f] = glm::vec3(cross / twice);
    graph.area[f] = static_cast<float>(0.5 * twice);
  }
  linkNeighbors(mesh, graph);
  return graph;
}

std::vector<std::vector<std::uint32_t>> growRegions(const FaceGraph& graph, const RegionLimits& limits,
                                                    const Context& context) {
  return Grower(graph, limits, context).run();
}

std::vector<std::vector<std::uint32_t>> connectedPieces(const FaceGraph& graph, std::span<const std::uint32_t> faces) {
  // Faces sorted by index, so that membership is a binary search and memory follows the set, not the mesh.
  std::vector<std::uint32_t> sorted(faces.begin(), faces.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::uint32_t> piece(sorted.size(), kUnassigned), stack;
  const auto slot = [&](std::uint32_t face) {
    const auto found = std::lower_bound(sorted.begin(), sorted.end(), face);
    return found != sorted.end() && *found == face ? static_cast<std::size_t>(found - sorted.begin()) : sorted.size();
  };
  std::uint32_t pieces = 0;
  for (const std::uint32_t start : faces) {
    if (piece[slot(start)] != kUnassigned) continue;
    stack.assign(1, start);
    piece[slot(start)] = pieces;
    while (!stack.empty()) {
      const std::uint32_t face = stack.back();
      stack.pop_back();
      for (std::uint32_t i = graph.begin[face]; i < graph.begin[face + 1]; ++i) {
        const std::size_t s = slot(graph.neighbor[i]);
        if (s == sorted.size() || piece[s] != kUnassigned) continue;
        piece[s] = pieces;
        stack.push_back(graph.neighbor[i]);
      }
    }
    ++pieces;
  }
  std::vector<std::vector<std::uint32_t>> result(pieces);
  for (const std::uint32_t face : faces) result[piece[slot(face)]].push_back(face);
  return result;
}

}  // namespace relume
