// SPDX-License-Identifier: MIT
// relume-view: a window onto a level that is relit every frame; or, with --headless, frames of it as pictures.
#include "bake/context.h"
#include "bake/scene/check_mesh.h"
#include "bake/scene/scene.h"
#include "bake/tools/printable.h"
#include "formats/bake_file.h"
#include "samples/02_viewer/headless.h"
#include "samples/02_viewer/options.h"
#include "samples/02_viewer/window.h"

#include <cstdio>

namespace {

int fail(const relume::Error& error) {
  std::fprintf(stderr, "relume-view: error: %s\n", relume::printableLines(error.message).c_str());
  return relume::exitCode(error.code);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace relume;
  const auto options = parseViewerOptions(argc, argv);
  if (!options) return fail(options.error());
  if (options->exitNow) return 0;
  Context context;
  auto scene = importGltf(options->scene, context);
  if (!scene) return fail(scene.error());
  repairMeshes(*scene, context);  // as the baker does
  const auto bake = mapBake(options->bake);
  if (!bake) return fail(bake.error());
  if (bake->instances.size() != scene->instances.size()) {
    return fail({ErrorCode::invalidFile, "\"" + options->bake + "\" was not baked from \"" + options->scene +
                                             "\": it has " + std::to_string(bake->instances.size()) +
                                             " instances, the scene " + std::to_string(scene->instances.size())});
  }
  const Status status =
      options->headlessFrames > 0 ? runHeadless(*scene, *bake, *options) : runWindow(*scene, *bake, *options);
  return status ? 0 : fail(status.error());
}
