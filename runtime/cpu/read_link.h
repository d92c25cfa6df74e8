// SPDX-License-Identifier: MIT
// Node and transfer of one link of a row at a time, whatever the way of storing it, for the few links that are looked
// at by themselves.
#pragma once

#include "runtime/shared/link_rows.h"

#include <cstdint>

namespace relume::cpu {

// Reads the links of one row, ascending.
class RowReader {
 public:
  RowReader(const LinkRows& rows, std::uint32_t cache);

  // Node of a link [rowBegin(rows, cache) .. rowBegin(rows, cache + 1)), at least that of the call before.
  std::uint32_t node(std::uint32_t link);
  // f of a link: the coefficient 0 that a radiosity of 1 from it adds to its cache.
  float transfer(std::uint32_t link) const;

 private:
  const LinkRows& rows_;
  std::uint32_t next_;  // link of the next step
  const std::uint8_t *step_ = nullptr, *stepEnd_ = nullptr;
  std::uint32_t high_ = 0;
};

}  // namespace relume::cpu
