// SPDX-License-Identifier: MIT
// See fit_bake.h.
#include "tools/compare/fit_bake.h"

#include "relume/bake_file.h"
#include "tools/compare/staleness.h"

#include <cstdint>

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
  const Status same = checkSameScene(scene, *bake, bakeFile, sceneFile);
  if (same) return bake;
  if (!allowStale) return same.error();
  const std::uint32_t found = fitToScene(scene, *bake);
  context.message(Severity::warning, same.error().message + " was refused without --allow-stale; " +
                                         std::to_string(found) + " of " + std::to_string(scene.instances.size()) +
                                         " parts found by name, the others read the grid");
  return bake;
}

}  // namespace relume
