// SPDX-License-Identifier: MIT
// See split_vertices.h. The copies of a vertex form a list that begins at the vertex itself.
#include "bake/export/split_vertices.h"

#include "relume/caches.h"

#include <numeric>

namespace relume {
namespace {

constexpr std::uint32_t kEnd = 0xFFFFFFFFu;

class Splitter {
 public:
  Splitter(SplitVertices& out) : out_(out) {
    const std::size_t count = out.source.size();
    out.front.assign(count, kGridLit);
    out.back.assign(count, kGridLit);
    next_.assign(count, kEnd);
    taken_.assign(count, 0);
  }

  // The copy of new vertex `first` with these coordinates, made where there is none.
  std::uint32_t find(std::uint32_t first, std::uint32_t front, std::uint32_t back) {
    std::uint32_t v = first;
    for (;; v = next_[v]) {
      if (!taken_[v]) {
        taken_[v] = 1;
        out_.front[v] = front;
        out_.back[v] = back;
        return v;
      }
      if (out_.front[v] == front && out_.back[v] == back) return v;
      if (next_[v] == kEnd) break;
    }
    const auto added = static_cast<std::uint32_t>(out_.source.size());
    next_[v] = added;
    out_.source.push_back(out_.source[first]);
    out_.front.push_back(front);
    out_.back.push_back(back);
    next_.push_back(kEnd);
    taken_.push_back(1);
    ++out_.added;
    return added;
  }

 private:
  SplitVertices& out_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint8_t> taken_;
};

}  // namespace

SplitVertices splitVertices(const ChartedCorners& corners, std::uint32_t vertexCount, bool compact) {
  // Number the vertices that stay.
  SplitVertices out;
  std::vector<std::uint32_t> number(vertexCount);
  if (compact) {
    std::vector<std::uint8_t> used(vertexCount, 0);
    for (const std::uint32_t v : corners.vertex) used[v] = 1;
    for (std::uint32_t v = 0; v < vertexCount; ++v) {
      number[v] = static_cast<std::uint32_t>(out.source.size());
      if (used[v]) out.source.push_back(v);
    }
  } else {
    std::iota(number.begin(), number.end(), 0u);
    out.source = number;
  }

  // Hand each corner its copy; triangles that nobody sees ask for none.
  Splitter splitter(out);
  out.corner.resize(corners.vertex.size());
  for (std::size_t c = 0; c < corners.vertex.size(); ++c) {
    const std::uint32_t first = number[corners.vertex[c]];
    out.corner[c] = corners.unseen[c / 3] ? first : splitter.find(first, corners.front[c], corners.back[c]);
  }
  out.kept = out.source.size() == vertexCount && out.added == 0;
  return out;
}

}  // namespace relume
