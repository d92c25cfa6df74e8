// SPDX-License-Identifier: MIT
// libFuzzer: any bytes as a scene; those that begin with "glTF" as .glb, others as .gltf. The file lies alone in a folder of
// its own, so that what it refers to is missing, and in `with`, beside an image and a buffer that it may name.
#include "bake/context.h"
#include "bake/scene/scene.h"

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

namespace {

namespace fs = std::filesystem;

const fs::path& folder() {
  static const fs::path path = [] {
    const fs::path made = fs::temp_directory_path() / ("relume_fuzz_gltf_" + std::to_string(::getpid()));
    fs::create_directories(made);
    std::ofstream(made / "b.bin", std::ios::binary) << std::string(4096, '\1');
    std::ofstream(made / "i.png", std::ios::binary) << "\x89PNG\r\n\x1a\n";
    return made;
  }();
  return path;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const bool binary = size >= 4 && std::memcmp(data, "glTF", 4) == 0;
  const fs::path path = folder() / (binary ? "scene.glb" : "scene.gltf");
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return 0;
  std::fwrite(data, 1, size, file);
  std::fclose(file);
  relume::Context context;
  const auto scene = relume::importGltf(path, context);
  if (scene) {
    for (const relume::Instance& instance : scene->instances) {
      const relume::Mesh& mesh = scene->meshes.at(instance.mesh);
      for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) (void)scene->corners(instance, t);
      (void)scene->material(instance);
    }
  }
  return 0;
}
