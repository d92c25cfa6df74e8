// SPDX-License-Identifier: MIT
// relume.h over the C++ API: handles, error texts, and nothing thrown across.
#include "relume/relume.h"

#include "formats/pack.h"
#include "relume/bake_file.h"
#include "relume/relighter.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

using relume::Error;
using relume::ErrorCode;
using relume::Result;
using relume::Status;

static_assert(sizeof(glm::vec2) == 2 * sizeof(float) && sizeof(glm::vec3) == 3 * sizeof(float));

// What handles of a context share: its callbacks.
struct Host {
  void* user = nullptr;
  relume_log log = nullptr;
  relume_parallel_for parallelFor = nullptr;
};

// The last failure's text. Const functions of one handle may fail on several threads at once.
class LastError {
 public:
  void set(std::string text) {
    const std::lock_guard lock(mutex_);
    text_ = std::move(text);
  }
  const char* text() const {
    const std::lock_guard lock(mutex_);
    return text_.c_str();
  }

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

struct Handle {
  std::shared_ptr<const Host> host;
  mutable LastError error;
};

relume_status statusOf(ErrorCode code) {
  switch (code) {
    case ErrorCode::usage:
      return RELUME_ERROR_USAGE;
    case ErrorCode::io:
      return RELUME_ERROR_IO;
    case ErrorCode::invalidFile:
      return RELUME_ERROR_INVALID_FILE;
    case ErrorCode::failed:
      return RELUME_ERROR_FAILED;
    case ErrorCode::unsupported:
      return RELUME_ERROR_UNSUPPORTED;
  }
  return RELUME_ERROR_FAILED;
}

relume_status fail(const Handle& handle, relume_status status, const char* text) noexcept {
  if (handle.host->log != nullptr) handle.host->log(handle.host->user, RELUME_ERROR, text);
  try {
    handle.error.set(text);
  } catch (...) {  // no memory for the text: the status has to do
  }
  return status;
}

// Runs work() -> Status for a function that was called with `handle`; every failure ends as a status and a text.
template <class Work>
relume_status run(const Handle* handle, const Work& work) noexcept {
  if (handle == nullptr) return RELUME_ERROR_USAGE;
  try {
    const Status status = work();
    return status ? RELUME_OK : fail(*handle, statusOf(status.error().code), status.error().message.c_str());
  } catch (const std::bad_alloc&) {
    return fail(*handle, RELUME_ERROR_MEMORY, "memory ran out");
  } catch (const std::exception& e) {
    return fail(*handle, RELUME_ERROR_FAILED, e.what());
  } catch (...) {
    return fail(*handle, RELUME_ERROR_FAILED, "an exception of the host's callbacks");
  }
}

Error usage(std::string text) { return {ErrorCode::usage, std::move(text)}; }
Error nullPointer(const char* name) { return usage(std::string(name) + " is null"); }

// The caller's struct over the defaults: fields that it does not have keep them. Its first member is struct_size.
template <class T>
Status readStruct(const T* from, std::size_t least, const char* name, T& to) {
  if (from == nullptr) return nullPointer(name);
  std::size_t size = 0;
  std::memcpy(&size, from, sizeof size);
  if (size < least) {
    return usage(std::string(name) + ".struct_size is " + std::to_string(size) + ", expected sizeof, at least " +
                 std::to_string(least));
  }
  std::memcpy(&to, from, std::min(size, sizeof(T)));
  return relume::done();
}

glm::vec3 vec3(const float* v) { return {v[0], v[1], v[2]}; }
std::span<const glm::vec3> vectors(const float* v, std::size_t count) {
  return {reinterpret_cast<const glm::vec3*>(v), v == nullptr ? 0 : count};
}
std::span<glm::vec3> vectors(float* v, std::size_t count) { return {reinterpret_cast<glm::vec3*>(v), count}; }
std::span<const glm::vec2> points(const float* v, std::size_t count) {
  return {reinterpret_cast<const glm::vec2*>(v), count};
}

relume::ParallelFor parallelForOf(const std::shared_ptr<const Host>& host) {
  if (host->parallelFor == nullptr) return {};
  return [host](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
    const relume_task task = [](void* data, unsigned int index) {
      (*static_cast<const std::function<void(std::uint32_t)>*>(data))(index);
    };
    host->parallelFor(host->user, tasks, task, const_cast<std::function<void(std::uint32_t)>*>(&body));
  };
}

}  // namespace

