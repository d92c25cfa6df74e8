// SPDX-License-Identifier: MIT
// What a backend of the runtime does. cpu/ and gl/ implement it; the relighter checks what comes in, owns one of them
// and calls it once a frame.
#pragma once

#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/shared/bands.h"
#include "runtime/shared/driven_emission.h"
#include "runtime/shared/grid_texture.h"
#include "runtime/shared/memory.h"
#include "runtime/shared/resolve.h"

#include <cstddef>
#include <memory_resource>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// Whether this build has LightSetup::movingParts: pages that do not ask for them do not download what they need
// (bindings/js/CMakeLists.txt).
#if defined(__EMSCRIPTEN__) && !defined(RELUME_WITH_MOVING_PARTS)
inline constexpr bool kHasMovingParts = false;
#else
inline constexpr bool kHasMovingParts = true;
#endif

class Backend {
 public:
  Backend() = default;
  Backend(const Backend&) = delete;
  Backend& operator=(const Backend&) = delete;
  virtual ~Backend() = default;

  // What of a frame's textures, moving shapes, lights and arrays the backend cannot read: usage, unsupported.
  virtual Status checkTextures(const LightSetup& setup) const = 0;
  // Take the memory that relight(setup) needs beyond what the frames before it needed. Throws std::bad_alloc, and has
  // changed no light then. The contents of the spans are not read.
  virtual void reserve(const LightSetup& setup) = 0;
  // One frame, steps 2 to 5 (relighter.h). `setup` has passed checkSetup(), checkTextures() and reserve(): no memory is
  // taken. Where it has both surfelEmission and materialEmissions, the light of these materials is added to that of the
  // surfels.
  virtual void relight(const LightSetup& setup) = 0;
  // Forget last frame's light.
  virtual void reset() = 0;

  // Of the last frame, valid until the next one; nothing is guessed. GL: read back once a frame.
  virtual CacheLight light() const = 0;
  // [W/m²] [Size nodes] radiosity of the last frame. GL: reads back.
  virtual std::vector<glm::vec3> nodeRadiosity() const = 0;
  virtual std::vector<PassTime> passTimes() const = 0;
  virtual std::vector<std::pair<std::string, std::size_t>> bufferSizes() const = 0;

  // The grid's texture; null where none is kept: it was not asked for, or is beyond a limit.
  virtual const GridTexture* gridTexture() const = 0;
  // [Size kTexelFloats * 6 * points] of the last frame, valid until the next one. GL: read back once a frame.
  virtual std::span<const float> gridTexels() const = 0;

  // What only OpenGL has; null on the CPU.
  virtual const GlResolve* gl() const { return nullptr; }
};

// What a backend is made for: the bake's recommendation and the host's wishes, settled.
struct BackendRequest {
  CacheBands bands;
  const RelightOptions& options;
  std::pmr::memory_resource* memory;  // [not null] must outlive the backend
  const ImageSizes& images;           // that were declared, by drivable material
  const PackedCaches& caches;         // of the bake; must outlive the backend
};

// The grid's texture that was asked for. maxSide: GridTextureLimits. Throws std::bad_alloc.
inline GridTexture makeGridTexture(const BackendRequest& request, std::uint32_t maxSide = 0) {
  if (!request.options.gridTexture) return GridTexture(request.memory);
  return makeGridTexture(request.caches, {request.options.gridTrust, request.options.gridTextureBytes, maxSide},
                         request.options.parallelFor, request.memory);
}

// Backends keep alive what they read of the bake's arrays every frame. The bake has passed checkBake().
// Both throw std::bad_alloc.
// usage: the processor lacks the instruction set that was asked for.
Result<Owned<Backend>> makeCpuBackend(const Bake& bake, const BackendRequest& request);
// usage: no getProcAddress; unsupported: no OpenGL 4.3, a function of it missing, buffers too large, or a build without
// OpenGL; failed: a shader's log.
Result<Owned<Backend>> makeGlBackend(const Bake& bake, const BackendRequest& request);

}  // namespace relume
