// SPDX-License-Identifier: MIT
// Accessors to numbers, every offset, stride and count checked first. Sparse accessors, normalised and plain integers.
#pragma once

#include "bake/import/gltf_document.h"

#include <cstdint>
#include <map>
#include <string>
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

  // Numbers of an accessor with minComponents..maxComponents components; owned by the reader, read once.
  Result<const AccessorValues*> floats(int accessor, int minComponents, int maxComponents, const std::string& where);
  // Unsigned integers of a scalar accessor.
  Result<std::vector<std::uint32_t>> indices(int accessor, const std::string& where) const;

 private:
  const GltfDocument& document_;
  std::map<int, AccessorValues> cache_;
};

// Every buffer view and accessor of the document, used or not, against the bytes there are.
Status checkRanges(const GltfDocument& document);

}  // namespace relume
