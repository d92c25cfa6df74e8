// SPDX-License-Identifier: MIT
// See fit_bake.h.
#include "bake/tools/fit_bake.h"

#include "bake/provenance.h"

#include <algorithm>
#include <deque>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

namespace relume {

Status checkSameScene(const Scene& scene, const Bake& bake, const std::string& bakeFile, const std::string& sceneFile) {
  const std::string pair = "\"" + bakeFile + "\" was not baked from \"" + sceneFile + "\": ";
  const std::string what = "; bake again, or render it as it is with --allow-stale";
  const std::vector<BakedInstance> now = describeInstances(scene);
  if (now.size() != bake.instances.size()) {
    return Error{ErrorCode::invalidFile, pair + "it has " + std::to_string(bake.instances.size()) +
                                             " instances, the scene " + std::to_string(now.size()) + what};
  }
  for (std::size_t i = 0; i < now.size(); ++i) {
    const BakedInstance& then = bake.instances[i];
    const std::string where = pair + "instance " + std::to_string(i) + " ";
    if (then.node != now[i].node)
      return Error{ErrorCode::invalidFile,
                   where + "is \"" + then.node + "\" in the bake and \"" + now[i].node + "\" in the scene" + what};
    if (then.contentHash != now[i].contentHash)
      return Error{ErrorCode::invalidFile, where + "(\"" + now[i].node + "\") has changed since" + what};
  }
  return done();
}

std::uint32_t matchParts(const Scene& scene, Bake& bake) {
  Lightmap& map = bake.caches.lightmap;
  using Key = std::tuple<std::string, std::string, std::string, std::size_t>;
  std::map<Key, std::deque<LightmapPart>> byName;
  for (std::size_t i = 0; i < std::min(map.parts.size(), bake.instances.size()); ++i) {
    const BakedInstance& then = bake.instances[i];
    byName[{then.node, then.mesh, then.material, map.parts[i].triangleCount}].push_back(map.parts[i]);
  }
  const std::vector<BakedInstance> now = describeInstances(scene);
  std::vector<LightmapPart> parts(now.size());
  std::uint32_t found = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    const std::size_t triangles = scene.meshes[scene.instances[i].mesh].triangle.size();
    const auto same = byName.find({now[i].node, now[i].mesh, now[i].material, triangles});
    if (same == byName.end() || same->second.empty()) continue;
    parts[i] = same->second.front();
    same->second.pop_front();
    ++found;
  }
  map.parts = Array<LightmapPart>(std::move(parts));
  bake.instances = now;
  return found;
}

}  // namespace relume
