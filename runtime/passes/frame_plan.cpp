// SPDX-License-Identifier: MIT
// See frame_plan.h: what is decided when the plan is made. What a frame adds is in plan_frame.cpp.
#include "runtime/passes/frame_plan.h"

#include "formats/decimal.h"
#include "runtime/passes/pack_textures.h"
#include "runtime/passes/pull_schedule.h"
#include "runtime/shared/pack_grid.h"
#include "runtime/shared/shader_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace relume::gpu {
namespace {

using gl::kRelumeNone;

constexpr std::size_t kSmallestBuffer = 16;

template <class T>
std::span<const std::byte> bytesOf(const T& array) {
  return std::as_bytes(std::span(array.data(), array.size()));
}

GpuBinding uniform(std::uint32_t slot, BufferIndex buffer) {
  GpuBinding binding;
  binding.binding = slot;
  binding.kind = GpuBindingKind::uniformBuffer;
  binding.resource = buffer;
  return binding;
}

GpuBinding storage(std::uint32_t slot, BufferIndex buffer, bool isWritten = false) {
  GpuBinding binding;
  binding.binding = slot;
  binding.isWritten = isWritten;
  binding.resource = buffer;
  return binding;
}

// Storage images follow the buffers' slots.
GpuBinding stored(std::uint32_t unit, std::uint32_t image) {
  GpuBinding binding;
  binding.binding = RELUME_VULKAN_IMAGES + unit;
  binding.kind = GpuBindingKind::storageImage;
  binding.isWritten = true;
  binding.resource = image;
  return binding;
}

GpuBinding sampled(std::uint32_t unit, std::uint32_t image, GpuSampler sampler = GpuSampler::linear) {
  GpuBinding binding;
  binding.binding = unit;
  binding.kind = GpuBindingKind::sampledImage;
  binding.sampler = sampler;
  binding.resource = image;
  return binding;
}

Error tooLarge(const std::string& what) { return Error{ErrorCode::unsupported, what}; }

std::uint32_t levelsOf(const glm::uvec2& size) {
  std::uint32_t levels = 1;
  while (std::max(size.x, size.y) >> levels != 0) ++levels;
  return levels;
}

}  // namespace

FramePlan::FramePlan(const Bake& bake, const CacheBands& bands, const ImageSizes& images, const GpuDevice& device,
                     std::pmr::memory_resource* memory)
    : bake_(bake),
      bands_(bands),
      device_(device),
      memory_(memory),
      buffers_(memory),
      images_(memory),
      programs_(memory),
      sets_(memory),
      setEnd_(memory),
      bindings_(memory),
      resolve_(memory),
      surfelBindings_(memory),
      kept_(memory),
      driveSets_(memory),
      drivenImages_(images.size(), kRelumeNone, memory),
      batches_(memory),
      moving_(memory),
      driven_(bake.emitters, images, memory),
      surfelOrder_(memory),
      skyOrder_(memory),
      lights_(memory),
      host_(memory),
      uploads_(memory),
      dispatches_(memory),
      hostTextures_(memory) {}

template <class T>
std::span<const std::byte> FramePlan::keep(std::pmr::vector<T>&& array) {
  struct Array final : Kept {
    explicit Array(std::pmr::vector<T>&& from) : elements(std::move(from)) {}
    std::pmr::vector<T> elements;
  };
  Owned<Array> kept = makeOwned<Array>(memory_, std::move(array));
  const std::span<const std::byte> bytes = bytesOf(kept->elements);
  kept_.push_back(std::move(kept));
  return bytes;
}

void FramePlan::addBuffer(BufferIndex index, const char* name, GpuUse use, std::span<const std::byte> contents,
                          std::size_t bytes) {
  if (buffers_.size() <= index) buffers_.resize(index + 1);
  bytes = std::max({bytes, contents.size(), kSmallestBuffer});
  buffers_[index] = {name, use, false, (bytes + 3) / 4 * 4, contents};
}

