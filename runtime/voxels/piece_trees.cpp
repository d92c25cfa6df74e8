// SPDX-License-Identifier: MIT
// See piece_trees.h.
#include "runtime/voxels/piece_trees.h"

#include "runtime/voxels/split_edges.h"

#include <algorithm>

namespace relume {
namespace {

using PieceCorners = PieceTrees::Corners;

PieceCorners turned(const PieceCorners& t, std::size_t by) { return {t[by], t[(by + 1) % 3], t[(by + 2) % 3]}; }

std::uint8_t turnedCut(std::uint32_t cut, std::size_t by) {
  return static_cast<std::uint8_t>((cut >> by | cut << (3 - by)) & 7u);
}

// The triangle that was cut into these, which are in splitLong()'s order, as if its first edges had been long.
PieceCorners wholeOf(const std::array<PieceCorners, 2>& t) { return {t[0][0], t[1][1], t[1][2]}; }
PieceCorners wholeOf(const std::array<PieceCorners, 3>& t) { return {t[1][0], t[0][1], t[2][2]}; }
PieceCorners wholeOf(const std::array<PieceCorners, 4>& t) { return {t[0][0], t[1][1], t[2][2]}; }

// Whether piece `i` has the corners that it shares with those after it, once these are turned as they were cut.
bool fits(const std::array<PieceCorners, 2>& t, std::size_t i) {
  return i == 1 || (t[0][1] == t[1][0] && t[0][2] == t[1][2]);
}
bool fits(const std::array<PieceCorners, 3>& t, std::size_t i) {
  if (i == 2) return true;
  return i == 1 ? t[1][0] == t[2][0] && t[1][2] == t[2][1] : t[0][0] == t[1][1] && t[0][2] == t[1][2];
}
bool fits(const std::array<PieceCorners, 4>& t, std::size_t i) {
  const PieceCorners& middle = t[3];
  if (i == 3) return true;
  if (i == 2) return t[2][0] == middle[2] && t[2][1] == middle[1];
  return i == 1 ? t[1][0] == middle[0] && t[1][2] == middle[1] : t[0][1] == middle[0] && t[0][2] == middle[2];
}

}  // namespace

void PieceTrees::clear() {
  tree_.clear();
  cut_.clear();
}

// A triangle with one or two long edges is cut into the same pieces whichever of its corners comes first.
std::size_t PieceTrees::turnsOf(const Tree& tree) const {
  const std::uint8_t cut = cut_[tree.firstCut];
  return cut == 0 || cut == 7 ? 1 : 3;
}

// Turn the last trees, from `i` down, so that they are what such a cut leaves. Where they were not cut from one
// triangle, the first two mostly tell.
template <std::size_t Count>
bool PieceTrees::turn(std::uint8_t cut, std::size_t i, std::array<Corners, Count>& piece,
                      std::array<std::size_t, Count>& by) {
  const Tree& tree = tree_[tree_.size() - 1 - i];
  const std::size_t turns = turnsOf(tree);
  for (by[i] = 0; by[i] < turns; ++by[i]) {
    piece[i] = turned(tree.corner, by[i]);
    if (!fits(piece, i)) continue;
    if (i > 0) {
      if (turn(cut, i - 1, piece, by)) return true;
      continue;
    }
    split_.clear();
    splitLong(MiddleOfPlaces{}, longEdges(cut), wholeOf(piece), split_);
    if (std::equal(piece.begin(), piece.end(), split_.begin())) return true;
  }
  return false;
}

// The last trees made one, where they are what such a cut leaves.
template <std::size_t Count>
bool PieceTrees::join(std::uint8_t cut) {
  if (tree_.size() < Count) return false;
  std::array<Corners, Count> piece;
  std::array<std::size_t, Count> by{};
  if (!turn(cut, Count - 1, piece, by)) return false;
  for (std::size_t i = 0; i < Count; ++i) {
    std::uint8_t& own = cut_[tree_[tree_.size() - 1 - i].firstCut];
    own = turnedCut(own, by[i]);
  }
  const std::size_t first = tree_.size() - Count;
  tree_.resize(first + 1);
  tree_[first].corner = wholeOf(piece);
  cut_.insert(cut_.begin() + tree_[first].firstCut, cut);
  return true;
}

void PieceTrees::add(const Corners& piece) {
  tree_.push_back({piece, static_cast<std::uint32_t>(cut_.size())});
  cut_.push_back(0);
  while (join<2>(1) || join<3>(3) || join<4>(7)) {
  }
}

}  // namespace relume
