// SPDX-License-Identifier: MIT
// Splatting (RCS 4.1): which records each part of the image reads, and Eq. (1) over them. The image is cut into tiles;
// a tile owns its pixels and sums its records in their order, so that sums do not depend on threads.
#pragma once

#include "bake/preview/gather.h"
#include "bake/preview/record.h"
#include "bake/preview/weights.h"
#include "bake/scene/camera_rays.h"
#include "relume/bake/context.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Eq. (1): E(p) = sum of w_k E'_k / sum of w_k.
struct Splat {
  glm::vec3 reflected{0.0f}, sky{0.0f};  // [W/m²]
  float weight = 0.0f;                   // sum of w_k; 0: no record reaches here, and there is no light
};

class RecordTiles {
 public:
  static constexpr std::uint32_t kSide = 8;  // [pixel]

  // Keeps `records` by reference.
  RecordTiles(const CameraRays& camera, std::span<const Record> records, const Interpolation& options);

  // What a receiver in a pixel reads.
  Splat splat(std::uint32_t x, std::uint32_t y, const PixelReceiver& receiver) const;
  // Add what a receiver reads to sums that are not yet divided: sum of w_k E'_k, sum of w_k.
  void add(std::uint32_t x, std::uint32_t y, const PixelReceiver& receiver, Splat& sums) const;
  // What one record says of a receiver.
  struct Part {
    std::uint32_t record;
    float weight;              // w_k > 0
    glm::vec3 reflected, sky;  // [W/m²] E'_k
  };
  // How much of one record a receiver reads, and from where.
  struct Weighed {
    std::uint32_t record;
    float weight;      // w_k > 0
    glm::vec3 offset;  // [m] the receiver less p_k, as far as gradients count
  };
  // The records that a receiver reads, in their order. `list` is replaced.
  void weigh(std::uint32_t x, std::uint32_t y, const PixelReceiver& receiver, std::vector<Weighed>& list) const;
  // What each of them says, one by one, in the order of the records. `parts` is replaced.
  void split(std::uint32_t x, std::uint32_t y, const PixelReceiver& receiver, std::vector<Part>& parts) const;

 private:
  std::span<const Record> records_;
  Interpolation options_;
  std::uint32_t columns_;
  template <class Visit>
  void visit(std::uint32_t x, std::uint32_t y, const PixelReceiver& receiver, const Visit& each) const;
  Part partOf(const Weighed& weighed, const PixelReceiver& receiver) const;

  std::vector<float> reach_;          // [m] [Size records]
  std::vector<std::uint32_t> begin_;  // of a tile's records [Size tiles + 1]
  std::vector<std::uint32_t> list_;   // records, tile by tile, ascending
};

// Set covered[pixel] = 1 where one of the records has a weight at the pixel's receiver. [Size receivers = covered]
void markCovered(const CameraRays& camera, std::span<const Record> records, const Interpolation& options,
                 std::span<const PixelReceiver> receivers, std::span<std::uint8_t> covered, Context& context);

}  // namespace relume
