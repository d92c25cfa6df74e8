// SPDX-License-Identifier: MIT
// See find_edits.h.
#include "tools/compare/find_edits.h"

#include "relume/bake/provenance.h"
#include "tools/render/drive_scene.h"
#include "tools/render/scene_bounds.h"

#include <map>
#include <utility>

namespace relume {
namespace {

void addBounds(const Scene& scene, const Instance& instance, float levelReach, std::vector<EditBounds>& bounds) {
  const SceneBounds box = boundsOf(scene, instance);
  if (!box.empty) bounds.push_back({box.min, box.max, isDrivable(scene.material(instance)) ? levelReach : 0.0f});
}

}  // namespace

FoundEdits findEdits(const Scene& before, const Scene& now) {
  const std::vector<BakedInstance> partsBefore = describeInstances(before), partsNow = describeInstances(now);
  const std::vector<PartKey> keysBefore = partKeys(partsBefore), keysNow = partKeys(partsNow);
  std::map<PartKey, std::size_t> at;
  for (std::size_t i = 0; i < keysBefore.size(); ++i) at.emplace(keysBefore[i], i);

  FoundEdits found{{before, std::vector<std::uint8_t>(now.instances.size(), 0), {}, {}, {}}, {}};
  std::vector<std::uint8_t> isKept(before.instances.size(), 0);
  const float reach = diagonal(joined(boundsOf(before), boundsOf(now)));
  for (std::size_t i = 0; i < now.instances.size(); ++i) {
    const Instance& instance = now.instances[i];
    const auto there = at.find(keysNow[i]);
    const bool isNew = there == at.end() || before.instances[there->second].mode != instance.mode;
    if (!isNew) isKept[there->second] = 1;
    if (!instance.baked()) {
      if (!isNew) found.level.before.instances[there->second].toWorld = instance.toWorld;
      continue;
    }
    std::vector<PartChange> changes;
    if (!isNew && partsBefore[there->second].contentHash == partsNow[i].contentHash) continue;
    found.level.isChanged[i] = 1;
    addBounds(now, instance, reach, found.level.bounds);
    if (!isNew) addBounds(before, before.instances[there->second], reach, found.level.bounds);
  }
  for (std::size_t i = 0; i < before.instances.size(); ++i) {
    if (isKept[i] != 0) continue;
    if (before.instances[i].baked())
      addBounds(before, before.instances[i], reach, found.level.bounds);
    else
      found.level.before.instances[i].mode = BakeMode::ignore;
  }
  for (PartChange& change : compareParts(partsBefore, partsNow)) found.changes.push_back(std::move(change));
  return found;
}

}  // namespace relume
