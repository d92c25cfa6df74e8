// SPDX-License-Identifier: MIT
// relume.h over the C++ API: contexts and bakes.
#include "runtime/c_handles.h"

#include "formats/pack.h"
#include "relume/bake_file.h"

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <span>

namespace {

using relume::Result;
using relume::Status;
using namespace relume::c;

}  // namespace

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
