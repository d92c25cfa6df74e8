// SPDX-License-Identifier: MIT
// Cuts a triangle at the middles of its long edges. Whether an edge is long and where its middle lies depend on the
// edge alone, so that triangles which share it stay joined.
#pragma once

#include <array>
#include <vector>

namespace relume {

// Appends the two to four triangles that long edges cut `t` into, in its winding. isLong: of the edges from each corner
// to the next, at least one. rule: middle(a, b), the same for (b, a).
template <class Rule, class Corner>
void splitLong(const Rule& rule, const std::array<bool, 3>& isLong, const std::array<Corner, 3>& t,
               std::vector<std::array<Corner, 3>>& pieces) {
  const int count = int{isLong[0]} + int{isLong[1]} + int{isLong[2]};
  if (count == 3) {
    const Corner ab = rule.middle(t[0], t[1]), bc = rule.middle(t[1], t[2]), ca = rule.middle(t[2], t[0]);
    pieces.push_back({t[0], ab, ca});
    pieces.push_back({ab, t[1], bc});
    pieces.push_back({ca, bc, t[2]});
    pieces.push_back({ab, bc, ca});
    return;
  }
  // Turn the triangle so that edge ab is long, and of two long edges the other is bc.
  const std::size_t first = count == 1 ? (isLong[0] ? 0 : isLong[1] ? 1 : 2) : (!isLong[2] ? 0 : !isLong[0] ? 1 : 2);
  const Corner &a = t[first], &b = t[(first + 1) % 3], &c = t[(first + 2) % 3];
  const Corner ab = rule.middle(a, b);
  if (count == 1) {
    pieces.push_back({a, ab, c});
    pieces.push_back({ab, b, c});
    return;
  }
  const Corner bc = rule.middle(b, c);
  pieces.push_back({ab, b, bc});
  pieces.push_back({a, ab, bc});
  pieces.push_back({a, bc, c});
}

// `rule` has isLong(a, b) as well, the same for (b, a). Returns false, and appends nothing, where no edge is long.
template <class Rule, class Corner>
bool splitOnce(const Rule& rule, const std::array<Corner, 3>& t, std::vector<std::array<Corner, 3>>& pieces) {
  const std::array<bool, 3> isLong{rule.isLong(t[0], t[1]), rule.isLong(t[1], t[2]), rule.isLong(t[2], t[0])};
  if (!isLong[0] && !isLong[1] && !isLong[2]) return false;
  splitLong(rule, isLong, t, pieces);
  return true;
}

}  // namespace relume
