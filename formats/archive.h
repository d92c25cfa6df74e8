// SPDX-License-Identifier: MIT
// The parts of a bake that are no plain arrays (scalars, names, provenance) to and from bytes. cereal does the work,
// behind archives over memory that refuse sizes beyond the bytes that are left; archive.cpp is the only file that
// includes it. formats/README.md documents the bytes.
#pragma once

#include "relume/bake_data.h"
#include "relume/result.h"

#include <cstddef>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume {

// The single numbers of a bake.
struct BakeScalars {
  float surfelAreaEach = 0.0f;  // [m²]
  glm::uvec3 gridResolution{0};
  glm::vec3 gridOriginWorld{0.0f}, gridSpacing{0.0f};   // [m]
  std::uint32_t lightmapWidth = 0, lightmapHeight = 0;  // [texel]
  std::uint32_t linkKind = 0, linkBands = 0;
};

// Same value, same bytes. memory: there was not enough.
Result<std::vector<std::byte>> saveArchive(const BakeScalars& value);
Result<std::vector<std::byte>> saveArchive(std::span<const BakedInstance> value);
Result<std::vector<std::byte>> saveArchive(std::span<const DrivableMaterial> value);
Result<std::vector<std::byte>> saveArchive(const Provenance& value);

// invalidFile: truncated, a size beyond the bytes that are left, or bytes left over; unsupported: a class version of
// another writer; memory. Allocates at most a small multiple of bytes.size(); lists from `memory` [not null], which
// must outlive the array.
Status loadArchive(std::span<const std::byte> bytes, BakeScalars& value);
Status loadArchive(std::span<const std::byte> bytes, Array<BakedInstance>& value, std::pmr::memory_resource* memory);
Status loadArchive(std::span<const std::byte> bytes, Array<DrivableMaterial>& value, std::pmr::memory_resource* memory);
Status loadArchive(std::span<const std::byte> bytes, Provenance& value);

}  // namespace relume
