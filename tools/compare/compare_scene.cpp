// SPDX-License-Identifier: MIT
// See compare_scene.h.
#include "tools/compare/compare_scene.h"

#include <map>
#include <set>
#include <string>
#include <utility>

namespace relume {
namespace {

void compareOne(const BakedInstance& before, const BakedInstance& now, std::vector<PartChange>& changes) {
  if (before.contentHash == now.contentHash && before.material == now.material) return;
  const std::size_t found = changes.size();
  const auto add = [&](PartChange::Kind kind) {
    changes.push_back({kind, now.node, now.mesh, before.material, now.material});
  };
  if (before.transformHash != now.transformHash) add(PartChange::Kind::moved);
  if (before.geometryHash != now.geometryHash) add(PartChange::Kind::reshaped);
  if (before.materialHash != now.materialHash || before.material != now.material) add(PartChange::Kind::rematerialled);
  if (changes.size() == found) add(PartChange::Kind::settings);
}

// What the importer calls the primitives of a mesh of several: "mesh#0", "mesh#1".
std::string withoutPrimitive(const std::string& mesh) {
  const std::size_t end = mesh.find_last_not_of("0123456789");
  return end != std::string::npos && end + 1 < mesh.size() && mesh[end] == '#' ? mesh.substr(0, end) : mesh;
}

std::set<std::string> namesOf(std::span<const BakedInstance> parts) {
  std::set<std::string> nodes;
  for (const BakedInstance& part : parts) nodes.insert(part.node);
  return nodes;
}

}  // namespace

std::vector<PartKey> partKeys(std::span<const BakedInstance> parts) {
  std::map<std::pair<std::string, std::string>, std::size_t> seen;
  std::vector<PartKey> keys;
  for (const BakedInstance& part : parts) keys.emplace_back(part.node, part.mesh, seen[{part.node, part.mesh}]++);
  return keys;
}

PartNodes nodesOfParts(std::span<const BakedInstance> parts) {
  PartNodes nodes;
  std::map<std::tuple<std::string, std::string, std::size_t, std::uint64_t>, std::uint32_t> found;
  std::map<std::string, std::uint32_t> count;
  std::vector<std::uint32_t> number;  // [Size names] among those of the name, from 1
  for (const auto& [node, mesh, k] : partKeys(parts)) {
    const std::uint64_t place = parts[nodes.ofPart.size()].transformHash;
    const auto [at, added] =
        found.emplace(std::tuple(node, withoutPrimitive(mesh), k, place), static_cast<std::uint32_t>(found.size()));
    nodes.ofPart.push_back(at->second);
    if (!added) continue;
    nodes.names.push_back(node);
    number.push_back(++count[node]);
  }
  for (std::size_t i = 0; i < nodes.names.size(); ++i) {
    const std::string& name = nodes.names[i];
    const std::string which = " (" + std::to_string(number[i]) + " of " + std::to_string(count[name]) + ")";
    nodes.texts.push_back(count[name] > 1 ? name + which : name);
  }
  return nodes;
}

bool isNumbered(const std::string& node) { return node.starts_with("unnamed node "); }

std::vector<std::optional<std::size_t>> answersOf(std::span<const BakedInstance> before,
                                                  std::span<const BakedInstance> now) {
  const std::vector<PartKey> keysBefore = partKeys(before), keysNow = partKeys(now);
  std::map<PartKey, std::size_t> byKey;
  for (std::size_t i = 0; i < before.size(); ++i) byKey.emplace(keysBefore[i], i);
  std::vector<std::optional<std::size_t>> answers(now.size());
  std::vector<bool> isTaken(before.size(), false);
  const auto take = [&](std::size_t i, std::size_t k) {
    answers[i] = k;
    isTaken[k] = true;
  };
  const auto takeByKey = [&](bool numbered) {
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (answers[i] || isNumbered(now[i].node) != numbered) continue;
      const auto found = byKey.find(keysNow[i]);
      if (found != byKey.end() && !isTaken[found->second]) take(i, found->second);
    }
  };
  takeByKey(false);
  // What is left over, by mesh and place, the first first. A name that the other side has as well was not given anew.
  const std::set<std::string> namesBefore = namesOf(before), namesNow = namesOf(now);
  const auto isRenamed = [&](const std::string& then, const std::string& node) {
    return then == node ||
           ((isNumbered(then) || !namesNow.contains(then)) && (isNumbered(node) || !namesBefore.contains(node)));
  };
  using Place = std::pair<std::uint64_t, std::uint64_t>;
  const auto placeOf = [](const BakedInstance& part) { return Place(part.geometryHash, part.transformHash); };
  std::set<std::pair<Place, std::size_t>> byPlace;
  for (std::size_t k = 0; k < before.size(); ++k) {
    if (!isTaken[k]) byPlace.emplace(placeOf(before[k]), k);
  }
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (answers[i]) continue;
    auto found = byPlace.lower_bound({placeOf(now[i]), 0});
    const auto isThere = [&] { return found != byPlace.end() && found->first == placeOf(now[i]); };
    while (isThere() && !isRenamed(before[found->second].node, now[i].node)) ++found;
    if (!isThere()) continue;
    take(i, found->second);
    byPlace.erase(found);
  }
  takeByKey(true);
  return answers;
}

