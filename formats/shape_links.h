// SPDX-License-Identifier: MIT
// Chooses the directions and cones of oct6 links so that a row as a whole, not each link, is as right as 16 bits a link
// allow. A link of 6 + 6 + 4 bits is off by 5 % of its coefficients, and four bands of a cone are not those of what is
// seen through it, whatever the bits (docs/notes/links.md). The error of a link is diffused to the next in the row,
// which mostly lies beside it and sends similar light, as in dithering of images: the errors of a row's links then
// cancel, and its light comes out nearer to the truth than that of 12-byte cones.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace relume {

class LinkShaper {
 public:
  static constexpr int kBands = 4, kCoefficients = 16;

  void beginRow() { error_ = {}; }
  // Shape (packShape6()) of the next link of the row, whose coefficients should be c and whose transfer is read as f.
  // Only the directions of c beyond coefficient 0 matter; the error is kept for the next link.
  std::uint32_t choose(std::span<const float> c, float f);

 private:
  // Coefficients of bands 1, 2, 3, filled up with zeros to one, two and two fours.
  typedef float Four __attribute__((vector_size(16)));
  using Padded = std::array<Four, 5>;
  static Padded pad(std::span<const float> c);
  struct Shapes;
  static const Shapes& shapes();

  Padded error_{};
};

}  // namespace relume
