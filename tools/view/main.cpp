// SPDX-License-Identifier: MIT
// relume-view: a window onto a level that is relit every frame; or, with --headless, frames of it as pictures.
#include "bake/base/printed.h"
#include "bake/scene/check_triangles.h"
#include "relume/bake/context.h"
#include "relume/bake/load_scene.h"
#include "tools/base/printable.h"
#include "tools/view/headless.h"
#include "tools/view/loaded_level.h"
#include "tools/view/options.h"
#include "tools/view/view_state.h"
#include "tools/view/window.h"

#include <cstdio>
#include <string_view>
#include <utility>

namespace {

int fail(const relume::Error& error) {
  std::fprintf(stderr, "relume-view: error: %s\n", relume::printableLines(error.message).c_str());
  return relume::exitCode(error.code);
}

void say(relume::Severity severity, std::string_view text) {
  if (severity == relume::Severity::info) return;
  std::fprintf(stderr, "relume-view: warning: %s\n", relume::printableLines(text).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  using namespace relume;
  useClassicLocale();
  const auto options = parseViewerOptions(argc, argv);
  if (!options) return fail(options.error());
  if (options->exitNow) return 0;
  Context context;
  context.onMessage = say;
  auto scene = loadScene(options->scene, context, toImportOptions(options->sceneOptions));
  if (!scene) return fail(scene.error());
  if (const auto warning = cameraWarning(*scene, *options)) say(Severity::warning, *warning);
  // A window bakes by itself, and shows how far it is; that there is nothing to bake is said before it opens.
  if (options->bake.empty() && options->draft && options->headlessFrames == 0) {
    if (const Status drawn = checkDrawnTriangles(*scene); !drawn) return fail(drawn.error());
    const Status status = runWindow(std::move(*scene), nullptr, *options);
    return status ? 0 : fail(status.error());
  }
  LevelFiles files{options->scene, options->bake, options->sceneOptions, options->allowStale, options->driven};
  files.isEditable = options->edit;
  if (options->bake.empty() && options->draft) files.bakeBy = presetOptions(Preset::draft);
  auto level = loadBake(std::move(*scene), files, context);
  if (!level) return fail(level.error());
  const Bake& bake = (*level)->bake;
  if (!options->skyMap.empty() && (*level)->isBaked && bake.hierarchy.skyDirection.empty())
    say(Severity::warning, options->bake +
                               ": has no patches of sky, so the sky map lights nothing here; bake with "
                               "--sky-patches 64");
  const Status status = options->headlessFrames > 0 ? runHeadless(**level, *options) : runWindow({}, *level, *options);
  return status ? 0 : fail(status.error());
}
