// SPDX-License-Identifier: MIT
// A build tool: bakes a level through the installed headers, on two threads at once, writes it, loads it as a game
// does, and looks whether the light is what the bake in memory gives.
//   bake_level LEVEL.glb OUTPUT.relume PRESET [OPTION=VALUE ...]     options by their JSON names: surfels.count=512
// Prints "irradiance R G B", the mean over the surfels' places, facing up [W/m²]. Exit status 0, or 1 with a message.
#include <relume/bake/bake.h>
#include <relume/bake/load_scene.h>
#include <relume/bake/provenance.h>
#include <relume/bake_file.h>
#include <relume/relighter.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <thread>
#include <vector>

namespace {

[[noreturn]] void stop(const std::string& message) {
  std::fprintf(stderr, "bake_level: %s\n", message.c_str());
  std::exit(1);
}

template <typename T>
T take(relume::Result<T> result) {
  if (!result) stop(result.error().message);
  return std::move(*result);
}

void check(const relume::Status& status) {
  if (!status) stop(status.error().message);
}

relume::BakeOptions readOptions(int count, char** texts) {
  static const std::map<std::string, relume::Preset> kPresets = {{"draft", relume::Preset::draft},
                                                                 {"medium", relume::Preset::medium},
                                                                 {"high", relume::Preset::high},
                                                                 {"best", relume::Preset::best}};
  const auto preset = kPresets.find(texts[0]);
  if (preset == kPresets.end()) stop(std::string("no preset ") + texts[0]);
  relume::BakeOptions options = relume::presetOptions(preset->second);
  for (int i = 1; i < count; ++i) {
    const std::string text = texts[i];
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) stop(text + ": NAME=VALUE expected");
    check(relume::setOption(options, text.substr(0, equals), text.substr(equals + 1)));
  }
  check(relume::checkOptions(options));
  return options;
}

relume::Bake bakeLevel(const std::string& level, const relume::BakeOptions& options, int threads) {
  relume::Context context;
  context.threads = threads;
  context.onMessage = [](relume::Severity severity, std::string_view text) {
    if (severity == relume::Severity::error) stop(std::string(text));
  };
  const relume::Scene scene = take(relume::loadScene(level, context));
  relume::Bake bake = take(relume::bake(scene, options, context));

  // The bake knows what it was made from
  const std::vector<relume::BakedInstance> now = relume::describeInstances(scene);
  const relume::Provenance expected = relume::describeProvenance(scene, now, options, bake.provenance.rayTracer);
  if (bake.provenance.sceneHash != expected.sceneHash || bake.provenance.optionsJson != expected.optionsJson ||
      bake.provenance.algorithmVersion != relume::kAlgorithmVersion || bake.provenance.rayTracer.empty())
    stop("the bake's provenance is not that of its scene and options");
  return bake;
}

// Mean irradiance under a sun at the surfels' places, facing up [W/m²].
glm::vec3 relight(const relume::Bake& bake) {
  relume::Relighter relighter = take(relume::Relighter::create(bake, relume::RelightOptions{}));
  relume::Light sun;
  sun.kind = relume::LightKind::directional;
  sun.direction = {0.0f, -0.8f, 0.6f};
  sun.intensity = {9.0f, 8.5f, 7.5f};
  relume::LightSetup setup;
  setup.lights = {&sun, 1};
  check(relighter.relight(setup));
  glm::vec3 sum(0.0f);
  for (std::size_t i = 0; i < bake.surfels.positionWorld.size(); ++i)
    sum += relighter.irradianceInGrid(bake.surfels.positionWorld[i], {0.0f, 1.0f, 0.0f});
  return sum / static_cast<float>(bake.surfels.positionWorld.size());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) stop("usage: bake_level LEVEL.glb OUTPUT.relume PRESET [OPTION=VALUE ...]");
  const std::string level = argv[1], output = argv[2];
  const relume::BakeOptions options = readOptions(argc - 3, argv + 3);

  relume::Bake first, second;
  std::thread other([&] { second = bakeLevel(level, options, 1); });
  first = bakeLevel(level, options, 2);
  other.join();
  if (take(relume::serializeBake(first)) != take(relume::serializeBake(second)))
    stop("two bakes that ran at once differ");

  check(relume::writeBake(first, output));
  const relume::Bake loaded = take(relume::mapBake(output));
  const glm::vec3 expected = relight(first), found = relight(loaded);
  if (found != expected) stop("the file gives other light than the bake in memory");
  std::printf("irradiance %.6g %.6g %.6g\n", static_cast<double>(found.r), static_cast<double>(found.g),
              static_cast<double>(found.b));
  return 0;
}
