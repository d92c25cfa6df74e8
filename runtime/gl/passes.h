// SPDX-License-Identifier: MIT
// One function a pass: binds what shaders/shared/layout.h says and dispatches. No barriers here: they are the frame
// order's (gl_backend.cpp).
#pragma once

#include "relume/lights.h"
#include "runtime/gl/program.h"
#include "runtime/gl/upload.h"
#include "runtime/shared/resolve_defines.h"
#include "shaders/shared/layout.h"

#include <glm/vec4.hpp>

#include <memory_resource>

namespace relume::gl {

// Threads that share a cache in light_caches.comp, and caches a work group.
struct CacheGroup {
  int lanes = 32, caches = 2;
};

CacheGroup chooseCacheGroup(GroupThreads threads, const CacheBands& bands);

// Definitions of light_caches.comp: bands, link kind, group, GpuBake::nodeSteps, and whether the caches are the light
// map's.
std::vector<std::pair<std::string, std::string>> cacheDefines(const CacheBands& bands, LinkKind kind,
                                                              const CacheGroup& group, int nodeSteps = -1,
                                                              bool map = false);

// Uniform locations are looked up once. All functions take those of the context that is current, which made the pass.
class BouncePass {
 public:
  static Result<BouncePass> create(const Functions& gl, const CacheBands& bands);
  // (2), first half: what tilted and gridded surfels receive. False when there are none: nothing was dispatched.
  bool run(const Functions& gl, const GpuBake& gpu) const;

 private:
  struct Kernel {
    Program program;
    GLint first = -1, end = -1;
  };
  static Result<Kernel> makeKernel(const Functions& gl, std::vector<std::pair<std::string, std::string>> defines,
                                   bool grid);
  static bool runKernel(const Functions& gl, const Kernel& kernel, GLuint first, GLuint end);

  Kernel tilted_, gridded_;
};

class SurfelPass {
 public:
  explicit SurfelPass(std::pmr::memory_resource* memory) : packed_(memory), hostColors_(memory) {}
  static Result<SurfelPass> create(const Functions& gl, std::string_view visibilityGlsl,
                                   std::pmr::memory_resource* memory);
  // Memory of run(): the scratch arrays, and the surfels' order where the host hands over light of each.
  void reserve(const Functions& gl, GpuBake& gpu, const Bake& bake, const LightSetup& setup);
  // (2), second half. bounce: whether last frame's light may be read. What drives materials is in GpuBake::emission.
  void run(const Functions& gl, GpuBake& gpu, const Bake& bake, const LightSetup& setup, bool bounce);
  GLuint program() const { return program_.get(); }
  // [vec4 each] irradiance of the surfels for the host's shader to write; made, all zero, when it is first asked for.
  GLuint lightBuffer(const Functions& gl, const GpuBake& gpu);

 private:
  Program program_;
  Buffer lights_, host_, surfelLight_;
  std::pmr::vector<RelumeLight> packed_;  // of the frame; these keep their memory
  std::pmr::vector<glm::vec4> hostColors_;
  GLint litOnGpu_ = -1, emits_ = -1, boxOrigin_ = -1, boxStep_ = -1, flatEnd_ = -1, surfelEnd_ = -1, senderEnd_ = -1,
        lightCount_ = -1, mapSize_ = -1, hostOffset_ = -1, emissionScale_ = -1, skyRadiance_ = -1, bounceScale_ = -1;
};

class PullPass {
 public:
  static Result<PullPass> create(const Functions& gl, const PullGroup& group);
  // (3) `barrier` runs between the two dispatches.
  void run(const Functions& gl, const GpuBake& gpu, void (*barrier)(const Functions& gl)) const;

 private:
  Program groups_, top_;
  GLint firstGroup_ = -1, firstRound_ = -1, endRound_ = -1;
};

class CachePass {
 public:
  static Result<CachePass> create(const Functions& gl, const CacheBands& bands, LinkKind kind, int nodeSteps,
                                  GroupThreads threads);
  // (4) and (5)
  void run(const Functions& gl, const GpuBake& gpu, const Links& links) const;

 private:
  // A program for the caches of the grid, one for those of the light map, which has fewer bands.
  struct Kernel {
    Program program;
    CacheGroup group;
    GLint firstCache = -1, endCache = -1, wordOffset = -1, halfOffset = -1, firstLink = -1, shapeStride = -1,
          gridLinks = -1, firstMapCache = -1, mapWidth = -1;
  };
  static Result<Kernel> makeKernel(const Functions& gl, const CacheBands& bands, LinkKind kind, int nodeSteps,
                                   GroupThreads threads, bool map);
  void runBatch(const Functions& gl, const Kernel& kernel, const GpuBake& gpu, const Links& links,
                const LinkBatch& batch) const;

  Kernel grid_, map_;
};

// (5a): fills the grid's texture, where there is one.
class GridTexturePass {
 public:
  static Result<GridTexturePass> create(const Functions& gl, const CacheBands& bands);
  // `barrier` runs between the two dispatches.
  void run(const Functions& gl, const GpuBake& gpu, const GridTexture& texture,
           void (*barrier)(const Functions& gl)) const;

 private:
  struct Kernel {
    Program program;
    GLint first = -1, end = -1, resolution = -1;
  };
  static Result<Kernel> makeKernel(const Functions& gl, const CacheBands& bands, bool texels);
  static void runKernel(const Functions& gl, const Kernel& kernel, GLuint count);

  Kernel vectors_, texels_;
};

// The inputs of (6) on the slots of layout.h.
void bindResolve(const Functions& gl, const GpuBake& gpu);
// The textures of the grid on theirs.
void bindGridTextures(const Functions& gl, const GpuBake& gpu);

}  // namespace relume::gl
