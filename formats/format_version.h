// SPDX-License-Identifier: MIT
// Which version of the format a bake is written as: the least one that has all that the bake has.
#pragma once

#include "formats/chunks.h"
#include "relume/bake_data.h"

#include <cstdint>

namespace relume {

inline std::uint32_t formatVersionOf(const Bake& bake) {
  if (!bake.caches.lightmap.sight.empty()) return kBakeFormatVersion;
  if (!bake.certificate.empty()) return kCertificateFormatVersion;
  return bake.emitters.materials.empty() ? kOldestBakeFormatVersion : kEmitterFormatVersion;
}

// Of its packed form.
inline std::uint32_t packedVersionOf(const Bake& bake) {
  if (!bake.caches.lightmap.sight.empty()) return kPackedFormatVersion;
  return bake.certificate.empty() ? kOldestPackedFormatVersion : kPackedCertificateFormatVersion;
}

}  // namespace relume
