// SPDX-License-Identifier: MIT
// relume bench SCENE.glb | --bake FILE: how long each stage of a bake and each pass of a frame takes, and what memory
// they need, as text, JSON, or the page docs/PERFORMANCE.md.
#include "bake/scene/check_triangles.h"
#include "formats/file_io.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"
#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/base/scene_options.h"
#include "tools/base/usage_message.h"
#include "tools/cli/bake_flags.h"
#include "tools/cli/bench_report.h"
#include "tools/cli/commands.h"
#include "tools/cli/terminal.h"
#ifdef RELUME_RENDER_GL
#include "tools/gl_scene/egl_context.h"
#endif

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <optional>

namespace relume {
namespace {

struct BenchArguments {
  std::string scene, bakeFile, markdown, relightBands;
  std::vector<Preset> presets{Preset::high};
  BakeFlags flags;
  SceneOptions sceneOptions;
  int repeat = 50, bakes = 1;
  std::vector<int> threads{1, 2};
  std::vector<std::string> backends{"cpu", "gl"};
  bool curve = false, json = false, force = false, live = false;
  LiveLevelOptions liveOptions;
  std::vector<std::uint32_t> curveSurfels, curveCaches;
  ProgressStyle progress = ProgressStyle::automatic;
  TerminalOptions terminal() const { return {*std::max_element(threads.begin(), threads.end()), progress}; }
};

const std::vector<std::uint32_t> kCurveSurfels = {8192, 32768, 131072, 524288, 1048576};
const std::vector<std::uint32_t> kCurveCaches = {1000, 3000, 10000, 30000, 100000};

std::string nameOf(Preset preset) {
  for (const PresetInfo& info : kPresets) {
    if (info.preset == preset) return info.name;
  }
  return "";
}

template <class Items>
std::string joined(const Items& items) {
  std::string text;
  for (const auto& item : items) {
    if (!text.empty()) text += ",";
    if constexpr (std::is_same_v<std::decay_t<decltype(item)>, std::string>) {
      text += item;
    } else {
      text += std::to_string(item);
    }
  }
  return text;
}

// The command line that gives the same, without folders.
std::string describeCommand(const BenchArguments& a) {
  const auto fileName = [](const std::string& path) { return std::filesystem::path(path).filename().string(); };
  std::string text = "relume bench";
  if (a.live) {
    text += " " + fileName(a.scene) + " --live --live-cells " + std::to_string(a.liveOptions.cells) + " --live-rays " +
            std::to_string(a.liveOptions.rays);
    if (a.liveOptions.cascades > 1) text += " --live-cascades " + std::to_string(a.liveOptions.cascades);
  } else if (!a.bakeFile.empty()) {
    text += " --bake " + fileName(a.bakeFile);
  } else {
    std::vector<std::string> names;
    for (const Preset preset : a.presets) names.push_back(nameOf(preset));
    text += " " + fileName(a.scene) + " --preset " + joined(names);
  }
  if (!a.flags.bands.empty()) text += " --bands " + a.flags.bands;
  for (const OptionInfo& info : listOptions(BakeOptions{})) {
    const auto flag = a.flags.flagged.find(info.name);
    if (flag != a.flags.flagged.end()) text += " " + info.flag + " " + flag->second;
  }
  if (!a.relightBands.empty()) text += " --relight-bands " + a.relightBands;
  text += " --repeat " + std::to_string(a.repeat) + " --bakes " + std::to_string(a.bakes);
  text += " --threads " + joined(a.threads);
  text += " --backend " + joined(a.backends);
  if (a.curve) text += " --curve";
  if (!a.curveSurfels.empty()) text += " --curve-surfels " + joined(a.curveSurfels);
  if (!a.curveCaches.empty()) text += " --curve-caches " + joined(a.curveCaches);
  return text;
}

std::string today() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  char text[16];
  return {text, std::strftime(text, sizeof(text), "%Y-%m-%d", &utc)};
}

// What the frames are lit with; zeros = as the bake recommends.
Bands bandsOf(const BenchArguments& a) { return bandsByName(a.relightBands).value_or(Bands{}); }

Status checkArguments(const BenchArguments& a) {
  if (!a.relightBands.empty() && !bandsByName(a.relightBands)) {
    return usage("--relight-bands: a name such as Y3Co1Cg1 expected, bands 1..8, chroma's at most luma's");
  }
  if (a.scene.empty() == a.bakeFile.empty()) {
    return usage("either a scene or --bake FILE is required (see relume bench --help)");
  }
  if (a.live && (!a.bakeFile.empty() || a.flags.any() || a.curve || !a.curveSurfels.empty() || !a.curveCaches.empty()))
    return usage("--live measures light without a bake: leave out --bake, curves and options of the bake");
  const bool curve = a.curve || !a.curveSurfels.empty() || !a.curveCaches.empty();
  if (!a.bakeFile.empty() && (a.flags.any() || curve)) {
    return usage("--bake measures a finished bake: options of the bake and curves need a scene");
  }
  return done();
}

// Holds an OpenGL context for the command's time, where one is asked for and there is one.
class OptionalGl {
 public:
  explicit OptionalGl([[maybe_unused]] bool wanted) {
#ifdef RELUME_RENDER_GL
    if (!wanted) return;
    Result<EglContext> created = EglContext::create();
    description = created ? created->renderer() + ", OpenGL " + created->version() : created.error().message;
    if (!created) return;
    context_.emplace(std::move(*created));
    getProcAddress = EglContext::getProcAddress;
#else
    if (wanted) description = "none: this relume was built without OpenGL";
#endif
  }
  GetProcAddress getProcAddress;  // empty = there is none
  std::string description;

