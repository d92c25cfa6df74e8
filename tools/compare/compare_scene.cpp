// SPDX-License-Identifier: MIT
// See compare_scene.h.
#include "tools/compare/compare_scene.h"

#include <map>
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

}  // namespace

std::vector<PartKey> partKeys(std::span<const BakedInstance> parts) {
  std::map<std::pair<std::string, std::string>, std::size_t> seen;
  std::vector<PartKey> keys;
  for (const BakedInstance& part : parts) keys.emplace_back(part.node, part.mesh, seen[{part.node, part.mesh}]++);
  return keys;
}

const char* toString(PartChange::Kind kind) {
  switch (kind) {
    case PartChange::Kind::added:
      return "added";
    case PartChange::Kind::removed:
      return "removed";
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
    case PartChange::Kind::moved:
      return node + " moved";
    case PartChange::Kind::reshaped:
      return node + ": geometry of mesh \"" + c.mesh + "\" changed";
    case PartChange::Kind::rematerialled:
      return c.materialBefore == c.materialNow
                 ? node + ": material " + named(c.materialNow) + " changed"
                 : node + ": material was " + named(c.materialBefore) + ", is " + named(c.materialNow);
    case PartChange::Kind::settings:
      return node + ": extras.relume (bake mode or texel density) changed";
  }
  return node;
}

std::vector<PartChange> compareParts(std::span<const BakedInstance> before, std::span<const BakedInstance> now) {
  const std::vector<PartKey> keysBefore = partKeys(before), keysNow = partKeys(now);
  std::map<PartKey, std::size_t> at;
  for (std::size_t i = 0; i < before.size(); ++i) at.emplace(keysBefore[i], i);
  std::vector<PartChange> changes;
  for (std::size_t i = 0; i < now.size(); ++i) {
    const auto found = at.find(keysNow[i]);
    if (found == at.end()) {
      changes.push_back({PartChange::Kind::added, now[i].node, now[i].mesh, "", now[i].material});
      continue;
    }
    compareOne(before[found->second], now[i], changes);
    at.erase(found);
  }
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (at.contains(keysBefore[i]))
      changes.push_back({PartChange::Kind::removed, before[i].node, before[i].mesh, before[i].material, ""});
  }
  return changes;
}

}  // namespace relume