struct relume_context : Handle {};
struct relume_bake : Handle {
  relume::Bake bake;
};
struct relume_relighter : Handle {
  std::optional<relume::Relighter> relighter;
  std::vector<relume::Light> lights;  // of the frame; keeps its memory
  std::size_t surfels = 0, skyPatches = 0;
};

// ---- Contexts

relume_status relume_context_create(const relume_context_desc* desc, relume_context** context) {
  if (context == nullptr) return RELUME_ERROR_USAGE;
  *context = nullptr;
  if (desc == nullptr || desc->struct_size < offsetof(relume_context_desc, log)) return RELUME_ERROR_USAGE;
  relume_context_desc read{};
  std::memcpy(&read, desc, std::min(desc->struct_size, sizeof read));
  if (read.api_version != RELUME_API_VERSION) {
    if (read.log != nullptr) read.log(read.user, RELUME_ERROR, "relume_context_desc.api_version is not this library's");
    return RELUME_ERROR_USAGE;
  }
  try {
    auto made = std::make_unique<relume_context>();
    made->host = std::make_shared<const Host>(Host{read.user, read.log, read.parallel_for});
    *context = made.release();
    return RELUME_OK;
  } catch (const std::bad_alloc&) {
    return RELUME_ERROR_MEMORY;
  }
}
void relume_context_destroy(relume_context* context) { delete context; }
const char* relume_context_error(const relume_context* context) {
  return context == nullptr ? "" : context->error.text();
}

unsigned int relume_api_version(void) { return RELUME_API_VERSION; }
const char* relume_version(void) { return RELUME_VERSION; }
const char* relume_status_text(relume_status status) {
  switch (status) {
    case RELUME_OK:
      return "ok";
    case RELUME_ERROR_USAGE:
      return "an argument is out of its range";
    case RELUME_ERROR_IO:
      return "a file could not be read";
    case RELUME_ERROR_INVALID_FILE:
      return "not a valid bake";
    case RELUME_ERROR_FAILED:
      return "the work failed";
    case RELUME_ERROR_UNSUPPORTED:
      return "not supported by this build or machine";
    case RELUME_ERROR_MEMORY:
      return "memory ran out";
  }
  return "unknown status";
}

// ---- Bakes

namespace {

// A bake handle of what `read` gives.
template <class Read>
relume_status makeBake(relume_context* context, relume_bake** bake, const Read& read) {
  return run(context, [&]() -> Status {
    if (bake == nullptr) return nullPointer("bake");
    *bake = nullptr;
    auto made = std::make_unique<relume_bake>();
    Result<relume::Bake> loaded = read();
    if (!loaded) return loaded.error();
    made->host = context->host;
    made->bake = std::move(*loaded);
    *bake = made.release();
    return relume::done();
  });
}

}  // namespace

relume_status relume_bake_load(relume_context* context, const char* path, relume_bake** bake) {
  return makeBake(context, bake, [&]() -> Result<relume::Bake> {
    if (path == nullptr) return nullPointer("path");
    return relume::mapBake(std::filesystem::path(reinterpret_cast<const char8_t*>(path)));
  });
}

relume_status relume_bake_from_memory(relume_context* context, const void* bytes, size_t size,
                                      void (*release)(void* release_user), void* release_user, relume_bake** bake) {
  // Releases whatever happens below, also where nothing is made of the bytes.
  struct Releaser {
    void (*release)(void*);
    void* user;
    ~Releaser() {
      if (release != nullptr) release(user);
    }
  };
  std::unique_ptr<Releaser> releaser(new (std::nothrow) Releaser{release, release_user});
  if (releaser == nullptr) {
    if (release != nullptr) release(release_user);
    return context == nullptr ? RELUME_ERROR_USAGE : fail(*context, RELUME_ERROR_MEMORY, "memory ran out");
  }
  return makeBake(context, bake, [&]() -> Result<relume::Bake> {
    if (bytes == nullptr) return nullPointer("bytes");
    const std::shared_ptr<const void> owner(std::shared_ptr<Releaser>(std::move(releaser)), bytes);
    return relume::parseBake({static_cast<const std::byte*>(bytes), size}, owner);
  });
}

void relume_bake_destroy(relume_bake* bake) { delete bake; }
const char* relume_bake_error(const relume_bake* bake) { return bake == nullptr ? "" : bake->error.text(); }