 private:
#ifdef RELUME_RENDER_GL
  std::optional<EglContext> context_;
#endif
};

bool wants(const BenchArguments& a, const char* backend) {
  return std::find(a.backends.begin(), a.backends.end(), backend) != a.backends.end();
}

Result<std::vector<RelightTimes>> measureThreads(const Bake& bake, const BenchArguments& a, Context& context) {
  std::vector<RelightTimes> all;
  if (!wants(a, "cpu")) return all;
  for (const int threads : a.threads) {
    Result<RelightTimes> times = measureCpu(bake, bandsOf(a), threads, a.repeat, context);
    if (!times) return times.error();
    all.push_back(std::move(*times));
  }
  return all;
}

// A report's settings, and their bakes for what is measured last.
struct Measured {
  BenchReport report;
  std::vector<Bake> bakes;
};

Result<CurvePoint> measurePoint(const Scene& scene, const BakeOptions& options, const BenchArguments& a,
                                Terminal& terminal) {
  terminal.startOver();
  Context& context = terminal.context();
  Result<MeasuredBake> measured = measureBake(scene, options, a.bakes, context);
  if (!measured) return measured.error();
  const Result<RelightTimes> relight = measureCpu(measured->bake, bandsOf(a), 1, a.repeat, context);
  if (!relight) return relight.error();
  return CurvePoint{sizesOf(measured->bake), std::move(measured->times), relight->passes.back().medianMs};
}

// The curves over n_S and n_C; everything else as the preset `draft` has it.
Status measureCurves(const Scene& scene, const BenchArguments& a, Terminal& terminal, BenchReport& report) {
  for (const std::uint32_t count : a.curve&& a.curveSurfels.empty() ? kCurveSurfels : a.curveSurfels) {
    BakeOptions options = presetOptions(Preset::draft);
    options.surfels.count = count;
    options.links.kind = LinkKind::cone;  // compact links know too few nodes for a million surfels
    Result<CurvePoint> point = measurePoint(scene, options, a, terminal);
    if (!point) return point.error();
    report.surfelCurve.push_back(std::move(*point));
  }
  for (const std::uint32_t count : a.curve&& a.curveCaches.empty() ? kCurveCaches : a.curveCaches) {
    BakeOptions options = presetOptions(Preset::draft);
    options.caches.gridCaches = count / 5;
    options.caches.lightmapCaches = count - count / 5;
    Result<CurvePoint> point = measurePoint(scene, options, a, terminal);
    if (!point) return point.error();
    report.cacheCurve.push_back(std::move(*point));
  }
  return done();
}

CommandFiles filesOf(const BenchArguments& a) {
  CommandFiles files;
  files.read("the scene", a.scene);
  files.read("the bake", a.bakeFile);
  files.write("--markdown", a.markdown, FileKind::benchPage);
  files.force = a.force;
  return files;
}

Status measureScene(const BenchArguments& a, Terminal& terminal, Measured& measured) {
  BenchReport& report = measured.report;
  Context& context = terminal.context();
  const auto begin = std::chrono::steady_clock::now();
  const Result<Scene> scene = loadScene(a.scene, context, toImportOptions(a.sceneOptions));
  if (!scene) return scene.error();
  CommandFiles files = filesOf(a);
  files.read("a file of the scene", scene->files);
  if (const Status status = checkApart(files); !status) return status;
  if (const Status status = checkDrawnTriangles(*scene); !status) return status;
  report.importSeconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  report.scene = printable(scene->name) + ", " + std::to_string(scene->triangleCount()) + " triangles";
  if (a.live) {
    const OptionalGl gl(wants(a, "gl"));
    report.renderer = gl.description;
    std::unique_ptr<LiveFrames> onGl;
#ifdef RELUME_RENDER_GL
    if (gl.getProcAddress) {
      auto frames = liveFramesGl(a.liveOptions.rays);
      if (!frames) return frames.error();
      onGl = std::move(*frames);
    }
#endif
    if (!onGl && !wants(a, "cpu")) return Error{ErrorCode::unsupported, report.renderer};
    auto live = measureLive(*scene, a.liveOptions, wants(a, "cpu") ? a.threads : std::vector<int>(), onGl.get(),
                            a.bakes, a.repeat, context);
    if (!live) return live.error();
    report.live = std::move(*live);
    return done();
  }
  for (const Preset preset : a.presets) {
    const Result<BakeOptions> options = chooseBakeOptions(presetOptions(preset), a.flags);
    if (!options) return options.error();
    terminal.startOver();
    Result<MeasuredBake> baked = measureBake(*scene, *options, a.bakes, context);
    if (!baked) return baked.error();
    Result<std::vector<RelightTimes>> relight = measureThreads(baked->bake, a, context);
    if (!relight) return relight.error();
    report.settings.push_back({nameOf(preset), sizesOf(baked->bake), std::move(baked->times), std::move(*relight)});
    measured.bakes.push_back(std::move(baked->bake));
  }
  return measureCurves(*scene, a, terminal, report);
}

Status measureBakeFile(const BenchArguments& a, Context& context, Measured& measured) {
  Result<Bake> file = readBake(a.bakeFile);
  if (!file) return file.error();
  Result<std::vector<RelightTimes>> relight = measureThreads(*file, a, context);
  if (!relight) return relight.error();
  measured.report.scene = printable(std::filesystem::path(a.bakeFile).filename().string());
  measured.report.settings.push_back({measured.report.scene, sizesOf(*file), {}, std::move(*relight)});
  measured.bakes.push_back(std::move(*file));
  return done();
}

// Last, because a driver's own memory would count as the bakes'.
Status measureOpenGl(const BenchArguments& a, Context& context, Measured& measured) {
  if (a.live) return done();
  const OptionalGl gl(wants(a, "gl"));
  measured.report.renderer = gl.description;
  for (std::size_t i = 0; gl.getProcAddress && i < measured.bakes.size(); ++i) {
    Result<RelightTimes> times = measureGl(measured.bakes[i], bandsOf(a), gl.getProcAddress, a.repeat, context);
    if (!times) return times.error();
    measured.report.settings[i].relight.push_back(std::move(*times));
  }
  return done();
}

int runBench(const BenchArguments& a) {
  if (const Status status = checkArguments(a); !status) return fail(status.error());
  for (const Preset preset : a.presets) {
    if (const Result<BakeOptions> options = chooseBakeOptions(presetOptions(preset), a.flags); !options)
      return fail(options.error());
  }
  Terminal terminal(a.terminal());
  Context& context = terminal.context();
  if (const Status status = checkOutputs(filesOf(a), context); !status) return fail(status.error());

  Measured all;
  BenchReport& report = all.report;
  report.date = today();
  report.command = printable(describeCommand(a));
  report.version = RELUME_VERSION;
  report.machine = describeMachine();
  report.bakeThreads = a.terminal().threads;

  Status measured = a.bakeFile.empty() ? measureScene(a, terminal, all) : measureBakeFile(a, context, all);
  if (measured) measured = measureOpenGl(a, context, all);
  terminal.finish();
  if (!measured) return fail(measured.error());

  const std::string page = toMarkdown(report);
  if (!a.markdown.empty()) {
    const auto write = [&](const ByteSink& sink) { return sink(std::as_bytes(std::span(page))); };
    if (const Status status = writeFileAtomically(a.markdown, write); !status) return fail(status.error());
  }
  const std::string text = a.json ? jsonText(toJson(report)) + "\n" : page;
  if (a.json || a.markdown.empty()) std::fputs(text.c_str(), stdout);
  return 0;
}

}  // namespace

