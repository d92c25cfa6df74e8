// SPDX-License-Identifier: MIT
// The passes of a level as data: what include/relume/gpu_passes.h shows to hosts and the OpenGL backend runs. Buffers,
// images, programs and bindings are decided when it is made; frame() then says what a frame copies and dispatches. All
// barriers, orders and sizes are here.
#pragma once

#include "relume/gpu_passes.h"
#include "runtime/passes/pack_links.h"
#include "runtime/passes/pack_senders.h"
#include "runtime/passes/programs.h"
#include "runtime/shared/driven_emission.h"
#include "runtime/shared/grid_texture.h"
#include "runtime/shared/look_turns.h"
#include "runtime/shared/memory.h"

#include <glm/vec4.hpp>

#include <memory_resource>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace relume::gpu {

enum BufferIndex : std::uint32_t {
  kSurfelWords,
  kEmission,
  kLeafNode,
  kEmitters,
  kGridded,
  kNodes,  // [Size nodes] radiosity (runtime/shared/pack_color.h)
  kPullNode,
  kPullRuns,
  kPullRounds,
  kRows,
  kLinks,
  kLinkShape,
  kCacheLight,  // coefficients of the caches before the light map's
  kMapTexels,
  kTexelColors,
  kGrid,
  kResolve,
  kLights,
  kHost,
  kSurfelLight,
  kSurfelBox,
  kGridFactors,  // these three where there is a grid's texture
  kGridShares,
  kGridVectors,
  kSenderPoints,  // the last four where parts may move
  kMovingParts,
  kMovingShapes,
  kMovingLight,
};

enum ImageIndex : std::uint32_t { kMapY, kMapCo, kMapCg, kMapNormal };

class FramePlan {
 public:
  // The bake has passed checkBake(); its arrays are kept until forgetContents(), and its hierarchy, caches and surfels
  // for ever. images: declared, by drivable material. movingParts: of a frame, at most. movingLag: RelightOptions.
  // unsupported: more than the device holds. Throws std::bad_alloc.
  static Result<Owned<FramePlan>> create(const Bake& bake, const GridTexture& texture, const CacheBands& bands,
                                         const ImageSizes& images, const GpuDevice& device,
                                         std::pmr::memory_resource* memory, std::uint32_t movingParts = 0,
                                         std::uint32_t movingLag = 1);
  // What create() begins with.
  FramePlan(const Bake& bake, const CacheBands& bands, const ImageSizes& images, const GpuDevice& device,
            std::pmr::memory_resource* memory);

  std::span<const GpuBuffer> buffers() const { return buffers_; }
  std::span<const GpuImage> images() const { return images_; }
  std::span<const ProgramSource> programs() const { return programs_; }
  std::span<const GpuBindingSet> bindingSets() const { return sets_; }
  std::span<const GpuBinding> resolveBindings() const { return resolve_; }
  std::span<const GpuBinding> surfelBindings() const { return surfelBindings_; }
  void forgetContents();

  // First image of the grid's texture: vectors, chroma, open cells. Nothing where there is none.
  std::optional<std::uint32_t> gridImages() const { return gridImages_; }
  // The image of a drivable material; nothing where none was declared.
  std::optional<std::uint32_t> drivenImage(std::uint32_t material) const;
  std::uint32_t surfelSlots() const { return surfelEnd_; }
  // surfels.glsl for this level in OpenGL.
  Result<std::string> surfelGlsl() const;
  // Bytes that are kept on the host's side: the surfels' order, and what drives materials.
  std::size_t orderBytes() const { return surfelOrder_.size() * sizeof(surfelOrder_[0]); }
  std::size_t drivenBytes() const { return driven_.bytes(); }
  std::size_t movingBytes() const { return sizeof(std::uint32_t) * moving_.shapeWord.capacity(); }
  std::uint32_t movingParts() const { return moving_.most; }
  // [byte] Shared memory of a work group that the programs cut by GpuDevice::sharedBytes take at most.
  std::size_t sharedBytes() const { return sharedBytes_; }

  // unsupported: moving shapes, lights or colours of the host's that are too many for one buffer.
  Status checkShapes(const LightSetup& setup) const;
  Status checkHost(const LightSetup& setup) const;
  // Take the memory of frame(setup). Throws std::bad_alloc.
  void reserve(const LightSetup& setup);
  // `setup` has passed checkSetup(), checkEmissions() and reserve().
  GpuFrame frame(const LightSetup& setup);
  // MaterialEmission::texture that a dispatch of the last frame reads in place of its set's image; 0 = none.
  std::uint32_t hostTexture(std::size_t dispatch) const { return hostTextures_[dispatch]; }
  // The grid's texture of the light that the caches have, alone.
  GpuFrame fill();
  // After a frame that was not run, its shapes are not on the device, nor is its emission.
  void reset() {
    lit_ = false;
    drove_ = everDrove_;
    if (moving_.turns) moving_.turns->forget();
    moving_.isPacked = moving_.shapes != 0;
  }

 private:
  struct Batch {
    std::uint32_t set = 0;
    LinkBatch links;
    std::uint32_t movingSet = 0, occludeSet = 0;  // of frames in which parts move
  };
  struct Indices {
    std::uint32_t drive = 0, surfels = 0, tilted = 0, gridded = 0, pull = 0, pullTop = 0, vectors = 0, texels = 0;
  };

