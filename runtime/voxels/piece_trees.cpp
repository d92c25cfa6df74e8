// SPDX-License-Identifier: MIT
// See piece_trees.h.
#include "runtime/voxels/piece_trees.h"

#include "runtime/voxels/split_edges.h"

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

// What two of them share, which most that are not of one triangle do not.
bool mayJoin(const std::array<PieceCorners, 2>& t) { return t[0][1] == t[1][0] && t[0][2] == t[1][2]; }
bool mayJoin(const std::array<PieceCorners, 3>& t) { return t[0][0] == t[1][1] && t[0][2] == t[1][2]; }
bool mayJoin(const std::array<PieceCorners, 4>& t) { return t[3][0] == t[0][1] && t[3][1] == t[1][2]; }

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

// The last trees made one, where they are what such a cut leaves.
template <std::size_t Count>
bool PieceTrees::join(std::uint8_t cut) {
  if (tree_.size() < Count) return false;
  std::array<PieceCorners, Count> piece;
  std::array<std::size_t, Count> turn{}, turns{};
  std::size_t all = 1;
  for (std::size_t i = 0; i < Count; ++i) {
    turns[i] = turnsOf(tree_[tree_.size() - 1 - i]);
    all *= turns[i];
  }
  for (std::size_t tried = 0; tried < all; ++tried) {
    std::size_t rest = tried;
    for (std::size_t i = 0; i < Count; ++i, rest /= turns[i - 1]) {
      turn[i] = rest % turns[i];
      piece[i] = turned(tree_[tree_.size() - 1 - i].corner, turn[i]);
    }
    if (!mayJoin(piece)) continue;
    const PieceCorners whole = wholeOf(piece);
    split_.clear();
    splitLong(MiddleOfPlaces{}, longEdges(cut), whole, split_);
    bool isSame = true;
    for (std::size_t i = 0; i < Count && isSame; ++i) isSame = split_[i] == piece[i];
    if (!isSame) continue;
    for (std::size_t i = 0; i < Count; ++i) {
      std::uint8_t& own = cut_[tree_[tree_.size() - 1 - i].firstCut];
      own = turnedCut(own, turn[i]);
    }
    const std::size_t first = tree_.size() - Count;
    tree_.resize(first + 1);
    tree_[first].corner = whole;
    cut_.insert(cut_.begin() + tree_[first].firstCut, cut);
    return true;
  }
  return false;
}

void PieceTrees::add(const Corners& piece) {
  tree_.push_back({piece, static_cast<std::uint32_t>(cut_.size())});
  cut_.push_back(0);
  while (join<2>(1) || join<3>(3) || join<4>(7)) {
  }
}

}  // namespace relume