std::uint32_t FramePlan::addProgram(ProgramSource source) {
  programs_.push_back(std::move(source));
  return static_cast<std::uint32_t>(programs_.size() - 1);
}

std::uint32_t FramePlan::addSet(std::uint32_t program, std::initializer_list<std::span<const GpuBinding>> bindings) {
  for (const std::span<const GpuBinding> each : bindings) bindings_.insert(bindings_.end(), each.begin(), each.end());
  // Bindings move while sets are added: create() gives the sets theirs.
  sets_.push_back({program, {}});
  setEnd_.push_back(bindings_.size());
  return static_cast<std::uint32_t>(sets_.size() - 1);
}

Status FramePlan::checkSizes() const {
  const Hierarchy& hierarchy = bake_.hierarchy;
  if (hierarchy.nodeCount() > kMaxPulledNodes) {
    return tooLarge("the hierarchy has " + std::to_string(hierarchy.nodeCount()) +
                    " nodes, the passes of a GPU take at most " + std::to_string(kMaxPulledNodes));
  }
  const std::size_t largest =
      std::max({firstMapCache_ * cacheBytes(bands_), sizeof(SurfelWords) * bake_.surfels.count(),
                hierarchy.nodeCount() * sizeof(std::uint32_t),
                (bake_.caches.lightmap.cache.size() + bake_.caches.count() + 1) * sizeof(std::uint32_t)});
  if (largest > device_.storageBytes) {
    return tooLarge("a buffer of " + std::to_string(largest) + " bytes is needed, this device binds at most " +
                    std::to_string(device_.storageBytes));
  }
  const Lightmap& map = bake_.caches.lightmap;
  if (map.width > device_.imageSide || map.height > device_.imageSide) {
    return tooLarge("the light map of " + std::to_string(map.width) + " x " + std::to_string(map.height) +
                    " texels exceeds this device's largest image, " + std::to_string(device_.imageSide));
  }
  return done();
}

