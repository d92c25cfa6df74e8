// SPDX-License-Identifier: MIT
// The links as both backends keep them (the GPU four to a unit, runtime/passes/pack_links.h). oct6 links are packed
// once more, into 5 bytes: nodes ascend within a row, so that 16 bits of a node do, with the indices in the row where
// the rest of it grows; and rows hand rounding errors of f from link to link, so that 8 bits of it do. All other kinds
// stay the bake's own arrays.
#pragma once

#include "relume/links.h"
#include "runtime/shared/link_rows.h"

#include <cstdint>
#include <memory_resource>
#include <vector>

namespace relume {

class LinkSet {
 public:
  // Links that passed checkBake(). memory: keeps what is packed again.
  LinkSet(const Links& links, std::pmr::memory_resource* memory);
  LinkSet(const LinkSet&) = delete;
  LinkSet& operator=(const LinkSet&) = delete;

  // The arrays; they live as long as this.
  LinkRows rows() const;
  std::uint32_t cacheCount() const { return static_cast<std::uint32_t>(rowOffset_.size()) - 1; }
  std::uint32_t count() const { return count_; }
  LinkKind kind() const { return links_.kind; }
  // Factor on link i's f by packing it again.
  float rounding(const Links& baked, std::uint32_t i) const;
  std::size_t bytes() const;

 private:
  void packRows();
  void packAgain();

  Links links_;                                // without what is packed again, and without rows
  std::pmr::vector<std::uint32_t> rowBase_;    // LinkRows has the same
  std::pmr::vector<std::uint16_t> rowOffset_;  // [Size caches + 1]
  std::uint32_t rowShift_ = 0, count_ = 0;
  std::pmr::vector<std::uint32_t> word_;     // node modulo 2^16, shape of oct6 in the high half
  std::pmr::vector<std::uint8_t> transfer_;  // f: the high 8 bits of a head's 12, zero or at least 16
  std::pmr::vector<std::uint8_t> nodeStep_;  // [Size caches * steps_] LinkRows has the same
  std::uint32_t steps_ = 0;
};

}  // namespace relume
