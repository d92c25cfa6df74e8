// SPDX-License-Identifier: MIT
// See upload.h.
#include "runtime/gl/upload.h"

#include "formats/compact_links.h"
#include "formats/pack.h"
#include "runtime/gl/leaf_blocks.h"
#include "runtime/gl/pack_grid.h"
#include "runtime/gl/pull_schedule.h"
#include "runtime/shared/link_set.h"
#include "runtime/shared/pack_color.h"
#include "runtime/shared/receivers.h"
#include "shaders/shared/layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>

namespace relume::gl {
namespace {

constexpr std::size_t kSmallest = 16;
static_assert(kRelumeCacheBits == kCacheBits);

template <class T>
Buffer makeArray(const Functions& gl, std::span<const T> data) {
  return makeBuffer(gl, data.data(), data.size_bytes(), GL_STATIC_DRAW);
}

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

// Bytes of a link in GpuBake::linkShape.
std::size_t shapeBytes(const Links& links) {
  switch (links.kind) {
    case LinkKind::sh:
      return 2 * std::size_t{links.bands} * links.bands;
    case LinkKind::cone:
      return 0;
    case LinkKind::oct6:
      return 2;
    default:
      return 4;
  }
}

// Cut the rows into batches whose bindings stay below `limit` bytes, starts aligned to `alignment`. linkBytes, shape:
// of a link in GpuBake::links and linkShape. No batch has caches before and from `cut` on.
Result<std::pmr::vector<LinkBatch>> makeBatches(std::span<const std::uint32_t> rowBegin, std::uint32_t cut,
                                                std::size_t linkBytes, std::size_t shape, std::size_t limit,
                                                std::size_t alignment, std::pmr::memory_resource* memory) {
  const auto caches = static_cast<std::uint32_t>(rowBegin.empty() ? 0 : rowBegin.size() - 1);
  const std::size_t max = (limit - std::min(limit, alignment)) / std::max(linkBytes, shape);
  std::pmr::vector<LinkBatch> batches(memory);
  for (std::uint32_t cache = 0; cache < caches;) {
    LinkBatch batch;
    batch.firstCache = cache;
    batch.firstLink = rowBegin[cache];
    const std::uint32_t end = cache < cut ? std::min(cut, caches) : caches;
    while (cache < end && rowBegin[cache + 1] - batch.firstLink <= max) ++cache;
    if (cache == batch.firstCache) {
      return Error{ErrorCode::unsupported, "the links of cache " + std::to_string(cache) + " exceed the " +
                                               std::to_string(limit) + " bytes this OpenGL binds at once"};
    }
    batch.endCache = cache;
    const std::size_t first = batch.firstLink, count = rowBegin[cache] - first;
    const auto alignDown = [alignment](std::size_t byte) { return byte / alignment * alignment; };
    const std::size_t linkStart = alignDown(first * linkBytes), shapeStart = alignDown(first * shape);
    batch.linkStart = static_cast<GLintptr>(linkStart);
    batch.wordOffset = static_cast<GLuint>((first * linkBytes - linkStart) / 4);
    batch.linkBytes = static_cast<GLsizeiptr>(std::max(first * linkBytes + count * linkBytes - linkStart, kSmallest));
    batch.shapeStart = static_cast<GLintptr>(shapeStart);
    batch.halfOffset = static_cast<GLuint>((first * shape - shapeStart) / 2);
    // Whole words: the last half may share its word with padding.
    const std::size_t shapeEnd = (first + count) * shape;
    batch.shapeBytes = static_cast<GLsizeiptr>(std::max((shapeEnd - shapeStart + 3) / 4 * 4, kSmallest));
    // Caches without links keep the zeros their buffer began with.
    if (count > 0) batches.push_back(batch);
  }
  return batches;
}

// The arrays of links packed again, in GpuBake's layout.
struct FourfoldLinks {
  explicit FourfoldLinks(std::pmr::memory_resource* memory)
      : rowBegin(memory), rows(memory), words(memory), transfers(memory) {}

