// SPDX-License-Identifier: MIT
// One link of a row at a time, whatever the way of storing it: what light_caches' kernels read, for the few links that
// are looked at by themselves.
#pragma once

#include "formats/sh.h"
#include "runtime/shared/link_rows.h"

#include <cstdint>
#include <span>

namespace relume::cpu {

// Reads the links of one row, ascending.
class RowReader {
 public:
  RowReader(const LinkRows& rows, std::uint32_t cache);

  // Node of a link [rowBegin[cache] .. rowBegin[cache + 1]), at least that of the call before.
  std::uint32_t node(std::uint32_t link);
  // What coefficients of radiance a radiosity of 1 from that link adds to its cache, of so many bands.
  // [Size c >= bands²]
  void coefficients(std::uint32_t link, int bands, std::span<float> c) const;

 private:
  const LinkRows& rows_;
  std::uint32_t begin_;
  const std::uint16_t *step_ = nullptr, *stepEnd_ = nullptr;
  std::uint32_t high_ = 0;
};

}  // namespace relume::cpu
