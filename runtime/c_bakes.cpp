// SPDX-License-Identifier: MIT
// relume.h over the C++ API: contexts and bakes.
#include "runtime/c_handles.h"

#include "formats/decimal.h"
#include "formats/pack.h"
#include "relume/bake_file.h"

#include <cstddef>
#include <filesystem>
#include <span>

namespace {

using relume::Result;
using relume::Status;
using namespace relume::c;

std::string wrongVersion(unsigned int version) {
  return "relume_context_desc.api_version is " + std::to_string(version) + ", this library's is " +
         std::to_string(RELUME_API_VERSION) + ": set it to RELUME_API_VERSION, with headers of the library's release";
}

}  // namespace

// ---- Contexts

relume_status relume_context_create(const relume_context_desc* desc, relume_context** context) {
  if (context == nullptr) return RELUME_ERROR_USAGE;
  *context = nullptr;
  if (desc == nullptr || desc->struct_size < offsetof(relume_context_desc, log)) return RELUME_ERROR_USAGE;
  relume_context_desc read{};
  std::memcpy(&read, desc, std::min(desc->struct_size, sizeof read));
  const auto refuse = [&read](relume_status status, const char* text) {
    try {
      if (read.log != nullptr) read.log(read.user, RELUME_ERROR, text);
    } catch (...) {  // a log that throws: the status has to do
    }
    return status;
  };
  try {
    if (read.api_version != RELUME_API_VERSION)
      return refuse(RELUME_ERROR_USAGE, wrongVersion(read.api_version).c_str());
    if ((read.allocate == nullptr) != (read.deallocate == nullptr)) {
      return refuse(RELUME_ERROR_USAGE,
                    "relume_context_desc has one of allocate and deallocate, expected both or neither");
    }
    const HostMemory memory(read.user, read.allocate, read.deallocate);
    const auto host =
        std::allocate_shared<Host>(HostAllocator<Host>(memory), Host{read.user, read.log, read.parallel_for, memory});
    *context = makeHandle<relume_context>(host).release();
    return RELUME_OK;
  } catch (const std::bad_alloc& e) {
    return refuse(RELUME_ERROR_MEMORY, relume::outOfMemory(e).message.c_str());
  } catch (...) {
    return refuse(RELUME_ERROR_FAILED, "an exception of the host's callbacks");
  }
}
void relume_context_destroy(relume_context* context) { destroyHandle(context); }
const char* relume_context_error(const relume_context* context) {
  return context == nullptr ? "" : context->error.text();
}

unsigned int relume_api_version(void) { return RELUME_API_VERSION; }
const char* relume_version(void) { return RELUME_VERSION; }
const char* relume_status_text(relume_status status) {
  switch (numberOf(status)) {
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

// A bake handle of what read(memory) gives.
template <class Read>
Status makeBake(const relume_context& context, relume_bake** bake, const Read& read) {
  Result<relume::Bake> loaded = read(&context.host->memory);
  if (!loaded) return loaded.error();
  *bake = makeHandle<relume_bake>(context.host, std::move(*loaded)).release();
  return relume::done();
}

}  // namespace

relume_status relume_bake_load(relume_context* context, const char* path, relume_bake** bake) {
  return runToMake(context, bake, "bake", [&]() -> Status {
    return makeBake(*context, bake, [&](std::pmr::memory_resource* memory) -> Result<relume::Bake> {
      if (path == nullptr) return nullPointer("path");
      return relume::mapBake(std::filesystem::path(reinterpret_cast<const char8_t*>(path)), relume::Checksums::verify,
                             memory);
    });
  });
}

relume_status relume_bake_from_memory(relume_context* context, const void* bytes, size_t size,
                                      void (*release)(void* release_user), void* release_user, relume_bake** bake) {
  const auto releaseBytes = [release, release_user](const void*) {
    if (release != nullptr) release(release_user);
  };
  if (context == nullptr || bake == nullptr) releaseBytes(bytes);  // refused before anything owns them
  return runToMake(context, bake, "bake", [&]() -> Status {
    // Releases whatever happens below, also where there is no memory for the owner itself.
    const std::shared_ptr<const void> owner(bytes, releaseBytes,
                                            std::pmr::polymorphic_allocator<std::byte>(&context->host->memory));
    return makeBake(*context, bake, [&](std::pmr::memory_resource* memory) -> Result<relume::Bake> {
      if (bytes == nullptr) return nullPointer("bytes");
      return relume::parseBake({static_cast<const std::byte*>(bytes), size}, owner, relume::Checksums::verify, memory);
    });
  });
}

void relume_bake_destroy(relume_bake* bake) { destroyHandle(bake); }
const char* relume_bake_error(const relume_bake* bake) { return bake == nullptr ? "" : bake->error.text(); }

relume_status relume_bake_get_info(const relume_bake* bake, relume_bake_info* info) {
  return run(bake, [&]() -> Status {
    const relume::Bake& b = bake->bake;
    const relume::CacheGrid& grid = b.caches.grid;
    relume_bake_info out{};
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
    const std::string hash = relume::hexadecimal(b.provenance.sceneHash);
    hash.copy(out.scene_hash, sizeof out.scene_hash - 1);
    return fillStruct(info, out);
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
      const std::uint32_t packed =
          uv.empty() ? relume::kGridLit : uv[static_cast<std::size_t>(map.parts[instance].firstCorner) + k];
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

unsigned int relume_bake_drivable_count(const relume_bake* bake) {
  return bake == nullptr ? 0 : static_cast<unsigned int>(bake->bake.emitters.materials.size());
}

const char* relume_bake_drivable_name(const relume_bake* bake, unsigned int material) {
  if (material >= relume_bake_drivable_count(bake)) return "";
  return bake->bake.emitters.materials[material].name.c_str();
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

relume_status relume_bake_sky_directions(const relume_bake* bake, float* directions) {
  return run(bake, [&]() -> Status {
    const auto& patches = bake->bake.hierarchy.skyDirection;
    if (patches.empty()) return relume::done();
    if (directions == nullptr) return nullPointer("directions");
    std::memcpy(directions, patches.data(), patches.size() * sizeof(glm::vec3));
    return relume::done();
  });
}