  std::pmr::vector<std::uint32_t> rowBegin;   // [Size caches + 1] in units of four links
  std::pmr::vector<std::uint32_t> rows;       // RELUME_SLOT_ROWS
  std::pmr::vector<std::uint32_t> words;      // [Size 4 units]
  std::pmr::vector<std::uint32_t> transfers;  // [Size units]
  int nodeSteps = 0;
};

// Nothing when the links cannot be packed again.
std::optional<FourfoldLinks> makeFourfold(const Links& links, std::pmr::memory_resource* memory) {
  if (links.kind != LinkKind::oct6) return std::nullopt;
  const LinkSet set(links, memory);
  const LinkRows rows = set.rows();
  if (rows.kind != kRepackedLinks) return std::nullopt;
  FourfoldLinks out(memory);
  out.nodeSteps = static_cast<int>(rows.nodeSteps);
  out.rowBegin.push_back(0);
  for (std::uint32_t cache = 0; cache < links.cacheCount(); ++cache) {
    const std::uint32_t begin = links.rowBegin[cache], end = links.rowBegin[cache + 1];
    out.rows.push_back(out.rowBegin.back());
    for (std::uint32_t k = 0; k < rows.nodeSteps; k += 2) {
      const std::uint16_t* step = rows.nodeStep + std::size_t{rows.nodeSteps} * cache + k;
      out.rows.push_back(std::uint32_t{step[0]} | std::uint32_t{k + 1 < rows.nodeSteps ? step[1] : step[0]} << 16);
    }
    out.words.insert(out.words.end(), rows.word + begin, rows.word + end);
    out.words.resize((out.words.size() + 3) / 4 * 4, 0);
    for (std::uint32_t i = begin; i < end; ++i) {
      if ((i - begin) % 4 == 0) out.transfers.push_back(0);
      out.transfers.back() |= std::uint32_t{rows.transfer[i]} << (8 * ((i - begin) % 4));
    }
    out.rowBegin.push_back(static_cast<std::uint32_t>(out.transfers.size()));
  }
  out.rows.push_back(out.rowBegin.back());
  return out;
}

// Upload the links, and cut them into batches.
Status makeLinks(const Functions& gl, const Links& links, std::size_t limit, std::size_t alignment, GpuBake& gpu,
                 std::pmr::memory_resource* memory) {
  const std::optional<FourfoldLinks> fourfold = makeFourfold(links, memory);
  const std::size_t linkBytes = fourfold ? 16 : links.kind == LinkKind::cone ? sizeof(ConeLink) : sizeof(std::uint32_t);
  Result<std::pmr::vector<LinkBatch>> batches =
      makeBatches(fourfold ? std::span<const std::uint32_t>(fourfold->rowBegin) : links.rowBegin.span(),
                  gpu.firstMapCache, linkBytes, fourfold ? 4 : shapeBytes(links), limit, alignment, memory);
  if (!batches) return batches.error();
  gpu.batches = std::move(*batches);
  if (fourfold) {
    gpu.nodeSteps = fourfold->nodeSteps;
    gpu.rows = makeArray<std::uint32_t>(gl, fourfold->rows);
    gpu.links = makeArray<std::uint32_t>(gl, fourfold->words);
    gpu.linkShape = makeArray<std::uint32_t>(gl, fourfold->transfers);
    return done();
  }
  gpu.rows = makeArray<std::uint32_t>(gl, links.rowBegin);
  if (links.kind == LinkKind::cone) {
    gpu.links = makeArray<ConeLink>(gl, links.cone);
    gpu.linkShape = makeBuffer(gl, nullptr, 0, GL_STATIC_DRAW);
  } else if (links.kind == LinkKind::sh) {
    gpu.links = makeArray<std::uint32_t>(gl, links.shNode);
    gpu.linkShape = makeArray<std::uint16_t>(gl, links.shCoefficients);
  } else {
    gpu.links = makeArray<std::uint32_t>(gl, links.head);
    gpu.linkShape = makeArray<std::uint32_t>(gl, links.shape);
  }
  return done();
}

Texture makeTexture(const Functions& gl, GLenum target, GLenum format, GLuint width, GLuint height, int layers) {
  GLuint name = 0;
  gl.GenTextures(1, &name);
  Texture texture(gl, name);
  gl.ActiveTexture(GL_TEXTURE0 + RELUME_RESOLVE_UNIT_Y);
  gl.BindTexture(target, name);
  if (target == GL_TEXTURE_2D) {
    gl.TexStorage2D(target, 1, format, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  } else {
    gl.TexStorage3D(target, 1, format, static_cast<GLsizei>(width), static_cast<GLsizei>(height), layers);
  }
  gl.TexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl.TexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl.TexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(target, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
  return texture;
}

// Normal of each texel's cache as signed bytes, w = 1; zeros where there is none.
std::pmr::vector<std::int8_t> packNormals(const Caches& caches, std::pmr::memory_resource* memory) {
  std::pmr::vector<std::int8_t> texels(4 * std::max<std::size_t>(caches.lightmap.cache.size(), 1), 0, memory);
  for (std::size_t i = 0; i < caches.lightmap.cache.size(); ++i) {
    const std::uint32_t cache = caches.lightmap.cache[i];
    if (cache == kNoCache) continue;
    for (int k = 0; k < 3; ++k) {
      const float v = std::clamp(caches.normal[cache][k], -1.0f, 1.0f);
      texels[4 * i + static_cast<std::size_t>(k)] = static_cast<std::int8_t>(std::lrint(127.0f * v));
    }
    texels[4 * i + 3] = 127;
  }
  return texels;
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

Status makeLightmap(const Functions& gl, const Caches& caches, const CacheBands& bands, GpuBake& gpu,
                    std::pmr::memory_resource* memory) {
  GLint max = 0;
  gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &max);
  const Lightmap& map = caches.lightmap;
  if (map.width > static_cast<GLuint>(max) || map.height > static_cast<GLuint>(max)) {
    return Error{ErrorCode::unsupported, "the light map of " + std::to_string(map.width) + " x " +
                                             std::to_string(map.height) +
                                             " texels exceeds this OpenGL's largest texture, " + std::to_string(max)};
  }
  if (!map.cache.empty()) {
    gpu.mapWidth = map.width;
    gpu.mapHeight = map.height;
  }
  const GLuint width = std::max(gpu.mapWidth, 1u), height = std::max(gpu.mapHeight, 1u);
  const int lumaLayers = wordsOf(bands.onMap(bands.lumaBands)), chromaLayers = wordsOf(bands.onMap(bands.chromaBands));
  gpu.mapY = makeTexture(gl, GL_TEXTURE_2D_ARRAY, GL_RGBA16F, width, height, lumaLayers);
  gpu.mapCo = makeTexture(gl, GL_TEXTURE_2D_ARRAY, GL_RGBA16F, width, height, chromaLayers);
  gpu.mapCg = makeTexture(gl, GL_TEXTURE_2D_ARRAY, GL_RGBA16F, width, height, chromaLayers);
  gpu.mapNormal = makeTexture(gl, GL_TEXTURE_2D, GL_RGBA8_SNORM, width, height, 1);
  const std::pmr::vector<std::int8_t> normals = packNormals(caches, memory);
  gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height), GL_RGBA, GL_BYTE,
                   normals.data());
  gpu.textureBytes = std::size_t{width} * height * (8 * static_cast<std::size_t>(lumaLayers + 2 * chromaLayers) + 4);
  return done();
}

// Factors of bands 2 and up as fill_grid_texture.comp reads them, four coefficients a vector.
std::pmr::vector<float> packFactors(int bands, std::pmr::memory_resource* memory) {
  const std::size_t stride = 4 * static_cast<std::size_t>(wordsOf(bands));
  std::pmr::vector<float> packed(9 * stride, 0.0f, memory);
  for (std::size_t row = 0; row < 9; ++row) {
    for (std::size_t i = 4; i < static_cast<std::size_t>(bands * bands); ++i)
      packed[row * stride + i] = vectorFactors()[row * kMaxCoefficients + i];
  }
  return packed;
}

void makeGridTextures(const Functions& gl, const GridTexture& texture, const CacheBands& bands, GpuBake& gpu,
                      std::pmr::memory_resource* memory) {
  if (texture.empty()) return;
  std::pmr::vector<std::uint32_t> shares(memory);
  shares.reserve(texture.begin.size() + texture.shares.size());
  for (const std::uint32_t first : texture.begin)
    shares.push_back(first + static_cast<std::uint32_t>(texture.begin.size()));
  shares.insert(shares.end(), texture.shares.begin(), texture.shares.end());
  gpu.gridShares = makeArray<std::uint32_t>(gl, shares);
  gpu.gridFactors = makeArray<float>(gl, packFactors(bands.lumaBands, memory));
  gpu.gridVectors = makeBuffer(gl, nullptr, std::size_t{texture.cacheCount} * 18 * 4 * sizeof(float), GL_DYNAMIC_COPY);
  const glm::uvec3 r = texture.resolution, cells = texture.cells();
  const auto depth = static_cast<int>(textureDepth(r.z));
  // The texels between the slabs stay zero: what filters may reach past a slab's end by rounding.
  const std::pmr::vector<std::uint16_t> zeros(std::size_t{4} * r.x * r.y * static_cast<std::size_t>(depth), 0, memory);
  const auto make = [&](GLenum stored, GLenum format) {
    Texture made = makeTexture(gl, GL_TEXTURE_3D, stored, r.x, r.y, depth);
    gl.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, 0, static_cast<GLsizei>(r.x), static_cast<GLsizei>(r.y), depth, format,
                     GL_HALF_FLOAT, zeros.data());
    return made;
  };
  gpu.gridTexels = make(GL_RGBA16F, GL_RGBA);
  gpu.gridChroma = make(GL_RG16F, GL_RG);
  gpu.gridOpen = makeTexture(gl, GL_TEXTURE_3D, GL_R8UI, cells.x, cells.y, static_cast<int>(cells.z));
  // Integers do not filter.
  gl.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, 0, static_cast<GLsizei>(cells.x), static_cast<GLsizei>(cells.y),
                   static_cast<GLsizei>(cells.z), GL_RED_INTEGER, GL_UNSIGNED_BYTE, texture.open.data());
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
  gpu.gridTextureBytes =
      static_cast<std::size_t>(gpu.gridShares.bytes + gpu.gridFactors.bytes + gpu.gridVectors.bytes) +
      std::size_t{12} * r.x * r.y * static_cast<std::size_t>(depth) + texture.open.size();
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
                static_cast<GLsizeiptr>(std::max((bytes + 3) / 4 * 4, kSmallest))};
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
  const PackedGrid grid = packGrid(bake.caches, texture, memory);
  gpu.gridCache = makeArray<std::uint32_t>(gl, grid.words);
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
