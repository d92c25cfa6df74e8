// SPDX-License-Identifier: MIT
// Prints the tables of docs/notes/emission.md: each emitter lit alone, against `relume reference`.
//   bench_driven_error LEVEL.glb CAMERA PRESET SPP [MARKED...]
// MARKED: materials that are made drivable, as extras.relume.drivable does; texture coordinates are laid over the
// widest two axes of their meshes where they have none. Each drivable material is driven by a colour, those that are
// marked by an image as well.
#include "tests/accuracy/driven_error.h"
#include "relume/bake/bake.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>

namespace {

using namespace relume;

void mark(Scene& scene, const std::string& name) {
  for (std::uint32_t m = 0; m < scene.materials.size(); ++m) {
    if (scene.materials[m].name != name) continue;
    scene.materials[m].drivable = true;
    for (Mesh& mesh : scene.meshes) {
      if (mesh.material != m || !mesh.uv[0].empty()) continue;
      glm::vec3 low(1e9f), high(-1e9f);
      for (const glm::vec3& p : mesh.position) {
        low = glm::min(low, p);
        high = glm::max(high, p);
      }
      const glm::vec3 size = high - low;
      const int least = size.x <= size.y && size.x <= size.z ? 0 : (size.y <= size.z ? 1 : 2);
      const int u = (least + 1) % 3, v = (least + 2) % 3;
      for (const glm::vec3& p : mesh.position)
        mesh.uv[0].push_back({(p[u] - low[u]) / size[u], (p[v] - low[v]) / size[v]});
    }
  }
}

int fail(const Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return exitCode(error.code);
}

int run(int argc, char** argv) {
  Context context;
  auto scene = loadScene(argv[1], context);
  if (!scene) return fail(scene.error());
  for (int i = 5; i < argc; ++i) mark(*scene, argv[i]);
  const auto* const preset = std::find_if(std::begin(kPresets), std::end(kPresets),
                                          [&](const PresetInfo& info) { return info.name == std::string(argv[3]); });
  if (preset == std::end(kPresets)) return std::fprintf(stderr, "no preset %s\n", argv[3]), 1;
  const auto baked = bake(*scene, presetOptions(preset->preset), context);
  if (!baked) return fail(baked.error());
  const auto bytes = serializeBake(*baked);
  if (!bytes) return fail(bytes.error());
  Bake without = *baked;
  without.emitters = {};
  const auto fewer = serializeBake(without);
  std::printf("%s, %s: %u surfels, %u of emitters, bake %.2f MiB, %.3f MiB of them what drives emitters\n\n", argv[1],
              argv[3], baked->surfels.count(), baked->emitters.count(), static_cast<double>(bytes->size()) / 1048576.0,
              fewer ? static_cast<double>(bytes->size() - fewer->size()) / 1048576.0 : 0.0);
  std::printf("| material | by | surfels | rmse %% | t1 %% | energy | noise %% | surfels ms | driven ms | MiB |\n");
  std::printf("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n");
  for (const DrivableMaterial& material : baked->emitters.materials) {
    for (const std::uint32_t side : {0u, 256u}) {
      if (side > 0 && !(material.marked && material.textured)) continue;
      DrivenMaterial driven;
      driven.name = material.name;
      driven.radiance = side > 0 ? glm::vec3(1.0f) : glm::vec3(4, 3, 2);
      driven.width = driven.height = side;
      if (side > 0) driven.image = drawSigns(side, side, 10.0f);
      const auto error = measureDriven(*scene, *baked, driven, argv[2], 160, 120,
                                       static_cast<std::uint32_t>(std::strtoul(argv[4], nullptr, 10)));
      if (!error) return fail(error.error());
      const ImageDifference& d = error->difference;
      std::printf("| `%s` | %s | %u | %.1f | %.1f | %.3f | %.1f | %.2f | %.2f | %.3f |\n", material.name.c_str(),
                  side > 0 ? "image 256 x 256" : "colour", material.entryCount, 100.0 * d.rmseClean,
                  100.0 * d.rmseTrimmed, d.energy, 100.0 * d.noise, error->surfelsMs, error->drivenMs,
                  static_cast<double>(error->emissionBytes) / 1048576.0);
      std::fflush(stdout);
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr, "usage: bench_driven_error LEVEL.glb CAMERA PRESET SPP [MARKED...]\n");
    return 1;
  }
  return run(argc, argv);
}
