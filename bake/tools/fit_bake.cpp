// SPDX-License-Identifier: MIT
// See fit_bake.h.
#include "bake/tools/fit_bake.h"

#include "bake/provenance.h"
#include "formats/bake_file.h"

#include <algorithm>
#include <deque>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

namespace relume {

Status checkSameScene(const Scene& scene, const Bake& bake, const std::string& bakeFile, const std::string& sceneFile) {
  const std::string pair = "\"" + bakeFile + "\" was not baked from \"" + sceneFile + "\": ";
  const std::string what = "; bake again, or use it as it is with --allow-stale";
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

Result<Bake> readBakeOf(const Scene& scene, const std::string& bakeFile, const std::string& sceneFile, bool allowStale,
                        Context& context) {
  auto bake = readBake(bakeFile);
  if (!bake) return bake.error();
  const Status same = checkSameScene(scene, *bake, bakeFile, sceneFile);
  if (same) return bake;
  if (!allowStale) return same.error();
  const std::uint32_t found = matchParts(scene, *bake);
  context.message(Severity::warning, same.error().message + " was refused without --allow-stale; " +
                                         std::to_string(found) + " of " + std::to_string(scene.instances.size()) +
                                         " parts found by name, the others read the grid");
  return bake;
}

}  // namespace relume
