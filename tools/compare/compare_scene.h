// SPDX-License-Identifier: MIT
// What happened to the parts of a scene between two bakes, or between a bake and the scene of today: by name, from the
// hashes that a bake keeps (include/relume/bake_data.h). For `relume compare` and `relume status`.
#pragma once

#include "relume/bake_data.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

namespace relume {

// By what parts of two scenes answer to each other: names of node and mesh; of several such (GPU instances) the k-th.
using PartKey = std::tuple<std::string, std::string, std::size_t>;
std::vector<PartKey> partKeys(std::span<const BakedInstance> parts);  // [Size parts]

// Which node each part is of. Nodes may share a name: those of one mesh are told apart by their order, so that all
// primitives of a node are one. A GPU instance counts as a node.
struct PartNodes {
  std::vector<std::uint32_t> ofPart;  // [Size parts] index into names and texts
  std::vector<std::string> names;
  std::vector<std::string> texts;  // the name; "crate (2 of 3)" where several have it
};
PartNodes nodesOfParts(std::span<const BakedInstance> parts);

// Whether a node has no name of its own but the importer's number, which shifts when another is put before it.
bool isNumbered(const std::string& node);

// Which part of `before` each part of `now` is: the one with its key; of those left over the first that has its mesh
// where it has it, so that a node or a mesh may get a name that was not there. Numbered nodes go by place first, then
// by key. Nothing for a part that is new. [Size now]
std::vector<std::optional<std::size_t>> answersOf(std::span<const BakedInstance> before,
                                                  std::span<const BakedInstance> now);

struct PartChange {
  enum class Kind { added, removed, renamed, moved, reshaped, rematerialled, settings };
  Kind kind;
  std::string node, mesh;
  std::string materialBefore, materialNow;  // of kind rematerialled; the same name = its values or texels changed
  std::string nodeBefore{}, meshBefore{};   // of kind renamed
};

const char* toString(PartChange::Kind kind);
std::string toString(const PartChange& change);  // node "Pillar_03" moved

// In the order of `now`, then what was removed. Parts are the same by answersOf(). One part may change in several ways.
std::vector<PartChange> compareParts(std::span<const BakedInstance> before, std::span<const BakedInstance> now);

}  // namespace relume
