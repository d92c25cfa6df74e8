// SPDX-License-Identifier: MIT
// See gltf_morph.h. TEXCOORD_n and COLOR_n of targets are optional in glTF, and no part of a bake.
#include "bake/import/gltf_morph.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <string_view>

namespace relume {
namespace {

using nlohmann::json;

// Vertices that targets may move for each byte of data, and at least: nodes and targets can share accessors.
constexpr std::uint64_t kMaxMovedPerByte = 64;
constexpr std::uint64_t kMinMoved = 1u << 24;

// The element that a pointer such as "/nodes/3/weights/0" moves the weights of; -1 = another, or none.
int weightsOwner(std::string_view pointer, std::string_view list) {
  if (!pointer.starts_with(list)) return -1;
  pointer.remove_prefix(list.size());
  int index = -1;
  const auto read = std::from_chars(pointer.data(), pointer.data() + pointer.size(), index);
  pointer.remove_prefix(static_cast<std::size_t>(read.ptr - pointer.data()));
  const bool weights = pointer == "/weights" || pointer.starts_with("/weights/");
  return read.ec == std::errc() && index >= 0 && weights ? index : -1;
}

void addChannel(const json& channel, AnimatedWeights& out) {
  const json::json_pointer path("/target/path"), node("/target/node"),
      pointer("/target/extensions/KHR_animation_pointer/pointer");
  if (!channel.is_object()) return;
  if (channel.contains(path) && channel[path] == "weights" && channel.contains(node) &&
      channel[node].is_number_integer())
    out.nodes.insert(channel[node].get<int>());
  if (!channel.contains(pointer) || !channel[pointer].is_string()) return;
  const auto& text = channel[pointer].get_ref<const std::string&>();
  if (const int owner = weightsOwner(text, "/nodes/"); owner >= 0) out.nodes.insert(owner);
  if (const int owner = weightsOwner(text, "/meshes/"); owner >= 0) out.meshes.insert(owner);
}

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

AnimatedWeights findAnimatedWeights(const json& root) {
  AnimatedWeights out;
  const auto animations = root.find("animations");
  if (animations == root.end() || !animations->is_array()) return out;
  for (const json& animation : *animations) {
    if (!animation.is_object()) continue;
    const auto channels = animation.find("channels");
    if (channels == animation.end() || !channels->is_array()) continue;
    for (const json& channel : *channels) addChannel(channel, out);
  }
  return out;
}

}  // namespace relume