Status FramePlan::makeLinks() {
  // A unit of repacked links has 16 bytes.
  const std::size_t alignment = std::max<std::size_t>(device_.storageAlignment, 16);
  Result<LinkArrays> made = packLinks(bake_.links, firstMapCache_, device_.storageBytes, alignment, memory_);
  if (!made) return made.error();
  const bool repacked = made->nodeSteps >= 0;
  const auto take = [&](std::pmr::vector<std::uint32_t>& own, std::span<const std::byte> baked) {
    return repacked ? keep(std::move(own)) : baked;
  };
  addBuffer(kRows, "link rows", GpuUse::constant, take(made->repackedRows, made->rows));
  addBuffer(kLinks, "links", GpuUse::constant, take(made->repackedWords, made->links));
  addBuffer(kLinkShape, "link shapes", GpuUse::constant, take(made->transfers, made->shape));

  shapeStride_ = bake_.links.bands * bake_.links.bands;
  shapedLinks_ = static_cast<std::uint32_t>(bake_.links.shape.size());
  const GroupThreads threads = device_.isSerial ? GroupThreads::serial : GroupThreads::parallel;
  std::array<std::uint32_t, 2> program{kRelumeNone, kRelumeNone}, movingProgram = program;
  std::uint32_t occludeProgram_ = kRelumeNone;
  if (moving_.most > 0) {
    const OccludeGroup group = chooseOccludeGroup(threads, moving_.most);
    moving_.cachesPerGroup = group.caches;
    occludeProgram_ = addProgram(occludeProgram(bake_.links.kind, group, made->nodeSteps));
  }
  for (const LinkBatch& batch : made->batches) {
    const bool map = batch.firstCache >= firstMapCache_;
    const CacheBands bands = map ? bands_.ofMap() : bands_;
    const CacheGroup group = chooseCacheGroup(threads, bands, device_.sharedBytes);
    sharedBytes_ = std::max(sharedBytes_, sharedBytesOf(group, bands));
    (map ? mapCachesPerGroup_ : gridCachesPerGroup_) = static_cast<std::uint32_t>(group.caches);
    std::uint32_t& own = program[map ? 1 : 0];
    if (own == kRelumeNone) own = addProgram(cacheProgram(bands_, bake_.links.kind, group, made->nodeSteps, map));
    GpuBinding links = storage(RELUME_SLOT_LINKS, kLinks), shape = storage(RELUME_SLOT_LINK_SHAPE, kLinkShape);
    // Bindings stay inside the buffers. Irradiance links past the grid's have no shape, and read none.
    links.offset = batch.linkStart;
    links.bytes = std::min(batch.linkBytes, buffers_[kLinks].bytes - links.offset);
    shape.offset = batch.shapeStart < buffers_[kLinkShape].bytes ? batch.shapeStart : 0;
    shape.bytes = std::min(batch.shapeBytes, buffers_[kLinkShape].bytes - shape.offset);
    const std::array<GpuBinding, 4> common{storage(RELUME_SLOT_ROWS, kRows), links, shape,
                                           storage(RELUME_SLOT_NODES, kNodes)};
    const std::array<GpuBinding, 1> grid{storage(RELUME_RESOLVE_SLOT_CACHES, kCacheLight, true)};
    const std::array<GpuBinding, 6> texels{storage(RELUME_SLOT_MAP_TEXELS, kMapTexels),
                                           storage(RELUME_SLOT_TEXELS, kTexelColors, true),
                                           sampled(RELUME_RESOLVE_UNIT_NORMAL, kMapNormal),
                                           stored(RELUME_IMAGE_Y, kMapY),
                                           stored(RELUME_IMAGE_CO, kMapCo),
                                           stored(RELUME_IMAGE_CG, kMapCg)};
    const auto own_ = map ? std::span<const GpuBinding>(texels) : std::span<const GpuBinding>(grid);
    // Of frames without parts as well: what programs declare is bound, though no thread reads it.
    const std::array<GpuBinding, 1> change{storage(RELUME_SLOT_MOVING_LIGHT, moving_.most > 0 ? kMovingLight : kNodes)};
    Batch& added = batches_.emplace_back(Batch{addSet(own, {common, own_, change}), batch});
    if (moving_.most == 0) continue;
    std::uint32_t& ownMoving = movingProgram[map ? 1 : 0];
    if (ownMoving == kRelumeNone)
      ownMoving = addProgram(cacheProgram(bands_, bake_.links.kind, group, made->nodeSteps, map, true));
    const std::array<GpuBinding, 4> parts{
        storage(RELUME_SLOT_PARTS, kMovingParts), storage(RELUME_SLOT_SENDER_POINTS, kSenderPoints),
        storage(RELUME_SLOT_SHAPES, kMovingShapes), storage(RELUME_SLOT_MOVING_LIGHT, kMovingLight, true)};
    added.movingSet = addSet(ownMoving, {common, own_, change});
    added.occludeSet = addSet(occludeProgram_, {common, parts});
  }
  return done();
}

void FramePlan::makePull(GroupThreads threads) {
  const PullGroup group = choosePullGroup(threads);
  PullSchedule schedule = makePullSchedule(bake_.hierarchy, group.nodes, memory_);
  pullGroupCount_ = schedule.groupCount();
  pullRoundCount_ = schedule.roundCount();
  std::pmr::vector<std::array<std::uint32_t, 2>> runs(memory_);
  runs.reserve(schedule.run.size());
  for (const PullSchedule::Run& run : schedule.run) runs.push_back(packRun(run));
  std::pmr::vector<std::uint32_t> rounds(schedule.groupBegin, memory_);
  rounds.insert(rounds.end(), schedule.roundBegin.begin(), schedule.roundBegin.end());
  addBuffer(kPullNode, "pull nodes", GpuUse::constant, keep(std::move(schedule.word)));
  addBuffer(kPullRuns, "pull runs", GpuUse::constant, keep(std::move(runs)));
  addBuffer(kPullRounds, "pull rounds", GpuUse::constant, keep(std::move(rounds)));
  const std::array<GpuBinding, 4> bindings{storage(RELUME_SLOT_PULL, kPullNode), storage(RELUME_SLOT_RUNS, kPullRuns),
                                           storage(RELUME_SLOT_ROUNDS, kPullRounds),
                                           storage(RELUME_SLOT_NODES, kNodes, true)};
  set_.pull = addSet(addProgram(pullProgram(group, false)), {bindings});
  if (pullRoundCount_ > 0) set_.pullTop = addSet(addProgram(pullProgram(group, true)), {bindings});
}

