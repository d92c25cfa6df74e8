// SPDX-License-Identifier: MIT
// See gltf_morph.h. TEXCOORD_n and COLOR_n of targets are optional in glTF, and no part of a bake.
#include "bake/import/gltf_morph.h"

#include <algorithm>

namespace relume {
namespace {

// Vertices that targets may move for each byte of data, and at least: nodes and targets can share accessors.
constexpr std::uint64_t kMaxMovedPerByte = 64;
constexpr std::uint64_t kMinMoved = 1u << 24;

}  // namespace

MorphWeights trimWeights(const std::vector<double>& weights, std::size_t targets) {
  MorphWeights out;
  for (std::size_t i = 0; i < std::min(weights.size(), targets); ++i)
    out.push_back(static_cast<float>(weights[i]) + 0.0f);  // + 0: no -0
  while (!out.empty() && out.back() == 0.0f) out.pop_back();
  return out;
}

Status bendAttributes(const GltfDocument& document, AccessorReader& reader, const tinygltf::Primitive& primitive,
                      const MorphWeights& weights, const std::string& where,
                      std::map<std::string, const AccessorValues*>& attributes,
                      std::map<std::string, AccessorValues>& bent, std::uint64_t& moved) {
  bent.clear();
  for (std::size_t t = 0; t < weights.size(); ++t) {
    if (weights[t] == 0.0f) continue;
    for (const char* name : {"POSITION", "NORMAL", "TANGENT"}) {
      const auto target = primitive.targets[t].find(name);
      const auto base = attributes.find(name);
      if (target == primitive.targets[t].end() || base == attributes.end()) continue;
      const std::string at = where + "." + jsonPath("targets", static_cast<int>(t)) + "." + name;
      const auto deltas = reader.floats(target->second, 3, 3, at);  // a tangent's side is no part of them
      if (!deltas) return deltas.error();
      if ((*deltas)->count != base->second->count)
        return document.invalid(at, std::to_string((*deltas)->count) + " values, the mesh's " + name + " has " +
                                        std::to_string(base->second->count));
      moved += (*deltas)->count;
      if (moved > std::max(kMinMoved, kMaxMovedPerByte * document.dataBytes))
        return document.invalid(at, "with it, morph targets move " + std::to_string(moved) + " vertices in " +
                                        std::to_string(document.dataBytes) + " bytes");
      AccessorValues& sum = bent.try_emplace(name, *base->second).first->second;
      base->second = &sum;
      const auto components = static_cast<std::size_t>(sum.components);
      for (std::size_t v = 0; v < sum.count; ++v) {
        for (std::size_t i = 0; i < 3; ++i) sum.values[v * components + i] += weights[t] * (*deltas)->values[3 * v + i];
      }
    }
  }
  return done();
}

}  // namespace relume
