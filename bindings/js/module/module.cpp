// SPDX-License-Identifier: MIT
// What JavaScript calls of the WebAssembly module beside include/relume/relume.h: the functions of it that take
// structs, with plain arguments. Everything is allocated by one context, which counts the bytes that live. One thread.
#include "context.h"
#include "relume/relume.h"

#include <emscripten.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <new>

static_assert(sizeof(relume_light) == 52, "src/core.js writes lights as 13 words");
static_assert(offsetof(relume_light, intensity) == 4 && offsetof(relume_light, position) == 16);
static_assert(offsetof(relume_light, direction) == 28 && offsetof(relume_light, range) == 40);
static_assert(offsetof(relume_light, outer_cone_radians) == 48);
static_assert(sizeof(relume_moving_part) == 52 && offsetof(relume_moving_part, to_world) == 4, "and parts likewise");

namespace {

std::size_t liveBytes = 0;

void* give(void*, std::size_t size, std::size_t alignment) {
  alignment = std::max(alignment, alignof(std::max_align_t));
  void* const block = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (block != nullptr) liveBytes += size;
  return block;
}

void takeBack(void*, void* block, std::size_t size, std::size_t) {
  liveBytes -= size;
  std::free(block);
}

}  // namespace

relume_context* relume_web_context() {
  static relume_context* const instance = [] {
    relume_context_desc desc = {};
    desc.struct_size = sizeof desc;
    desc.api_version = RELUME_API_VERSION;
    desc.allocate = give;
    desc.deallocate = takeBack;
    relume_context* made = nullptr;
    relume_context_create(&desc, &made);
    return made;
  }();
  return instance;
}

namespace {

// clang-format off
EM_JS(void, callVisibility, (void* relighter, unsigned light, unsigned count, const float* positions,
                             const float* normals, float* visible), {
  Module["relumeVisibility"](relighter, light, count, positions, normals, visible);
});
// clang-format on

// The relighter whose frame is being made, by which JavaScript finds its callback, is what the library hands through.
void visibility(void* relighter, unsigned light, unsigned count, const float* positions, const float* normals,
                float* visible) {
  callVisibility(relighter, light, count, positions, normals, visible);
}

}  // namespace

extern "C" {

// Bytes that bakes and relighters hold, the bakes' own files included: those are malloc()ed by JavaScript, and counted
// by relume_web_file().
std::size_t relume_web_live_bytes() { return liveBytes; }

// Room for a file, aligned as relume_bake_from_memory() wants it; null where there is none.
void* relume_web_file(std::size_t size) { return give(nullptr, size + sizeof(double), 64); }
// For a file that was not handed to relume_web_bake().
void relume_web_free_file(void* file, std::size_t size) { takeBack(nullptr, file, size + sizeof(double), 64); }

// Text of what last failed without a handle.
const char* relume_web_error() { return relume_context_error(relume_web_context()); }

// The bake of a file, which it takes over; null with relume_web_error().
relume_bake* relume_web_bake(void* file, std::size_t size) {
  struct File {
    void* bytes;
    std::size_t size;
  };
  auto* const owned = new (std::nothrow) File{file, size};
  if (owned == nullptr) {
    relume_web_free_file(file, size);
    return nullptr;
  }
  const auto release = [](void* user) {
    auto* const done = static_cast<File*>(user);
    relume_web_free_file(done->bytes, done->size);
    delete done;
  };
  relume_bake* bake = nullptr;
  relume_bake_from_memory(relume_web_context(), file, size, release, owned, &bake);
  return bake;
}

// relume_bake_info of a bake, until the next call.
const relume_bake_info* relume_web_info(const relume_bake* bake) {
  static relume_bake_info info;
  info.struct_size = sizeof info;
  return relume_bake_get_info(bake, &info) == RELUME_OK ? &info : nullptr;
}

// On the CPU; null with relume_bake_error(). lumaBands: 0 to 4, for the kernels have no more here; without a text else.
// movingParts, movingLag: 0 in modules without things that move.
relume_relighter* relume_web_relighter(relume_bake* bake, int lumaBands, int chromaBands, int glossy, int gridTexture,
                                       unsigned movingParts, unsigned movingLag) {
  constexpr int kMaxBands = 4;
  if (lumaBands < 0 || lumaBands > kMaxBands) return nullptr;
  if (lumaBands == 0 && relume_web_info(bake)->luma_bands > kMaxBands) lumaBands = kMaxBands;
  relume_relighter_desc desc = {};
  desc.struct_size = sizeof desc;
  desc.backend = RELUME_BACKEND_CPU;
  desc.luma_bands = lumaBands;
  desc.chroma_bands = chromaBands;
  desc.glossy = glossy;
  desc.grid_texture = gridTexture;
  desc.moving_parts = movingParts;
  desc.moving_lag = movingLag;
  relume_relighter* relighter = nullptr;
  relume_relighter_create(bake, &desc, &relighter);
  return relighter;
}

// scalars: sky radiance, emission scale, bounce scale. Null arrays are not handed over; see relume_light_setup.
relume_status relume_web_relight(relume_relighter* relighter, const relume_light* lights, std::size_t lightCount,
                                 int callsVisibility, const float* surfelIrradiance, const float* surfelEmission,
                                 const float* skyPatches, const float* scalars,
                                 const relume_material_emission* emissions, std::size_t emissionCount,
                                 const relume_moving_part* parts, std::size_t partCount,
                                 const relume_moving_shapes* shapes) {
  relume_light_setup setup;
  relume_light_setup_default(&setup, sizeof setup);
  setup.lights = lights;
  setup.light_count = lightCount;
  if (callsVisibility != 0) setup.visibility = visibility;
  setup.visibility_user = relighter;
  setup.surfel_irradiance = surfelIrradiance;
  setup.surfel_emission = surfelEmission;
  setup.sky_patches = skyPatches;
  for (int k = 0; k < 3; ++k) setup.sky_radiance[k] = scalars[k], setup.emission_scale[k] = scalars[3 + k];
  setup.bounce_scale = scalars[6];
  setup.material_emissions = emissions;
  setup.material_emission_count = emissionCount;
  setup.moving_parts = parts;
  setup.moving_part_count = partCount;
  setup.moving_shapes = shapes;
  return relume_relight(relighter, &setup);
}

// Shape, format, size and kind of a texture to resolve with: shape, format, width, height, depth, filtered, light,
// bytes; its sampler by relume_web_texture_sampler().
const unsigned* relume_web_texture(const relume_relighter* relighter, unsigned texture) {
  static std::array<unsigned, 9> words;
  relume_resolve_texture info = {};
  info.struct_size = sizeof info;
  if (relume_resolve_texture_get_info(relighter, texture, &info) != RELUME_OK) return nullptr;
  words = {static_cast<unsigned>(info.shape),
           static_cast<unsigned>(info.format),
           info.width,
           info.height,
           info.depth,
           static_cast<unsigned>(info.filtered),
           static_cast<unsigned>(info.light),
           static_cast<unsigned>(info.bytes),
           reinterpret_cast<unsigned>(info.sampler)};
  return words.data();
}

}  // extern "C"
