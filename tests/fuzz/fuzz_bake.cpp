// SPDX-License-Identifier: MIT
// libFuzzer: any bytes as a .glb or .gltf that is imported, repaired and baked, with the smallest options. A bake
// either is valid, which bake() sees to itself, or gives an error that blames the level.
#include "bake/import/check_mesh.h"
#include "relume/bake/bake.h"
#include "relume/bake_file.h"
#include "tests/fuzz/memory_folder.h"
#include "tests/fuzz/mutate.h"
#include "tests/pipeline/tiny_bake.h"

#include <cstdlib>
#include <cstring>

using namespace relume;

namespace {

// What the levels may have, so that most of the time goes to many of them.
constexpr std::uint32_t kMaxTriangles = 2000;
constexpr std::size_t kMaxInstances = 64;

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max, unsigned seed) {
  fuzz::Random random(seed);
  return fuzz::store(fuzz::mutateGltf({data, size}, max, random), data, max);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const bool binary = size >= 4 && std::memcmp(data, "glTF", 4) == 0;
  Context context;
  context.threads = 1;
  Result<Scene> scene = importGltf(fuzz::writeToMemory(binary ? "scene.glb" : "scene.gltf", {data, size}), context);
  if (!scene || scene->triangleCount() > kMaxTriangles || scene->instances.size() > kMaxInstances) return 0;
  repairMeshes(*scene, context);
  const Result<Bake> baked = bake(*scene, test::tinyBakeOptions(), context);
  if (!baked) {
    if (baked.error().message.find("fault of the baker") != std::string::npos) std::abort();
    return 0;
  }
  const Result<std::vector<std::byte>> bytes = serializeBake(*baked);
  if (!bytes || !parseBake(*bytes, nullptr)) std::abort();
  return 0;
}