const char* toString(PartChange::Kind kind) {
  switch (kind) {
    case PartChange::Kind::added:
      return "added";
    case PartChange::Kind::removed:
      return "removed";
    case PartChange::Kind::renamed:
      return "renamed";
    case PartChange::Kind::moved:
      return "moved";
    case PartChange::Kind::reshaped:
      return "reshaped";
    case PartChange::Kind::rematerialled:
      return "rematerialled";
    case PartChange::Kind::settings:
      return "settings";
  }
  return "";
}

std::string toString(const PartChange& c) {
  const std::string node = "node \"" + c.node + "\"";
  const auto named = [](const std::string& name) { return name.empty() ? std::string("none") : "\"" + name + "\""; };
  switch (c.kind) {
    case PartChange::Kind::added:
      return node + " added";
    case PartChange::Kind::removed:
      return node + " removed";
    case PartChange::Kind::renamed:
      return c.nodeBefore == c.node ? node + ": mesh was \"" + c.meshBefore + "\", is \"" + c.mesh + "\""
                                    : node + " was \"" + c.nodeBefore + "\"";
    case PartChange::Kind::moved:
      return node + " moved";
    case PartChange::Kind::reshaped:
      return node + ": geometry of mesh \"" + c.mesh + "\" changed";
    case PartChange::Kind::rematerialled:
      return c.materialBefore == c.materialNow
                 ? node + ": material " + named(c.materialNow) + " changed"
                 : node + ": material was " + named(c.materialBefore) + ", is " + named(c.materialNow);
    case PartChange::Kind::settings:
      return node +
             ": extras.relume (bake mode, texel density), whether it counts as solid or mirrored, or its number among "
             "the node's primitives or instances changed";
  }
  return node;
}

std::vector<PartChange> compareParts(std::span<const BakedInstance> before, std::span<const BakedInstance> now) {
  const std::vector<std::optional<std::size_t>> answers = answersOf(before, now);
  std::vector<bool> isKept(before.size(), false);
  std::vector<PartChange> changes;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (!answers[i]) {
      changes.push_back({PartChange::Kind::added, now[i].node, now[i].mesh, "", now[i].material});
      continue;
    }
    const BakedInstance& then = before[*answers[i]];
    isKept[*answers[i]] = true;
    if (then.node != now[i].node || then.mesh != now[i].mesh)
      changes.push_back({PartChange::Kind::renamed, now[i].node, now[i].mesh, "", "", then.node, then.mesh});
    compareOne(then, now[i], changes);
  }
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (!isKept[i])
      changes.push_back({PartChange::Kind::removed, before[i].node, before[i].mesh, before[i].material, ""});
  }
  return changes;
}

}  // namespace relume