void FramePlan::makeBuffers(const GridTexture& texture, std::uint32_t movingParts, std::uint32_t movingLag) {
  const PackedCaches caches(bake_.caches, memory_);
  SenderArrays senders = packSenders(bake_, caches, bands_.lumaBands, memory_);
  flatEnd_ = senders.flatEnd;
  tiltedEnd_ = senders.tiltedEnd;
  surfelEnd_ = senders.surfelEnd;
  senderEnd_ = senders.senderEnd;
  surfelBox_ = {senders.box.origin, senders.surfelEnd, senders.box.step, discRadius(bake_.surfels.areaEach)};
  emits_ = senders.emits;
  skyOrder_ = std::move(senders.skyOrder);
  addBuffer(kSurfelWords, "surfels", GpuUse::constant, keep(std::move(senders.surfels)));
  // Frames that drive materials write it.
  addBuffer(kEmission, "emission", bake_.emitters.count() > 0 ? GpuUse::light : GpuUse::constant,
            keep(std::move(senders.emission)));
  addBuffer(kLeafNode, "leaf nodes", GpuUse::constant, keep(std::move(senders.leafNode)));
  addBuffer(kEmitters, "emitters", GpuUse::constant, keep(std::move(senders.emitters)));
  addBuffer(kGridded, "gridded surfels", GpuUse::constant, keep(std::move(senders.gridded)));
  addBuffer(kNodes, "radiosity", GpuUse::light, {}, bake_.hierarchy.nodeCount() * sizeof(std::uint32_t));
  addBuffer(kCacheLight, "caches", GpuUse::light, {}, firstMapCache_ * cacheBytes(bands_));
  addBuffer(kMapTexels, "texels of caches", GpuUse::constant, keep(listTexels(bake_.caches, firstMapCache_, memory_)));
  addBuffer(kTexelColors, "texel irradiance", GpuUse::light, keep(darkTexels(bake_.caches.lightmap, memory_)));
  const PackedGridLayout grid = layoutGrid(caches, texture);
  addBuffer(kGrid, "grid", GpuUse::constant, keep(packGrid(caches, grid, memory_)));
  std::pmr::vector<gl::RelumeResolve> resolve(1, grid.resolve, memory_);
  addBuffer(kResolve, "resolve", GpuUse::constant, keep(std::move(resolve)));
  std::pmr::vector<gl::RelumeSurfels> box(1, surfelBox_, memory_);
  addBuffer(kSurfelBox, "surfels' box", GpuUse::constant, keep(std::move(box)));
  buffers_[kResolve].isUniform = buffers_[kSurfelBox].isUniform = true;
  const std::size_t colors = (device_.hasSurfelArrays ? 2 * std::size_t{surfelEnd_} : 0) + (senderEnd_ - surfelEnd_);
  addBuffer(kLights, "lights", GpuUse::frame, {}, device_.maxLights * sizeof(gl::RelumeLight));
  addBuffer(kHost, "colours of the host", GpuUse::frame, {}, colors * sizeof(glm::vec4));
  addBuffer(kSurfelLight, "surfel irradiance", GpuUse::light, {},
            device_.hasSurfelShader ? surfelEnd_ * sizeof(glm::vec4) : 0);
  if (!texture.empty()) makeGridBuffers(texture);
  makeMovingBuffers(movingParts, movingLag);
}

void FramePlan::makeGridBuffers(const GridTexture& texture) {
  addBuffer(kGridFactors, "factors of vectors", GpuUse::constant, keep(packFactors(bands_.lumaBands, memory_)));
  addBuffer(kGridShares, "shares of the grid's texture", GpuUse::constant, keep(packShares(texture, memory_)));
  addBuffer(kGridVectors, "vectors of caches", GpuUse::light, {},
            std::size_t{texture.cacheCount} * 18 * sizeof(glm::vec4));
}

