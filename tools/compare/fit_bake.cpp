// SPDX-License-Identifier: MIT
// See fit_bake.h.
#include "tools/compare/fit_bake.h"

#include "relume/bake_file.h"
#include "tools/compare/staleness.h"

#include <cstdint>
#include <optional>
#include <string>

namespace relume {

bool lacksCoordinates(const Bake& bake) {
  const Lightmap& map = bake.caches.lightmap;
  return !map.cache.empty() && !map.parts.empty() && map.cornerUv.empty();
}

Status checkCoordinates(const Bake& bake, const std::string& bakeFile) {
  if (!lacksCoordinates(bake)) return done();
  return Error{ErrorCode::usage,
               bakeFile +
                   ": its light-map coordinates were left out (relume pack --profile web): give the bake that it "
                   "was packed from, or pack that with --keep-coordinates"};
}

Result<Bake> readBakeOf(const Scene& scene, const std::string& bakeFile, const std::string& sceneFile, bool allowStale,
                        Context& context) {
  auto bake = readBake(bakeFile);
  if (!bake) return bake.error();
  if (const Status status = checkCoordinates(*bake, bakeFile); !status) return status.error();
  if (!allowStale) {
    if (const Status same = checkSameScene(scene, *bake, bakeFile, sceneFile); !same) return same.error();
    return bake;
  }
  const std::optional<SceneMismatch> found = findMismatch(scene, *bake, bakeFile, sceneFile);
  if (!found) return bake;
  const std::uint32_t parts = fitToScene(scene, *bake);
  context.message(Severity::warning, found->reason + "; used all the same (--allow-stale): " + std::to_string(parts) +
                                         " of " + std::to_string(scene.instances.size()) +
                                         " parts found by name, the others read the grid");
  return bake;
}

}  // namespace relume
