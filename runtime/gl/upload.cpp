// SPDX-License-Identifier: MIT
// See upload.h.
#include "runtime/gl/upload.h"

#include "formats/pack.h"
#include "runtime/gl/leaf_blocks.h"
#include "runtime/gl/pull_schedule.h"
#include "runtime/gl/upload_links.h"
#include "runtime/gl/upload_textures.h"
#include "runtime/shared/pack_color.h"
#include "runtime/shared/pack_grid.h"
#include "runtime/shared/receivers.h"
#include "shaders/shared/layout.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <span>

namespace relume::gl {
namespace {

static_assert(kRelumeCacheBits == kCacheBits);

// emission: packed, by slot.
void makeEmitters(const Functions& gl, const Emitters& emitters, std::span<const SenderSlot> slots,
                  std::span<const std::uint32_t> emission, GpuBake& gpu, std::pmr::memory_resource* memory) {
  if (emitters.count() == 0) {
    gpu.emitters = makeBuffer(gl, nullptr, 0, GL_STATIC_DRAW);
    return;
  }
  std::uint32_t surfels = 0;
  for (const std::uint32_t s : emitters.surfel) surfels = std::max(surfels, s + 1);
  std::pmr::vector<std::uint32_t> slotOf(surfels, 0, memory);
  for (std::uint32_t i = 0; i < slots.size(); ++i) {
    if (slots[i].node != kRelumeNone && slots[i].surfel < surfels) slotOf[slots[i].surfel] = i;
  }
  std::pmr::vector<RelumeEmitter> entries(emitters.count(), memory);
  for (std::uint32_t e = 0; e < emitters.count(); ++e) {
    const std::uint32_t slot = slotOf[emitters.surfel[e]], *tap = emitters.tap.data() + std::size_t{kFootprintTaps} * e;
    static_assert(kFootprintTaps == 4);
    entries[e] = {slot, emission[slot], emitters.tapWidth[e], 0, {tap[0], tap[1], tap[2], tap[3]}};
  }
  gpu.emitters = makeArray<RelumeEmitter>(gl, entries);
}

// Decide the surfels' order, and upload them in it. Albedo has the CPU backend's dithers.
void makeSurfels(const Functions& gl, const Bake& bake, int lumaBands, GpuBake& gpu,
                 std::pmr::memory_resource* memory) {
  const Surfels& surfels = bake.surfels;
  const Hierarchy& hierarchy = bake.hierarchy;
  const std::uint32_t count = surfels.count();
  std::array<std::pmr::vector<SenderSlot>, 3> byKind{
      std::pmr::vector<SenderSlot>(memory), std::pmr::vector<SenderSlot>(memory), std::pmr::vector<SenderSlot>(memory)};
  std::uint32_t leaf = 0;
  for (std::uint32_t node = 0; node < hierarchy.nodeCount(); ++node) {
    if (!hierarchy.isLeaf(node) || hierarchy.sender(node) >= count) continue;
    const std::uint32_t s = hierarchy.sender(node);
    const ReceiverKind kind = receiverKind(bake.caches, surfels, s, normalsCount(bake.links.kind, lumaBands));
    byKind[static_cast<std::size_t>(kind)].push_back({s, node, leaf++});
  }
  LeafBlocks blocks(memory);
  GLuint* const ends[] = {&gpu.flatEnd, &gpu.tiltedEnd, &gpu.surfelEnd};
  for (std::size_t kind = 0; kind < byKind.size(); ++kind) {
    for (const SenderSlot& each : byKind[kind]) blocks.add(each);
    blocks.endBlock();
    *ends[kind] = static_cast<GLuint>(blocks.slots().size());
  }

  gpu.box = boxOf(surfels.positionWorld);
  gpu.emits = bake.emitters.count() > 0 || std::any_of(surfels.emission.begin(), surfels.emission.end(),
                                                       [](const glm::vec3& e) { return e != glm::vec3(0.0f); });
  std::pmr::vector<SurfelWords> words(gpu.surfelEnd, SurfelWords{}, memory);
  std::pmr::vector<std::uint32_t> emission(gpu.emits ? gpu.surfelEnd : 0, 0, memory);
  for (std::size_t i = 0; i < words.size(); ++i) {
    const SenderSlot& each = blocks.slots()[i];
    if (each.node == kRelumeNone) continue;
    const std::uint32_t s = each.surfel;
    words[i] = packSurfel(gpu.box, surfels.positionWorld[s], surfels.normal[s], surfels.albedo[s], surfels.receiver[s],
                          ditherOf(each.dither));
    if (gpu.emits) emission[i] = packColor(surfels.emission[s], ditherOf(s));
  }
  makeEmitters(gl, bake.emitters, blocks.slots(), emission, gpu, memory);
  // Of gridded ones, where each one's shares begin, then the shares.
  std::pmr::vector<std::uint32_t> begin(memory), shares(memory);
  const std::uint32_t sharesBegin = gpu.surfelEnd - gpu.tiltedEnd + 1;
  for (const SenderSlot& each : blocks.slots().subspan(gpu.tiltedEnd)) {
    begin.push_back(static_cast<std::uint32_t>(sharesBegin + shares.size()));
    if (each.node != kRelumeNone) appendGridShares(bake.caches, surfels, each.surfel, shares);
  }
  begin.push_back(static_cast<std::uint32_t>(sharesBegin + shares.size()));
  begin.insert(begin.end(), shares.begin(), shares.end());
  gpu.gridded = makeArray<std::uint32_t>(gl, begin);
  gpu.surfels = makeArray<SurfelWords>(gl, words);
  gpu.emission = makeArray<std::uint32_t>(gl, emission);

  std::pmr::vector<std::uint32_t> sky(hierarchy.leafNode.begin() + count, hierarchy.leafNode.end(), memory);
  std::sort(sky.begin(), sky.end());
  for (const std::uint32_t node : sky) blocks.add({hierarchy.sender(node) - count, node, 0});
  blocks.endBlock();
  gpu.senderEnd = static_cast<GLuint>(blocks.slots().size());
  for (const SenderSlot& each : blocks.slots().subspan(gpu.surfelEnd)) gpu.skyOrder.push_back(each.surfel);
  gpu.leafNode = makeArray<std::uint32_t>(gl, blocks.words());
}

// RELUME_SLOT_MAP_TEXELS.
std::pmr::vector<std::uint32_t> listTexels(const Caches& caches, std::uint32_t first,
                                           std::pmr::memory_resource* memory) {
  const Lightmap& map = caches.lightmap;
  const std::size_t count = caches.count() - first;
  std::pmr::vector<std::uint32_t> list(count + 2, 0, memory);
  for (const std::uint32_t cache : map.cache) list[cache == kNoCache ? count + 1 : cache - first + 1] += 1;
  list.pop_back();
  list[0] = static_cast<std::uint32_t>(count + 1);
  for (std::size_t i = 1; i <= count; ++i) list[i] += list[i - 1];
  std::pmr::vector<std::uint32_t> next(list.begin(), list.end() - 1, memory);
  list.resize(list.back());
  for (std::uint32_t i = 0; i < map.cache.size(); ++i) {
    if (map.cache[i] != kNoCache) list[next[map.cache[i] - first]++] = i % map.width | i / map.width << 16;
  }
  return list;
}

}  // namespace

GroupThreads groupThreadsOf(const char* renderer) {
  const bool software = renderer && (std::strstr(renderer, "llvmpipe") || std::strstr(renderer, "softpipe"));
  return software ? GroupThreads::serial : GroupThreads::parallel;
}

PullGroup choosePullGroup(GroupThreads threads) {
  return threads == GroupThreads::serial ? PullGroup{8, 4096} : PullGroup{128, 1024};
}

Buffer makeBuffer(const Functions& gl, const void* data, std::size_t bytes, GLenum usage) {
  GLuint name = 0;
  gl.GenBuffers(1, &name);
  Buffer buffer{Handle<detail::deleteBuffer>(gl, name),
                static_cast<GLsizeiptr>(std::max((bytes + 3) / 4 * 4, kSmallestBuffer))};
  gl.BindBuffer(GL_COPY_WRITE_BUFFER, name);
  if (data && static_cast<std::size_t>(buffer.bytes) == bytes) {
    gl.BufferData(GL_COPY_WRITE_BUFFER, buffer.bytes, data, usage);
    return buffer;
  }
  gl.BufferData(GL_COPY_WRITE_BUFFER, buffer.bytes, nullptr, usage);
  gl.ClearBufferData(GL_COPY_WRITE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  if (data && bytes > 0) gl.BufferSubData(GL_COPY_WRITE_BUFFER, 0, static_cast<GLsizeiptr>(bytes), data);
  return buffer;
}

void clearLight(const Functions& gl, const Bake& bake, const CacheBands& bands, GpuBake& gpu,
                std::pmr::memory_resource* memory) {
  // All memory before anything is cleared.
  const auto layersOf = [&bands](int held) { return wordsOf(bands.onMap(held)); };
  const GLuint width = std::max(gpu.mapWidth, 1u), height = std::max(gpu.mapHeight, 1u);
  const std::size_t max = static_cast<std::size_t>(layersOf(bands.lumaBands));
  const std::pmr::vector<std::uint16_t> zeros(std::size_t{4} * width * height * max, 0, memory);
  const Array<std::uint32_t>& map = bake.caches.lightmap.cache;
  std::pmr::vector<std::uint32_t> texels(map.begin(), map.end(), memory);

  gl.BindBuffer(GL_COPY_WRITE_BUFFER, gpu.caches.get());
  gl.ClearBufferData(GL_COPY_WRITE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  gl.ActiveTexture(GL_TEXTURE0 + RELUME_RESOLVE_UNIT_Y);
  const auto clear = [&](const Texture& texture, int held) {
    gl.BindTexture(GL_TEXTURE_2D_ARRAY, texture.get());
    gl.TexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height),
                     layersOf(held), GL_RGBA, GL_HALF_FLOAT, zeros.data());
  };
  clear(gpu.mapY, bands.lumaBands);
  clear(gpu.mapCo, bands.chromaBands);
  clear(gpu.mapCg, bands.chromaBands);
  // Surfels leave out texels that hold no cache.
  for (std::uint32_t& texel : texels) texel = texel == kNoCache ? kRelumeNone : 0;
  gl.BindBuffer(GL_COPY_WRITE_BUFFER, gpu.texels.get());
  if (!texels.empty())
    gl.BufferSubData(GL_COPY_WRITE_BUFFER, 0, static_cast<GLsizeiptr>(texels.size() * sizeof(texels[0])),
                     texels.data());
}

void orderSurfels(const Functions& gl, const Bake& bake, GpuBake& gpu) {
  if (!gpu.surfelOrder.empty()) return;
  constexpr std::size_t kWords = 1 + RELUME_SURFEL_GROUP / 2;
  std::pmr::memory_resource* const memory = gpu.surfelOrder.get_allocator().resource();
  const auto words = readBuffer<std::uint32_t>(gl, gpu.leafNode, gpu.surfelEnd / RELUME_SURFEL_GROUP * kWords, memory);
  gpu.surfelOrder.reserve(gpu.surfelEnd);
  for (std::size_t block = 0; block < words.size(); block += kWords) {
    for (std::size_t i = 0; i < RELUME_SURFEL_GROUP; ++i) {
      const std::uint32_t step = words[block + 1 + i / 2] >> (16 * (i % 2)) & 0xFFFFu;
      gpu.surfelOrder.push_back(step == 0xFFFFu ? kRelumeNone : bake.hierarchy.sender(words[block] + step));
    }
  }
}

std::size_t maxStorageBytes(const Functions& gl) {
  GLint64 limit = 0;
  gl.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limit);
  return static_cast<std::size_t>(limit);
}

