// SPDX-License-Identifier: MIT
// Finds which triangles of a list others were cut into at the middles of their edges (split_edges.h), as hosts cut what
// they hand over: a triangle and three bits a cut then stand for its pieces and their vertices, to the bit.
#pragma once

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace relume {

inline constexpr int kCutBits = 3;  // of a cut: which edges are long, the first one lowest; 0 = not cut

inline std::array<bool, 3> longEdges(std::uint32_t cut) { return {(cut & 1u) != 0, (cut & 2u) != 0, (cut & 4u) != 0}; }

// Where what is cut gets its corners from.
struct MiddleOfPlaces {
  glm::vec3 middle(const glm::vec3& a, const glm::vec3& b) const { return 0.5f * (a + b); }
};

class PieceTrees {
 public:
  using Corners = std::array<glm::vec3, 3>;
  struct Tree {
    Corners corner{};
    std::uint32_t firstCut = 0;
  };

  void clear();
  // The next piece. Those of one triangle follow one another as if each cut pushed its pieces onto a stack, in
  // splitLong()'s order, and the last one were taken.
  void add(const Corners& piece);

  const std::vector<Tree>& trees() const { return tree_; }
  // Of each tree one after the other, of a tree depth first: each triangle's, and 0 of each piece.
  const std::vector<std::uint8_t>& cuts() const { return cut_; }

 private:
  template <std::size_t Count>
  bool turn(std::uint8_t cut, std::size_t i, std::array<Corners, Count>& piece, std::array<std::size_t, Count>& by);
  template <std::size_t Count>
  bool join(std::uint8_t cut);
  std::size_t turnsOf(const Tree& tree) const;

  std::vector<Tree> tree_;
  std::vector<std::uint8_t> cut_;
  std::vector<Corners> split_;
};

}  // namespace relume
