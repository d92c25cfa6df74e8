// SPDX-License-Identifier: MIT
// See gltf_animations.h. Targets are glTF 2.0's own (section 3.11) and the pointers of KHR_animation_pointer.
#include "bake/import/gltf_animations.h"

#include <nlohmann/json.hpp>

#include <charconv>
#include <string_view>

namespace relume {
namespace {

using nlohmann::json;

// The element of a list that a pointer such as "/nodes/3/weights/0" leads into; the pointer loses both. -1 = another,
// or none.
int takeElement(std::string_view& pointer, std::string_view list) {
  if (!pointer.starts_with(list)) return -1;
  std::string_view rest = pointer.substr(list.size());
  int index = -1;
  const auto read = std::from_chars(rest.data(), rest.data() + rest.size(), index);
  rest.remove_prefix(static_cast<std::size_t>(read.ptr - rest.data()));
  if (read.ec != std::errc() || index < 0) return -1;
  pointer = rest;
  return index;
}

bool isPlace(std::string_view path) { return path == "translation" || path == "rotation" || path == "scale"; }

void addPointer(std::string_view pointer, Animated& out) {
  const int node = takeElement(pointer, "/nodes/"), mesh = node >= 0 ? -1 : takeElement(pointer, "/meshes/");
  if (pointer == "/weights" || pointer.starts_with("/weights/")) {
    if (node >= 0) out.weightsOfNodes.insert(node);
    if (mesh >= 0) out.weightsOfMeshes.insert(mesh);
  }
  if (node >= 0 && pointer == "/extensions/KHR_node_visibility/visible") out.visibilityOfNodes.insert(node);
  if (node >= 0 && pointer.starts_with('/') && isPlace(pointer.substr(1))) out.placesOfNodes.insert(node);
}

void addChannel(const json& channel, Animated& out) {
  const json::json_pointer path("/target/path"), node("/target/node"),
      pointer("/target/extensions/KHR_animation_pointer/pointer");
  if (!channel.is_object()) return;
  if (channel.contains(path) && channel[path].is_string() && channel.contains(node) &&
      channel[node].is_number_integer()) {
    const auto& what = channel[path].get_ref<const std::string&>();
    if (what == "weights") out.weightsOfNodes.insert(channel[node].get<int>());
    if (isPlace(what)) out.placesOfNodes.insert(channel[node].get<int>());
  }
  if (channel.contains(pointer) && channel[pointer].is_string())
    addPointer(channel[pointer].get_ref<const std::string&>(), out);
}

}  // namespace

Animated findAnimated(const json& root) {
  Animated out;
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
