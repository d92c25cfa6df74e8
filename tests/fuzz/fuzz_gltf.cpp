// SPDX-License-Identifier: MIT
// libFuzzer: any bytes as a scene alone in its folder; those that begin with "glTF" as .glb, others as .gltf. Built
// with RELUME_FUZZ_FILES also a buffer b.bin and an image i.png that lie beside the .gltf (mutate.h: FileSet).
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "tests/fuzz/memory_folder.h"
#include "tests/fuzz/mutate.h"

#include <cstring>
#include <filesystem>

namespace {

namespace fs = std::filesystem;
using relume::fuzz::Bytes;

#ifdef RELUME_FUZZ_FILES
constexpr bool kWithFiles = true;
#else
constexpr bool kWithFiles = false;
#endif

void import(const fs::path& path) {
  relume::Context context;
  context.threads = 1;
  relume::ImportOptions options;
  options.gloss = true;
  const auto scene = relume::importGltf(path, context, options);
  if (!scene) return;
  for (std::uint32_t i = 0; i < scene->instances.size(); ++i) {
    const relume::Instance& instance = scene->instances[i];
    const relume::Mesh& mesh = scene->meshes.at(instance.mesh);
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      const relume::SurfacePoint middle{i, t, {0.3f, 0.3f}};
      (void)scene->corners(instance, t);
      (void)relume::mappedNormal(*scene, middle);
      (void)relume::glossAt(*scene, middle);
    }
    (void)scene->material(instance);
  }
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max, unsigned seed) {
  relume::fuzz::Random random(seed);
  if (!kWithFiles) return relume::fuzz::store(relume::fuzz::mutateGltf({data, size}, max, random), data, max);
  relume::fuzz::FileSet files = relume::fuzz::splitFiles({data, size});
  switch (random() % 8) {
    case 0:
      relume::fuzz::mutateBytes(files.buffer, files.buffer.size() + 64);
      break;
    case 1:
      relume::fuzz::mutateBytes(files.image, files.image.size() + 64);
      break;
    default:
      files.scene = relume::fuzz::mutateGltf(files.scene, files.scene.size() + 256, random);
  }
  const Bytes joined = relume::fuzz::joinFiles(files);
  return joined.size() <= max ? relume::fuzz::store(joined, data, max) : size;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (kWithFiles) {
    const relume::fuzz::FileSet files = relume::fuzz::splitFiles({data, size});
    relume::fuzz::writeToMemory("b.bin", files.buffer);
    relume::fuzz::writeToMemory("i.png", files.image);
    import(relume::fuzz::writeToMemory("scene.gltf", files.scene));
  } else {
    const bool binary = size >= 4 && std::memcmp(data, "glTF", 4) == 0;
    import(relume::fuzz::writeToMemory(binary ? "scene.glb" : "scene.gltf", {data, size}));
  }
  return 0;
}
