// SPDX-License-Identifier: MIT
// See place_meshes.h.
#include "bake/export/place_meshes.h"

#include "bake/export/vertex_data.h"
#include "bake/import/gltf_accessors.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relume {
namespace {

using nlohmann::json;

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

// What one node draws: for each GPU instance that is on the light map, its instances of the scene, one a primitive.
using NodeParts = std::map<std::uint32_t, std::vector<std::uint32_t>>;

bool isInstanced(const json& node) { return node.contains("extensions") && node["extensions"].contains(kInstancing); }

class Placer {
 public:
  Placer(LevelDocument& document, const Scene& scene, const LightmapPrimitives& primitives, TexcoordSets sets)
      : document_(document),
        scene_(scene),
        primitives_(primitives),
        sets_(sets),
        reader_(document.source()),
        meshes_(document.root.value("meshes", json::array())) {}

  Result<PlacedMeshes> run() {
    std::map<std::uint32_t, NodeParts> nodes;
    for (const auto& [i, primitive] : primitives_.ofInstance) {
      const Instance& instance = scene_.instances[i];
      nodes[instance.nodeIndex][instance.gpuInstance].push_back(i);
    }
    // Meshes that are still drawn as they were.
    json& root = document_.root;
    for (std::uint32_t n = 0; root.contains("nodes") && n < root["nodes"].size(); ++n) {
      if (!nodes.contains(n) && root["nodes"][n].contains("mesh")) taken_.insert(root["nodes"][n]["mesh"].get<int>());
    }
    for (const auto& [n, parts] : nodes) {
      if (isInstanced(root["nodes"][n])) {
        const Result<std::size_t> copies = countCopies(n);
        if (!copies) return copies.error();
        if (parts.size() < *copies) taken_.insert(root["nodes"][n]["mesh"].get<int>());
      }
    }
    for (const auto& [n, parts] : nodes) {
      json& node = root["nodes"][n];
      if (isInstanced(node)) {
        if (const Status status = unfoldInstances(n, parts); !status) return status.error();
      } else {
        node["mesh"] = makeMesh(node["mesh"].get<int>(), parts.begin()->second);
      }
    }
    const json& all = root.contains("nodes") ? root["nodes"] : none_;
    if (std::none_of(all.begin(), all.end(), isInstanced)) forgetExtension(root, kInstancing);
    animatePointers();
    return placed_;
  }

 private:
  // The mesh with the primitives of these instances; returns its index.
  int makeMesh(int source, const std::vector<std::uint32_t>& instances) {
    json mesh = meshes_[static_cast<std::size_t>(source)];
    bool back = false;
    for (const std::uint32_t i : instances) {
      const json& primitive = primitives_.ofInstance.at(i);
      back |= primitive["attributes"].contains("TEXCOORD_" + std::to_string(sets_.back()));
      mesh["primitives"][scene_.instances[i].primitive] = primitive;
    }
    nameSets(mesh, sets_, back);
    json& all = document_.root["meshes"];
    if (taken_.insert(source).second) {
      all[static_cast<std::size_t>(source)] = std::move(mesh);
      return source;
    }
    ++placed_.meshesAdded;
    copied_[source].push_back(static_cast<int>(all.size()));
    all.push_back(std::move(mesh));
    return static_cast<int>(all.size()) - 1;
  }

  static std::string attributePath(std::uint32_t node, const std::string& name) {
    return jsonPath("nodes", static_cast<int>(node)) + ".extensions." + kInstancing + "." + name;
  }

  Result<const AccessorValues*> instanceValues(std::uint32_t node, const std::string& name, const json& accessor) {
    return reader_.floats(accessor.get<int>(), 1, 4, attributePath(node, name));
  }

  Result<std::size_t> countCopies(std::uint32_t node) {
    std::size_t count = 0;
    for (const auto& [name, accessor] :
         document_.root["nodes"][node]["extensions"][kInstancing]["attributes"].items()) {
      const auto values = instanceValues(node, name, accessor);
      if (!values) return values.error();
      count = std::max(count, (*values)->count);
    }
    return count;
  }