void addBenchCommand(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("bench", "Measure a bake's stages and a frame's passes: time and memory");
  auto a = std::make_shared<BenchArguments>();
  command->add_option("SCENE", a->scene, "Level to bake and relight, glTF 2.0 (.glb, .gltf)")->option_text("FILE");
  command->add_option("--bake", a->bakeFile, "Bake to relight, in place of a scene (.relume)")->option_text("FILE");
  command->add_option("--preset", a->presets, "Settings to measure, separated by commas " + presetNames())
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("NAMES [high]")
      ->transform(CLI::CheckedTransformer(presetsByName()).description(""));
  command->add_option("--repeat", a->repeat, "Frames to measure; the median and the least are told [1..100000]")
      ->check(CLI::Range(1, 100000).description(""))
      ->capture_default_str();
  command->add_option("--bakes", a->bakes, "Bakes to measure; the least is told [1..1000]")
      ->check(CLI::Range(1, 1000).description(""))
      ->capture_default_str();
  command
      ->add_option("--threads", a->threads,
                   "Threads of the CPU's frames, separated by commas; bakes use the most of them [1..1024]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::Range(1, 1024).description(""))
      ->capture_default_str();
  command->add_option("--relight-bands", a->relightBands, "Bands that the frames are lit with, as Y3Co1Cg1")
      ->option_text("NAME [as the bake recommends]");
  command->add_option("--backend", a->backends, "What relights, separated by commas [cpu|gl]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"cpu", "gl"}).description(""))
      ->capture_default_str();
  CLI::Option* const live = command->add_flag(
      "--live", a->live, "Measure light without a bake, in place of bakes: --bakes levels, --repeat frames");
  command->add_option("--live-cells", a->liveOptions.cells, "Cells on the level's longest side [8..64]")
      ->check(CLI::Range(kMinCells, kMaxCells).description(""))
      ->needs(live)
      ->capture_default_str();
  command
      ->add_option("--live-cascades", a->liveOptions.cascades,
                   "Volumes in one another, each with cells half as large as the one around it; about the "
                   "first camera, or the level's middle [1..4]")
      ->check(CLI::Range(1u, kMaxCascades).description(""))
      ->needs(live)
      ->capture_default_str();
  command->add_option("--live-rays", a->liveOptions.rays, "Rays of a cell in each frame [8..4096]")
      ->check(CLI::Range(8, 4096).description(""))
      ->needs(live)
      ->capture_default_str();
  command->add_flag("--curve", a->curve, "Measure how a bake grows with 8192..1048576 surfels and 1000..100000 caches");
  command->add_option("--curve-surfels", a->curveSurfels, "The same for these counts of surfels [2..16777216]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::Range(2u, 16777216u).description(""));
  command->add_option("--curve-caches", a->curveCaches, "The same for these counts of caches [1..10000000]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::Range(1u, 10000000u).description(""));
  command->add_flag("--force", a->force, "Let --markdown write over a file that is something else, or read-only");
  command->add_flag("--json", a->json, "Print what was measured as JSON");
  command->add_option("--markdown", a->markdown, "Write it as a page of tables, in place of printing it")
      ->option_text("FILE");
  static const std::map<std::string, ProgressStyle> kStyles = {{"auto", ProgressStyle::automatic},
                                                               {"plain", ProgressStyle::plain},
                                                               {"json", ProgressStyle::json},
                                                               {"none", ProgressStyle::none}};
  command->add_option("--progress", a->progress, "How to show progress, on stderr [auto|plain|json|none]")
      ->option_text("STYLE [auto]")
      ->transform(CLI::CheckedTransformer(kStyles).description(""));
  addSceneOptions(*command, a->sceneOptions);
  addBakeFlags(*command, a->flags);
  command->callback([a, &action] { action = [a] { return runBench(*a); }; });
}

}  // namespace relume