void FramePlan::makeImages(const GridTexture& texture) {
  const Lightmap& map = bake_.caches.lightmap;
  const bool hasMap = !map.cache.empty();
  const glm::uvec2 size = hasMap ? glm::uvec2(map.width, map.height) : glm::uvec2(1u);
  const auto layers = [](int bands) { return static_cast<std::uint32_t>(wordsOf(bands)); };
  const std::uint32_t luma = layers(bands_.onMap(bands_.lumaBands)), chroma = layers(bands_.onMap(bands_.chromaBands));
  const auto coefficients = [&](const char* name, std::uint32_t count) {
    images_.push_back({name, GpuUse::light, TextureShape::array, GpuFormat::rgba16f, {size, count}, 1, {}});
  };
  coefficients("light map Y", luma);
  coefficients("light map Co", chroma);
  coefficients("light map Cg", chroma);
  images_.push_back({"light map normals",
                     GpuUse::constant,
                     TextureShape::flat,
                     GpuFormat::rgba8snorm,
                     {size, 1},
                     1,
                     keep(packNormals(bake_.caches, memory_))});
  if (!texture.empty()) {
    gridImages_ = static_cast<std::uint32_t>(images_.size());
    textureResolution_ = texture.resolution;
    vectorCaches_ = texture.cacheCount;
    texelCount_ = 6 * texture.points();
    const glm::uvec3 r = texture.resolution;
    const glm::uvec3 slabs(r.x, r.y, static_cast<std::uint32_t>(textureDepth(r.z)));
    images_.push_back({"grid vectors", GpuUse::light, TextureShape::volume, GpuFormat::rgba16f, slabs, 1, {}});
    images_.push_back({"grid chroma", GpuUse::light, TextureShape::volume, GpuFormat::rg16f, slabs, 1, {}});
    std::pmr::vector<std::uint8_t> open(texture.open, memory_);
    images_.push_back({"open cells", GpuUse::constant, TextureShape::volume, GpuFormat::r8ui, texture.cells(), 1,
                       keep(std::move(open))});
  }
}

// A set for each image that may drive a material, and one for materials without.
void FramePlan::makeDriveSets() {
  const Emitters& emitters = bake_.emitters;
  driveSets_.assign(emitters.materials.size(), 0);
  if (emitters.count() == 0) return;
  const std::uint32_t program = addProgram(driveProgram());
  const std::array<GpuBinding, 2> buffers{storage(RELUME_SLOT_EMITTERS, kEmitters),
                                          storage(RELUME_SLOT_EMISSION, kEmission, true)};
  const auto setOf = [&](std::uint32_t image, GpuSampler sampler) {
    const std::array<GpuBinding, 1> own{sampled(RELUME_UNIT_EMISSION, image, sampler)};
    return addSet(program, {buffers, own});
  };
  // What programs declare is bound, though no thread reads it.
  set_.drive = setOf(kMapNormal, GpuSampler::linear);
  for (std::size_t m = 0; m < driveSets_.size(); ++m) {
    driveSets_[m] = set_.drive;
    ImagePyramid* const image = driven_.image(static_cast<std::uint32_t>(m));
    if (!image) continue;
    drivenImages_[m] = static_cast<std::uint32_t>(images_.size());
    images_.push_back({"driven image",
                       GpuUse::frame,
                       TextureShape::flat,
                       GpuFormat::rgba32f,
                       {image->size(0), 1},
                       levelsOf(image->size(0)),
                       {}});
    const DrivableMaterial& material = emitters.materials[m];
    const auto wrap =
        static_cast<std::uint8_t>(GpuSampler::mipRepeat) + (material.clampU ? 1 : 0) + (material.clampV ? 2 : 0);
    driveSets_[m] = setOf(drivenImages_[m], static_cast<GpuSampler>(wrap));
  }
}