  // A node for each GPU instance, in place of the extension.
  Status unfoldInstances(std::uint32_t n, const NodeParts& parts) {
    json& root = document_.root;
    const json node = root["nodes"][n];
    const int source = node["mesh"].get<int>();
    const Result<std::size_t> count = countCopies(n);
    if (!count) return count.error();
    std::vector<json> copies(*count, json::object());
    for (const auto& [name, accessor] : node["extensions"][kInstancing]["attributes"].items()) {
      const auto values = instanceValues(n, name, accessor);
      if (!values) return values.error();
      if (isTransform(name)) {
        const auto components = static_cast<std::size_t>((*values)->components);
        for (std::size_t i = 0; i < (*values)->count; ++i)
          setTransform(name, std::span(&(*values)->values[i * components], components), copies[i]);
        continue;
      }
      const Result<std::vector<json>> said = saidOfInstances(n, name, accessor.get<int>(), **values);
      if (!said) return said.error();
      for (std::size_t i = 0; i < said->size(); ++i) copies[i]["extras"]["relume"]["gpuInstance"][name] = (*said)[i];
    }
    json children = json::array();
    for (std::size_t i = 0; i < copies.size(); ++i) {
      const auto part = parts.find(static_cast<std::uint32_t>(i));
      if (node.contains("name")) copies[i]["name"] = node["name"].get<std::string>() + "#" + std::to_string(i);
      if (node.contains("weights")) copies[i]["weights"] = node["weights"];
      copies[i]["mesh"] = part == parts.end() ? source : makeMesh(source, part->second);
      children.push_back(root["nodes"].size());
      root["nodes"].push_back(std::move(copies[i]));
      ++placed_.nodesAdded;
    }
    animateWeights(n, children);
    unfolded_[static_cast<int>(n)] = children;
    json& parent = root["nodes"][n];
    for (const json& child : parent.value("children", json::array())) children.push_back(child);
    parent["children"] = std::move(children);
    parent.erase("mesh");
    parent.erase("weights");
    parent["extensions"].erase(kInstancing);
    if (parent["extensions"].empty()) parent.erase("extensions");
    return done();
  }

  static bool isTransform(const std::string& name) {
    return name == "TRANSLATION" || name == "ROTATION" || name == "SCALE";
  }

  // An attribute that places nothing, for each GPU instance.
  Result<std::vector<json>> saidOfInstances(std::uint32_t node, const std::string& name, int accessor,
                                            const AccessorValues& values) {
    std::vector<json> said;
    const json& described = document_.root["accessors"][static_cast<std::size_t>(accessor)];
    if (described.value("normalized", false)) {
      const auto components = static_cast<std::size_t>(values.components);
      for (std::size_t i = 0; i < values.count; ++i) {
        const std::span numbers(&values.values[i * components], components);
        said.push_back(components == 1 ? json(numbers.front()) : json(std::vector(numbers.begin(), numbers.end())));
      }
      return said;
    }
    const Result<RawElements> elements = readRaw(document_, accessor, attributePath(node, name));
    if (!elements) return elements.error();
    for (std::size_t i = 0; i < elements->count(); ++i)
      said.push_back(numbersOf(described, std::span(elements->bytes).subspan(i * elements->size, elements->size)));
    return said;
  }

  // Write an attribute of a GPU instance to its node as its translation, rotation or scale.
  static void setTransform(const std::string& name, std::span<const float> values, json& node) {
    std::vector<double> numbers(values.begin(), values.end());
    if (name == "ROTATION" && numbers.size() == 4) {
      double squared = 0.0;
      for (const double v : numbers) squared += v * v;
      const double length = std::sqrt(squared);
      if (length > 0.0 && std::isfinite(length)) {
        for (double& v : numbers) v /= length;
      } else {
        numbers = {0.0, 0.0, 0.0, 1.0};
      }
      node["rotation"] = numbers;
    } else if (name == "TRANSLATION") {
      node["translation"] = numbers;
    } else {
      node["scale"] = numbers;
    }
  }

