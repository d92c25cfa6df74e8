// SPDX-License-Identifier: MIT
// Accessors to numbers, every offset, stride and count checked first. Sparse accessors, normalised and plain integers.
#pragma once

#include "bake/import/gltf_document.h"

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

namespace relume {

struct AccessorValues {
  std::size_t count = 0;
  int components = 0;
  std::vector<float> values;  // [Size count components]
};

class AccessorReader {
 public:
  explicit AccessorReader(const GltfDocument& document) : document_(document) {}

  // Numbers of an accessor with minComponents..maxComponents components; owned by the reader, read once. invalidFile:
  // also where accessors over the same bytes have far more numbers than there are bytes.
  Result<const AccessorValues*> floats(int accessor, int minComponents, int maxComponents, const std::string& where);
  // Unsigned integers of a scalar accessor.
  Result<std::vector<std::uint32_t>> indices(int accessor, const std::string& where) const;

 private:
  const GltfDocument& document_;
  // What accessors must share to share their numbers: view, offset, count, component type, type, whether normalised;
  // and of sparse ones, the accessor.
  using Key = std::tuple<int, std::size_t, std::size_t, int, int, bool, int>;
  std::map<Key, AccessorValues> cache_;
  std::uint64_t numbers_ = 0;  // of all in cache_
};

// Every buffer view and accessor of the document, used or not, against the bytes there are.
Status checkRanges(const GltfDocument& document);

}  // namespace relume
