// SPDX-License-Identifier: MIT
// RCS Table 2: records, their seconds, and the time to draw them all, at the paper's settings: 1000 x 1000 pixels,
// planes of 64 x 64, records as the paper prints them, none replaced.
#include "tests/measure/preview_tables.h"

#include "bake/preview/preview.h"
#include "tools/render/hemispheres_gl.h"

#include <array>
#include <ctime>

namespace relume {
namespace {

struct View {
  const char *level, *camera, *lights, *name;
  float accuracy;
  bool drawn;                        // by OpenGL as well, which takes minutes where that is software
  std::vector<std::string> without;  // materials
};

void printRow(const LitLevel& level, const View& view, const char* name, PreviewOptions options,
              const DrawHemispheres* draw) {
  options.width = options.height = 1000;
  options.samples = 1;
  options.rounds = 0;
  options.accuracy = view.accuracy;
  options.weight = RecordWeight::ward;
  Context context;
  std::vector<Record> cache;
  const PreviewScene scene{*level.tracer, *level.tracer, level.camera(view.camera), level.lights, false,
                           level.sky,     draw};
  const std::clock_t begin = std::clock();
  const auto frame = renderPreview(scene, level.light, options, cache, context);
  if (!frame) LitLevel::stop(frame.error().message);
  const double processorSeconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  std::printf("| %s, a = %g | %s | %u | %.1f | %.1f | %.0f |\n", view.name, static_cast<double>(view.accuracy), name,
              frame->records, frame->recordSeconds, processorSeconds, 1e3 * frame->splatSeconds);
  std::fflush(stdout);
}

void printView(const std::string& scenes, const View& view) {
  Context context;
  const std::string name = view.level;
  const LitLevel level(scenes + "/" + name + "/" + name + ".glb", view.lights, view.without, context);
  PreviewOptions options;
  options.hemisphere = Hemisphere::border;
  options.reach = RecordReach::printed;
  printRow(level, view, "planes", options, nullptr);
  options.minPixels = 10.0f;
  printRow(level, view, "planes, 10 pixels at least", options, nullptr);
  options.hemisphere = Hemisphere::fan;
  printRow(level, view, "fans of 1024 rays, 10 pixels", options, nullptr);
#ifdef RELUME_RENDER_GL
  options.hemisphere = Hemisphere::border;
  if (!view.drawn) return;
  if (const auto made = drawHemispheresByGl(level.scene, level.lights, options, 4096))
    printRow(level, view, "planes drawn by OpenGL", options, &made->draw);
#endif
}

}  // namespace

void printTable2(const std::string& scenes) {
  // What stands and hangs in the level beside the building itself: the Sponza of 2005 was bare.
  const std::vector<std::string> furnishings{"Plants",    "PotPlant1",   "FabricA", "FabricC", "FabricD",
                                             "FabricE",   "FabricF",     "FabricG", "Vase",    "Chain",
                                             "VaseRound", "VaseHanging", "Pole",    "Shield",  "Lion"};
  const std::array<View, 3> views{
      {{"pandora", "cam_hall", "lamp", "pandora, `cam_hall`", 0.15f, true, {}},
       {"sponza", "cam_atrium", "sun", "Sponza without furnishings, `cam_atrium`", 0.1f, false, furnishings},
       {"sponza", "cam_atrium", "sun", "Sponza, `cam_atrium`", 0.1f, false, {}}}};
  std::printf(
      "RCS Table 2: Sibenik, a = 0.15: 4076 records, 14.3 s, drawn in 188 ms; Sponza, a = 0.1: 4123, 13.7 s, 242 ms\n\n"
      "| view | printed reach, by | records | s | cpu s | all drawn, ms |\n|---|---|---:|---:|---:|---:|\n");
  for (const View& view : views) printView(scenes, view);
}

}  // namespace relume