  // Morph weights that move on the node move on each of its instances.
  void animateWeights(std::uint32_t node, const json& children) {
    if (!document_.root.contains("animations")) return;
    for (json& animation : document_.root["animations"]) {
      json channels = json::array();
      for (const json& channel : animation.at("channels")) {
        const json& target = channel.at("target");
        const bool weights =
            target.value("path", "") == "weights" && target.value("node", -1) == static_cast<int>(node);
        if (!weights) channels.push_back(channel);
        for (std::size_t i = 0; weights && i < children.size(); ++i) {
          channels.push_back(channel);
          channels.back()["target"]["node"] = children[i];
        }
      }
      animation["channels"] = std::move(channels);
    }
  }

  // KHR_animation_pointer names meshes and nodes in text: what moves a mesh moves its copies too, and what moves the
  // morph weights of GPU instances those of their nodes.
  void animatePointers() {
    if (!document_.root.contains("animations")) return;
    const json::json_pointer path("/target/extensions/KHR_animation_pointer/pointer");
    for (json& animation : document_.root["animations"]) {
      json channels = json::array();
      for (const json& channel : animation.at("channels")) {
        const std::string pointer =
            channel.contains(path) && channel[path].is_string() ? channel[path].get<std::string>() : "";
        const auto answers = pointersFor(pointer);
        for (const std::string& answer : answers) {
          channels.push_back(channel);
          channels.back()[path] = answer;
        }
        if (answers.empty()) channels.push_back(channel);
      }
      animation["channels"] = std::move(channels);
    }
  }

  // What an animation's pointer must move now; empty = what it did.
  std::vector<std::string> pointersFor(const std::string& pointer) const {
    std::vector<std::string> out;
    const auto number = [&](std::string_view list) -> std::optional<std::pair<int, std::string>> {
      if (!pointer.starts_with(list)) return std::nullopt;
      const std::size_t end = std::min(pointer.find('/', list.size()), pointer.size());
      int value = 0;
      const auto read = std::from_chars(pointer.data() + list.size(), pointer.data() + end, value);
      if (read.ec != std::errc() || read.ptr != pointer.data() + end) return std::nullopt;
      return std::pair(value, pointer.substr(end));
    };
    if (const auto mesh = number("/meshes/"); mesh && copied_.contains(mesh->first)) {
      out.push_back(pointer);
      for (const int copy : copied_.at(mesh->first)) out.push_back("/meshes/" + std::to_string(copy) + mesh->second);
    }
    const auto node = number("/nodes/");
    if (node && node->second.starts_with("/weights") && unfolded_.contains(node->first)) {
      for (const json& child : unfolded_.at(node->first))
        out.push_back("/nodes/" + std::to_string(child.get<int>()) + node->second);
    }
    return out;
  }

  LevelDocument& document_;
  const Scene& scene_;
  const LightmapPrimitives& primitives_;
  TexcoordSets sets_;
  AccessorReader reader_;
  const json meshes_;                       // as they were
  std::set<int> taken_;                     // meshes that are drawn as they were, or already replaced
  std::map<int, std::vector<int>> copied_;  // by the mesh, its copies
  std::map<int, json> unfolded_;            // by the node, those of its GPU instances
  const json none_ = json::array();
  PlacedMeshes placed_;
};

}  // namespace

void forgetExtension(json& root, const std::string& name) {
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
    if (!root.contains(list)) continue;
    json kept = json::array();
    for (const json& used : root[list]) {
      if (used != name) kept.push_back(used);
    }
    if (kept.empty())
      root.erase(list);
    else
      root[list] = std::move(kept);
  }
}

Result<PlacedMeshes> placeMeshes(LevelDocument& document, const Scene& scene, const LightmapPrimitives& primitives,
                                 TexcoordSets sets) {
  return Placer(document, scene, primitives, sets).run();
}

}  // namespace relume
