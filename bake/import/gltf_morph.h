// SPDX-License-Identifier: MIT
// Morph targets, which editors call shape keys: a target has for each vertex what it adds to an attribute, and a mesh
// or the node that draws it has a weight for each target. glTF 2.0, section 3.7.2.2.
#pragma once

#include "bake/import/gltf_accessors.h"
#include "bake/import/gltf_document.h"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace relume {

// A weight for each target of a primitive, without the zeros at the end: empty = it is drawn as it is. Primitives with
// equal weights have equal shapes.
using MorphWeights = std::vector<float>;

// Weights of a node and its mesh, of which the node's go first, for so many targets: those beyond are left out, and
// those that are missing are 0.
MorphWeights trimWeights(const std::vector<double>& weights, std::size_t targets);

// Add what targets of `weights` say to POSITION, NORMAL and TANGENT of `attributes`, which then point into `bent`.
// `moved` counts vertices by targets that move them over all calls. invalidFile: values that are not as many as the
// base's, accessors that cannot be read, or far more vertices to move than the file has bytes.
Status bendAttributes(const GltfDocument& document, AccessorReader& reader, const tinygltf::Primitive& primitive,
                      const MorphWeights& weights, const std::string& where,
                      std::map<std::string, const AccessorValues*>& attributes,
                      std::map<std::string, AccessorValues>& bent, std::uint64_t& moved);

}  // namespace relume