relume_status relume_bake_get_info(const relume_bake* bake, relume_bake_info* info) {
  return run(bake, [&]() -> Status {
    if (info == nullptr) return nullPointer("info");
    const std::size_t size = info->struct_size;
    if (size <= sizeof size) return usage("info.struct_size is " + std::to_string(size) + ", expected sizeof");
    const relume::Bake& b = bake->bake;
    const relume::CacheGrid& grid = b.caches.grid;
    relume_bake_info out{};
    out.struct_size = size;
    out.surfels = b.surfels.count();
    out.nodes = b.hierarchy.nodeCount();
    out.caches = b.caches.count();
    out.sky_patches = static_cast<unsigned int>(b.hierarchy.skyDirection.size());
    out.instances = static_cast<unsigned int>(b.instances.size());
    out.lightmap_width = b.caches.lightmap.width;
    out.lightmap_height = b.caches.lightmap.height;
    out.luma_bands = b.provenance.lumaBands;
    out.chroma_bands = b.provenance.chromaBands;
    for (int k = 0; k < 3; ++k) {
      out.grid_origin[k] = grid.originWorld[k];
      out.grid_spacing[k] = grid.spacing[k];
      out.grid_resolution[k] = grid.resolution[k];
    }
    std::snprintf(out.scene_hash, sizeof out.scene_hash, "%016llx",
                  static_cast<unsigned long long>(b.provenance.sceneHash));
    std::memcpy(info, &out, std::min(size, sizeof out));
    return relume::done();
  });
}

relume_status relume_bake_lightmap_coordinates(const relume_bake* bake, unsigned int instance, int back_side,
                                               float* coordinates, size_t* corner_count) {
  return run(bake, [&]() -> Status {
    if (corner_count == nullptr) return nullPointer("corner_count");
    const relume::Lightmap& map = bake->bake.caches.lightmap;
    if (instance >= bake->bake.instances.size()) {
      return usage("instance is " + std::to_string(instance) + ", expected less than " +
                   std::to_string(bake->bake.instances.size()));
    }
    const relume::Array<std::uint32_t>& uv = back_side != 0 ? map.backCornerUv : map.cornerUv;
    // Without a light map, or back sides on it, every triangle is lit by the grid.
    const bool mapped = instance < map.parts.size();
    const std::size_t count = mapped ? std::size_t{3} * map.parts[instance].triangleCount : 0;
    if (coordinates == nullptr) {
      *corner_count = count;
      return relume::done();
    }
    if (*corner_count != count) {
      return usage("*corner_count is " + std::to_string(*corner_count) + ", expected " + std::to_string(count));
    }
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t packed = uv.empty() ? relume::kGridLit : uv[map.parts[instance].firstCorner + k];
      const glm::vec2 at = packed == relume::kGridLit ? glm::vec2(-1.0f) : relume::unpackUnorm16x2(packed);
      coordinates[2 * k] = at.x;
      coordinates[2 * k + 1] = at.y;
    }
    return relume::done();
  });
}

const char* relume_bake_instance_name(const relume_bake* bake, unsigned int instance) {
  if (bake == nullptr || instance >= bake->bake.instances.size()) return "";
  return bake->bake.instances[instance].node.c_str();
}

relume_status relume_bake_surfels(const relume_bake* bake, size_t first, size_t count, float* positions,
                                  float* normals) {
  return run(bake, [&]() -> Status {
    const relume::Surfels& surfels = bake->bake.surfels;
    if (first > surfels.count() || count > surfels.count() - first) {
      return usage("surfels " + std::to_string(first) + " and " + std::to_string(count) + " in all from there, of " +
                   std::to_string(surfels.count()));
    }
    if (count == 0) return relume::done();
    if (positions != nullptr) std::memcpy(positions, surfels.positionWorld.data() + first, count * sizeof(glm::vec3));
    if (normals != nullptr) std::memcpy(normals, surfels.normal.data() + first, count * sizeof(glm::vec3));
    return relume::done();
  });
}

// ---- Relighters