void FramePlan::makeSets(GroupThreads threads, const GridTexture& texture) {
  resolve_ = {{sampled(RELUME_RESOLVE_UNIT_Y, kMapY), sampled(RELUME_RESOLVE_UNIT_CO, kMapCo),
               sampled(RELUME_RESOLVE_UNIT_CG, kMapCg), sampled(RELUME_RESOLVE_UNIT_NORMAL, kMapNormal),
               storage(RELUME_RESOLVE_SLOT_CACHES, kCacheLight), storage(RELUME_RESOLVE_SLOT_GRID, kGrid),
               uniform(RELUME_RESOLVE_SLOT_UNIFORMS, kResolve)},
              memory_};
  makeDriveSets();
  const std::array<GpuBinding, 3> bounce{storage(RELUME_SLOT_SURFELS, kSurfelWords),
                                         storage(RELUME_SLOT_LEAF_NODE, kLeafNode),
                                         storage(RELUME_SLOT_NODES, kNodes, true)};
  const std::array<GpuBinding, 1> gridded{storage(RELUME_SLOT_GRIDDED, kGridded)};
  if (tiltedEnd_ > flatEnd_) set_.tilted = addSet(addProgram(bounceProgram(bands_, false)), {bounce, resolve_});
  if (surfelEnd_ > tiltedEnd_)
    set_.gridded = addSet(addProgram(bounceProgram(bands_, true)), {bounce, gridded, resolve_});
  const std::array<GpuBinding, 5> light{
      storage(RELUME_SLOT_LIGHTS, kLights), storage(RELUME_SLOT_HOST, kHost), storage(RELUME_SLOT_TEXELS, kTexelColors),
      storage(RELUME_SLOT_EMISSION, kEmission), storage(RELUME_SLOT_SURFEL_LIGHT, kSurfelLight)};
  set_.surfels = addSet(addProgram(surfelProgram()), {bounce, light});
  makePull(threads);
  if (moving_.most > 0) {
    const std::array<GpuBinding, 4> parts{
        storage(RELUME_SLOT_LIT_SHAPES, kMovingShapes), storage(RELUME_SLOT_LIGHTS, kLights),
        storage(RELUME_SLOT_PARTS, kMovingParts), storage(RELUME_SLOT_LIT_PARTS, kMovingLight, true)};
    moving_.lightSet = addSet(addProgram(partLightProgram(bands_)), {parts, resolve_});
  }
  surfelBindings_ = {
      {storage(RELUME_SURFELS_SLOT_WORDS, kSurfelWords), storage(RELUME_SURFELS_SLOT_LIGHT, kSurfelLight, true),
       uniform(RELUME_SURFELS_SLOT_UNIFORMS, kSurfelBox)},
      memory_};
  if (texture.empty()) return;
  const std::array<GpuBinding, 3> vectors{storage(RELUME_RESOLVE_SLOT_CACHES, kCacheLight),
                                          storage(RELUME_SLOT_FACTORS, kGridFactors),
                                          storage(RELUME_SLOT_VECTORS, kGridVectors, true)};
  const std::array<GpuBinding, 4> texels{
      storage(RELUME_SLOT_SHARES, kGridShares), storage(RELUME_SLOT_VECTORS, kGridVectors),
      stored(RELUME_IMAGE_GRID_VECTORS, *gridImages_), stored(RELUME_IMAGE_GRID_CHROMA, *gridImages_ + 1)};
  set_.vectors = addSet(addProgram(fillProgram(bands_, false)), {vectors});
  set_.texels = addSet(addProgram(fillProgram(bands_, true)), {texels});
  resolve_.push_back(sampled(RELUME_RESOLVE_UNIT_GRID_VECTORS, *gridImages_));
  resolve_.push_back(sampled(RELUME_RESOLVE_UNIT_GRID_CHROMA, *gridImages_ + 1));
  resolve_.push_back(sampled(RELUME_RESOLVE_UNIT_GRID_OPEN, *gridImages_ + 2, GpuSampler::nearest));
}