  // What moving parts need. (plan_moving.cpp)
  struct Moving {
    explicit Moving(std::pmr::memory_resource* memory)
        : part(memory), sphere(memory), shapeWord(memory), firstWord(memory) {}

    std::uint32_t most = 0;                // parts of a frame; 0 = the rest is not there
    std::uint32_t points = 0, places = 0;  // SenderWords
    std::uint32_t firstLight = 0;          // vec4 of the parts' light
    std::uint32_t firstView = 0;           // vec4 of their views' light
    std::optional<LookTurns> turns;
    std::uint32_t lightSet = 0, cachesPerGroup = 1;
    std::pmr::vector<gl::RelumePart> part;  // of the frame; these keep their memory
    std::pmr::vector<PartSphere> sphere;
    std::pmr::vector<std::uint32_t> shapeWord, firstWord;
    std::uint64_t shapes = 0;  // MovingShapes::id() of what is packed
    bool isPacked = false;     // and is not yet on the device
  };

  Status checkSizes() const;
  void makeBuffers(const GridTexture& texture, std::uint32_t movingParts, std::uint32_t movingLag);
  Status makeLinks();
  void makePull(GroupThreads threads);
  void makeImages(const GridTexture& texture);
  void makeSets(GroupThreads threads, const GridTexture& texture);
  void makeDriveSets();
  void addBuffer(BufferIndex index, const char* name, GpuUse use, std::span<const std::byte> contents,
                 std::size_t bytes = 0);
  template <class T>
  std::span<const std::byte> keep(std::pmr::vector<T>&& array);
  std::uint32_t addProgram(ProgramSource source);
  std::uint32_t addSet(std::uint32_t program, std::initializer_list<std::span<const GpuBinding>> bindings);

  // A batch's RELUME_BATCH_PARAMETERS.
  template <class Parameters>
  Parameters batchParameters(const LinkBatch& links) const;
  // Add dispatches that cover [first, end) of what `begin` and `stop` say, `perGroup` to a group.
  template <class Parameters>
  void dispatch(GpuPass pass, std::uint32_t set, Parameters parameters, std::uint32_t Parameters::*begin,
                std::uint32_t first, std::uint32_t end, std::uint32_t perGroup, bool waits, std::uint32_t texture = 0);
  bool addEmission(const LightSetup& setup, bool waits);
  bool addBounce(bool waits);
  void addSurfels(const LightSetup& setup, bool bounces, bool waits);
  void addPull();
  void makeGridBuffers(const GridTexture& texture);
  void makeMovingBuffers(std::uint32_t parts, std::uint32_t lag);
  void reserveMoving(const LightSetup& setup);
  bool addMoving(const LightSetup& setup, bool bounces);
  void addCaches(bool moves);
  void addFill(bool waits);

  Bake bake_;  // shares the arrays
  CacheBands bands_;
  GpuDevice device_;
  std::pmr::memory_resource* memory_;

  std::pmr::vector<GpuBuffer> buffers_;
  std::pmr::vector<GpuImage> images_;
  std::pmr::vector<ProgramSource> programs_;
  std::pmr::vector<GpuBindingSet> sets_;
  std::pmr::vector<std::size_t> setEnd_;  // [Size sets] where their bindings end
  std::pmr::vector<GpuBinding> bindings_, resolve_, surfelBindings_;
  // What contents lie in.
  struct Kept {
    virtual ~Kept() = default;
  };
  std::pmr::vector<Owned<Kept>> kept_;

  Indices set_;
  std::pmr::vector<std::uint32_t> driveSets_;     // [Size materials] set that reads the material's image, or set_.drive
  std::pmr::vector<std::uint32_t> drivenImages_;  // [Size materials] kRelumeNone = none
  std::pmr::vector<Batch> batches_;
  std::uint32_t shapeStride_ = 0, shapedLinks_ = 0;  // RELUME_CACHE_PARAMETERS
  std::uint32_t gridCachesPerGroup_ = 1, mapCachesPerGroup_ = 1;
  std::size_t sharedBytes_ = 0;
  std::uint32_t flatEnd_ = 0, tiltedEnd_ = 0, surfelEnd_ = 0, senderEnd_ = 0;
  gl::RelumeSurfels surfelBox_{};
  bool emits_ = false;
  std::uint32_t pullGroupCount_ = 0, pullRoundCount_ = 0;
  std::uint32_t firstMapCache_ = 0;
  std::optional<std::uint32_t> gridImages_;
  std::uint32_t vectorCaches_ = 0, texelCount_ = 0;
  glm::uvec3 textureResolution_{0};

  Moving moving_;
  DrivenEmission driven_;
  bool drove_ = false;      // whether the emission on the device may not be the baked one
  bool everDrove_ = false;  // whether any frame has driven materials
  bool lit_ = false;        // whether the caches hold a frame
  std::pmr::vector<std::uint32_t> surfelOrder_, skyOrder_;
  std::pmr::vector<gl::RelumeLight> lights_;  // of the frame; these keep their memory
  std::pmr::vector<glm::vec4> host_;
  std::pmr::vector<GpuUpload> uploads_;
  std::pmr::vector<GpuDispatch> dispatches_;
  std::pmr::vector<std::uint32_t> hostTextures_;  // [Size dispatches]
};

}  // namespace relume::gpu