relume_status relume_relighter_create(relume_bake* bake, const relume_relighter_desc* desc,
                                      relume_relighter** relighter) {
  return run(bake, [&]() -> Status {
    if (relighter == nullptr) return nullPointer("relighter");
    *relighter = nullptr;
    relume_relighter_desc read{};
    if (desc != nullptr) {
      if (Status ok = readStruct(desc, sizeof read.struct_size + 1, "desc", read); !ok) return ok;
    }
    if (read.backend != RELUME_BACKEND_CPU && read.backend != RELUME_BACKEND_GL)
      return usage("desc.backend is " + std::to_string(static_cast<int>(read.backend)) + ", expected CPU 0 or GL 1");
    relume::RelightOptions options;
    options.backend = read.backend == RELUME_BACKEND_GL ? relume::BackendKind::gl : relume::BackendKind::cpu;
    options.lumaBands = read.luma_bands;
    options.chromaBands = read.chroma_bands;
    options.parallelFor = parallelForOf(bake->host);
    if (read.visibility_glsl != nullptr) options.visibilityGlsl = read.visibility_glsl;
    auto made = std::make_unique<relume_relighter>();
    Result<relume::Relighter> created = relume::Relighter::create(bake->bake, options);
    if (!created) return created.error();
    made->host = bake->host;
    made->relighter.emplace(std::move(*created));
    made->surfels = bake->bake.surfels.count();
    made->skyPatches = bake->bake.hierarchy.skyDirection.size();
    *relighter = made.release();
    return relume::done();
  });
}
void relume_relighter_destroy(relume_relighter* relighter) { delete relighter; }
const char* relume_relighter_error(const relume_relighter* relighter) {
  return relighter == nullptr ? "" : relighter->error.text();
}

void relume_light_setup_default(relume_light_setup* setup) {
  if (setup == nullptr) return;
  *setup = {};
  setup->struct_size = sizeof *setup;
  for (float& channel : setup->emission_scale) channel = 1.0f;
  setup->bounce_scale = 1.0f;
}

relume_status relume_relight(relume_relighter* relighter, const relume_light_setup* setup) {
  return run(relighter, [&]() -> Status {
    relume_light_setup read;
    relume_light_setup_default(&read);
    if (Status ok = readStruct(setup, sizeof read.struct_size + 1, "setup", read); !ok) return ok;
    if (read.lights == nullptr && read.light_count > 0) return nullPointer("setup.lights");
    relighter->lights.clear();
    for (std::size_t i = 0; i < read.light_count; ++i) {
      const relume_light& from = read.lights[i];
      if (from.kind < RELUME_DIRECTIONAL || from.kind > RELUME_SPOT) {
        return usage("light setup: lights[" + std::to_string(i) + "].kind is " +
                     std::to_string(static_cast<int>(from.kind)) + ", expected directional 0, point 1 or spot 2");
      }
      relume::Light light;
      light.kind = static_cast<relume::LightKind>(from.kind);
      light.intensity = vec3(from.intensity);
      light.positionWorld = vec3(from.position);
      light.direction = vec3(from.direction);
      light.range = from.range;
      light.innerConeRad = from.inner_cone_radians;
      light.outerConeRad = from.outer_cone_radians;
      relighter->lights.push_back(light);
    }
    relume::LightSetup frame;
    frame.lights = relighter->lights;
    if (read.visibility != nullptr) {
      // One pointer: std::function allocates nothing for it.
      frame.visibilityBatch = [host = &read](std::uint32_t light, std::span<const glm::vec3> position,
                                             std::span<const glm::vec3> normal, std::span<float> visible) {
        host->visibility(host->visibility_user, light, static_cast<unsigned int>(position.size()), &position[0].x,
                         &normal[0].x, visible.data());
      };
    }
    frame.surfelIrradiance = vectors(read.surfel_irradiance, relighter->surfels);
    frame.surfelEmission = vectors(read.surfel_emission, relighter->surfels);
    frame.skyPatches = vectors(read.sky_patches, relighter->skyPatches);
    frame.skyRadiance = vec3(read.sky_radiance);
    frame.emissionScale = vec3(read.emission_scale);
    frame.bounceScale = read.bounce_scale;
    return relighter->relighter->relight(frame);
  });
}

relume_status relume_reset(relume_relighter* relighter) {
  return run(relighter, [&]() -> Status {
    relighter->relighter->reset();
    return relume::done();
  });
}

relume_status relume_inherit(relume_relighter* relighter, const relume_bake* bake, const relume_relighter* previous) {
  return run(relighter, [&]() -> Status {
    if (bake == nullptr) return nullPointer("bake");
    if (previous == nullptr) return nullPointer("previous");
    return relighter->relighter->inherit(*previous->relighter, bake->bake);
  });
}

// ---- Light

relume_status relume_irradiance_on_lightmap(const relume_relighter* relighter, size_t count, const float* uvs,
                                            const float* normals, const float* geometric_normals, float* irradiance) {
  return run(relighter, [&]() -> Status {
    if (count == 0) return relume::done();
    if (uvs == nullptr) return nullPointer("uvs");
    if (normals == nullptr) return nullPointer("normals");
    if (irradiance == nullptr) return nullPointer("irradiance");
    const float* planes = geometric_normals != nullptr ? geometric_normals : normals;
    return relighter->relighter->irradianceOnLightmap(points(uvs, count), vectors(normals, count),
                                                      vectors(planes, count), vectors(irradiance, count));
  });
}