Result<Owned<FramePlan>> FramePlan::create(const Bake& bake, const GridTexture& texture, const CacheBands& bands,
                                           const ImageSizes& images, const GpuDevice& device,
                                           std::pmr::memory_resource* memory, std::uint32_t movingParts,
                                           std::uint32_t movingLag) {
  Owned<FramePlan> plan = makeOwned<FramePlan>(memory, bake, bands, images, device, memory);
  plan->firstMapCache_ = bake.caches.firstMapCache();
  if (Status ok = plan->checkSizes(); !ok) return ok.error();
  plan->makeBuffers(texture, movingParts, movingLag);
  if (plan->senderEnd_ / RELUME_SURFEL_GROUP > device.groups) {
    return tooLarge("the bake has " + std::to_string(plan->senderEnd_) + " slots of senders, this device dispatches " +
                    "at most " + std::to_string(device.groups) + " groups of " + std::to_string(RELUME_SURFEL_GROUP));
  }
  plan->makeImages(texture);
  plan->makeSets(device.isSerial ? GroupThreads::serial : GroupThreads::parallel, texture);
  if (Status ok = plan->makeLinks(); !ok) return ok.error();
  for (const GpuBuffer& buffer : plan->buffers_) {
    const bool isLinks = &buffer == &plan->buffers_[kLinks] || &buffer == &plan->buffers_[kLinkShape];
    if (buffer.bytes > device.storageBytes && !isLinks) {
      return tooLarge(std::string("the buffer \"") + buffer.name + "\" has " + std::to_string(buffer.bytes) +
                      " bytes, this device binds at most " + std::to_string(device.storageBytes));
    }
  }
  for (std::size_t i = 0, begin = 0; i < plan->sets_.size(); begin = plan->setEnd_[i++])
    plan->sets_[i].bindings = std::span<const GpuBinding>(plan->bindings_).subspan(begin, plan->setEnd_[i] - begin);
  // What any frame adds: ranges that begin, and what the device cuts them into.
  const std::size_t threads = std::size_t{plan->senderEnd_} + bake.emitters.count() + bake.caches.count() +
                              plan->texelCount_ + plan->pullGroupCount_;
  const std::size_t perBatch = movingParts > 0 ? 2 : 1, parts = movingParts > 0 ? 1 + bake.caches.count() : 0;
  const std::size_t dispatches =
      8 + perBatch * plan->batches_.size() + bake.emitters.materials.size() + (threads + parts) / device.groups + 1;
  plan->dispatches_.reserve(dispatches);
  plan->hostTextures_.reserve(dispatches);
  std::size_t levels = 0;
  for (const GpuImage& image : plan->images_) levels += image.use == GpuUse::frame ? image.levels : 0;
  plan->uploads_.reserve(4 + levels);
  return plan;
}

void FramePlan::forgetContents() {
  for (GpuBuffer& buffer : buffers_) buffer.contents = {};
  for (GpuImage& image : images_) image.contents = {};
  decltype(kept_)(memory_).swap(kept_);
  bake_.links = {};
}

std::optional<std::uint32_t> FramePlan::drivenImage(std::uint32_t material) const {
  const std::uint32_t image = drivenImages_[material];
  return image == kRelumeNone ? std::nullopt : std::optional(image);
}

Result<std::string> FramePlan::surfelGlsl() const {
  const auto text = [](const glm::vec3& v) {
    return "vec3(" + decimalGlsl(v.x) + ", " + decimalGlsl(v.y) + ", " + decimalGlsl(v.z) + ")";
  };
  const DefineList defines{{"RELUME_SURFEL_SLOTS", std::to_string(surfelEnd_) + "u"},
                           {"RELUME_SURFEL_ORIGIN", text(surfelBox_.origin)},
                           {"RELUME_SURFEL_STEP", text(surfelBox_.step_)},
                           {"RELUME_SURFEL_RADIUS", decimalGlsl(surfelBox_.radius)}};
  return expandShader("surfels.glsl", defines);
}

}  // namespace relume::gpu