std::uint32_t max3dSide(const Functions& gl) {
  GLint side = 0;
  gl.GetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &side);
  return static_cast<std::uint32_t>(std::max(side, 1));
}

Result<GpuBake> uploadBake(const Functions& gl, const Bake& bake, const GridTexture& texture, const CacheBands& bands,
                           GroupThreads threads, std::pmr::memory_resource* memory) {
  const std::size_t limit = maxStorageBytes(gl);
  GLint alignment = 1;
  gl.GetIntegerv(GL_SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT, &alignment);
  const Hierarchy& hierarchy = bake.hierarchy;
  const Links& links = bake.links;

  GpuBake gpu(memory);
  gpu.firstMapCache = bake.caches.firstMapCache();
  // A unit of repacked links has 16 bytes.
  if (Status ok = makeLinks(gl, links, limit, static_cast<std::size_t>(std::max(alignment, 16)), gpu, memory); !ok) {
    return ok.error();
  }
  if (hierarchy.nodeCount() > kMaxPulledNodes) {
    return Error{ErrorCode::unsupported, "the hierarchy has " + std::to_string(hierarchy.nodeCount()) +
                                             " nodes, the OpenGL backend takes at most " +
                                             std::to_string(kMaxPulledNodes)};
  }
  const std::size_t cachesBytes = gpu.firstMapCache * cacheBytes(bands);
  const std::size_t largest =
      std::max({cachesBytes, sizeof(SurfelWords) * bake.surfels.count(), hierarchy.nodeCount() * sizeof(std::uint32_t),
                (bake.caches.lightmap.cache.size() + bake.caches.count() + 1) * sizeof(std::uint32_t)});
  if (largest > limit) {
    return Error{ErrorCode::unsupported, "a buffer of " + std::to_string(largest) +
                                             " bytes is needed, this OpenGL binds at most " + std::to_string(limit)};
  }

  makeSurfels(gl, bake, bands.lumaBands, gpu, memory);
  gpu.pullGroup = choosePullGroup(threads);
  const PullSchedule schedule = makePullSchedule(hierarchy, gpu.pullGroup.nodes, memory);
  gpu.pullGroupCount = schedule.groupCount();
  gpu.pullRoundCount = schedule.roundCount();
  std::pmr::vector<std::array<std::uint32_t, 2>> runs(memory);
  runs.reserve(schedule.run.size());
  for (const PullSchedule::Run& run : schedule.run) runs.push_back(packRun(run));
  std::pmr::vector<std::uint32_t> rounds(schedule.groupBegin, memory);
  rounds.insert(rounds.end(), schedule.roundBegin.begin(), schedule.roundBegin.end());
  gpu.pullNode = makeArray<std::uint32_t>(gl, schedule.word);
  gpu.pullRuns = makeArray<std::array<std::uint32_t, 2>>(gl, runs);
  gpu.pullRounds = makeArray<std::uint32_t>(gl, rounds);
  gpu.nodes = makeBuffer(gl, nullptr, hierarchy.nodeCount() * sizeof(std::uint32_t), GL_DYNAMIC_COPY);
  gpu.caches = makeBuffer(gl, nullptr, cachesBytes, GL_DYNAMIC_COPY);
  gpu.mapTexels = makeArray<std::uint32_t>(gl, listTexels(bake.caches, gpu.firstMapCache, memory));
  gpu.texels = makeBuffer(gl, nullptr, bake.caches.lightmap.cache.size() * sizeof(std::uint32_t), GL_DYNAMIC_COPY);
  const PackedGridLayout grid = layoutGrid(bake.caches.grid, texture);
  gpu.gridCache = makeArray<std::uint32_t>(gl, packGrid(bake.caches, grid, memory));
  gpu.resolve = makeBuffer(gl, &grid.resolve, sizeof grid.resolve, GL_STATIC_DRAW);
  if (Status ok = makeLightmap(gl, bake.caches, bands, gpu, memory); !ok) return ok.error();
  makeGridTextures(gl, texture, bands, gpu, memory);
  clearLight(gl, bake, bands, gpu, memory);
  // Bindings past a small buffer's end are errors: keep them inside.
  for (LinkBatch& batch : gpu.batches) {
    batch.linkBytes = std::min(batch.linkBytes, gpu.links.bytes - batch.linkStart);
    // Irradiance links past the grid's have no shape, and read none.
    batch.shapeStart = batch.shapeStart < gpu.linkShape.bytes ? batch.shapeStart : 0;
    batch.shapeBytes = std::min(batch.shapeBytes, gpu.linkShape.bytes - batch.shapeStart);
  }
  if (gl.GetError() == GL_OUT_OF_MEMORY) {
    return Error{ErrorCode::unsupported, "this OpenGL has not enough memory for the bake's buffers"};
  }
  return gpu;
}

std::vector<std::pair<std::string, std::size_t>> GpuBake::bufferSizes() const {
  const auto bytes = [](const Buffer& buffer) { return static_cast<std::size_t>(buffer.bytes); };
  std::vector<std::pair<std::string, std::size_t>> sizes{
      {"surfels", bytes(surfels) + bytes(emission) + bytes(emitters) + surfelOrder.size() * sizeof(surfelOrder[0])},
      {"hierarchy", bytes(pullNode) + bytes(pullRuns) + bytes(pullRounds) + bytes(leafNode)},
      {"radiosity", bytes(nodes)},
      {"links", bytes(rows) + bytes(links) + bytes(linkShape)},
      {"caches", bytes(caches)},
      {"bounce", bytes(texels) + bytes(gridded)},
      {"index", bytes(mapTexels) + bytes(gridCache) + bytes(resolve)},
      {"lightmap", textureBytes}};
  if (gridTextureBytes > 0) sizes.emplace_back("grid texture", gridTextureBytes);
  return sizes;
}

}  // namespace relume::gl