relume_status relume_irradiance_in_grid(const relume_relighter* relighter, size_t count, const float* positions,
                                        const float* normals, float* irradiance) {
  return run(relighter, [&]() -> Status {
    if (count == 0) return relume::done();
    if (positions == nullptr) return nullPointer("positions");
    if (normals == nullptr) return nullPointer("normals");
    if (irradiance == nullptr) return nullPointer("irradiance");
    return relighter->relighter->irradianceInGrid(vectors(positions, count), vectors(normals, count),
                                                  vectors(irradiance, count));
  });
}

namespace {

// An output of `bytes` as elements of T; a part of one counts as one too many, which no size that is expected has.
template <class T>
std::span<T> elements(void* output, std::size_t bytes) {
  return {static_cast<T*>(output), bytes % sizeof(T) == 0 ? bytes / sizeof(T) : bytes / sizeof(T) + 1};
}

Status checkBytes(const void* output, std::size_t bytes, std::size_t expected) {
  if (bytes != expected) return usage("bytes is " + std::to_string(bytes) + ", expected " + std::to_string(expected));
  if (output == nullptr && bytes > 0) return nullPointer("the output");
  return relume::done();
}

}  // namespace

relume_status relume_irradiance_map(const relume_relighter* relighter, void* rgba16f, size_t bytes) {
  return run(relighter, [&]() -> Status {
    const glm::uvec2 size = relighter->relighter->lightmapSize();
    if (Status ok = checkBytes(rgba16f, bytes, std::size_t{8} * size.x * size.y); !ok) return ok;
    return relighter->relighter->irradianceMap(elements<std::uint16_t>(rgba16f, bytes));
  });
}

relume_status relume_irradiance_map_l1(const relume_relighter* relighter, void* rgba16f, size_t bytes) {
  return run(relighter, [&]() -> Status {
    const glm::uvec2 size = relighter->relighter->lightmapSize();
    if (Status ok = checkBytes(rgba16f, bytes, std::size_t{32} * size.x * size.y); !ok) return ok;
    return relighter->relighter->irradianceMapL1(elements<std::uint16_t>(rgba16f, bytes));
  });
}

relume_status relume_ambient_volume(const relume_relighter* relighter, const float origin[3], const float spacing[3],
                                    const unsigned int resolution[3], float* cubes, size_t bytes) {
  return run(relighter, [&]() -> Status {
    if (origin == nullptr) return nullPointer("origin");
    if (spacing == nullptr) return nullPointer("spacing");
    if (resolution == nullptr) return nullPointer("resolution");
    if (cubes == nullptr && bytes > 0) return nullPointer("cubes");
    const relume::AmbientVolume volume{vec3(origin), vec3(spacing), {resolution[0], resolution[1], resolution[2]}};
    return relighter->relighter->ambientVolume(volume, elements<glm::vec3>(cubes, bytes));
  });
}

unsigned int relume_coefficients_per_cache(const relume_relighter* relighter) {
  return relighter == nullptr ? 0 : static_cast<unsigned int>(relighter->relighter->coefficientsPerCache());
}

relume_status relume_cache_coefficients(const relume_relighter* relighter, float* coefficients, size_t bytes) {
  return run(relighter, [&]() -> Status {
    const std::vector<float> all = relighter->relighter->cacheCoefficients();
    if (Status ok = checkBytes(coefficients, bytes, all.size() * sizeof(float)); !ok) return ok;
    std::copy(all.begin(), all.end(), coefficients);
    return relume::done();
  });
}

// ---- OpenGL

const char* relume_gl_resolve_glsl(const relume_relighter* relighter) {
  const relume::GlResolve* gl = relighter == nullptr ? nullptr : relighter->relighter->gl();
  return gl == nullptr ? nullptr : gl->glsl().c_str();
}

relume_status relume_gl_bind_resolve(const relume_relighter* relighter) {
  return run(relighter, [&]() -> Status {
    const relume::GlResolve* gl = relighter->relighter->gl();
    if (gl == nullptr) return usage("this relighter has no OpenGL: RELUME_BACKEND_GL was not asked for");
    gl->bind();
    return relume::done();
  });
}

unsigned int relume_gl_surfel_program(const relume_relighter* relighter) {
  const relume::GlResolve* gl = relighter == nullptr ? nullptr : relighter->relighter->gl();
  return gl == nullptr ? 0 : gl->surfelProgram();
}
