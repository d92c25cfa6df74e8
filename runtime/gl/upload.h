// SPDX-License-Identifier: MIT
// The bake on the GPU: buffers and textures that live as long as the relighter.
#pragma once

#include "relume/bake_data.h"
#include "relume/result.h"
#include "runtime/gl/handle.h"
#include "runtime/shared/bands.h"
#include "runtime/shared/grid_texture.h"
#include "runtime/shared/pack_surfel.h"

#include <memory_resource>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume::gl {

// Caches whose links one binding of the link buffers covers: drivers limit the size of a binding, not of a buffer.
// Repacked links (runtime/shared/link_set.h) are four to a unit, rows padded with links that carry nothing: a "link" is
// then such a unit.
struct LinkBatch {
  GLuint firstCache = 0, endCache = 0;
  GLuint firstLink = 0;
  GLintptr linkStart = 0, shapeStart = 0;  // [byte] aligned start of the bindings
  GLsizeiptr linkBytes = 0, shapeBytes = 0;
  GLuint wordOffset = 0, halfOffset = 0;  // where the batch's first link begins within them
};

// Threads of a work group that pulls, and inner nodes it gets at most.
struct PullGroup {
  int threads = 128;
  std::uint32_t nodes = 1024;
};

struct GpuBake {
  explicit GpuBake(std::pmr::memory_resource* memory) : batches(memory), surfelOrder(memory), skyOrder(memory) {}
  GpuBake(GpuBake&&) = default;
  // Of two of one resource; else the arrays would be copied.
  GpuBake& operator=(GpuBake&&) = default;

  // Surfels flat first, then tilted, then gridded (runtime/shared/receivers.h), each by ascending leaf, with empty
  // slots between (shaders/lib/leaf_node.glsl); leafNode: theirs, then the sky's.
  Buffer surfels, emission, leafNode;
  Buffer emitters;                        // RELUME_SLOT_EMITTERS
  Buffer gridded;                         // RELUME_SLOT_GRIDDED
  Buffer nodes;                           // runtime/shared/pack_color.h, written every frame
  Buffer pullNode, pullRuns, pullRounds;  // PullSchedule
  Buffer rows, links, linkShape;          // RELUME_SLOT_LINKS, RELUME_SLOT_LINK_SHAPE
  Buffer caches;                          // coefficients of those before firstMapCache, written every frame
  Buffer gridCache, resolve;
  Buffer mapTexels;                       // RELUME_SLOT_MAP_TEXELS
  Buffer texels;                          // RELUME_SLOT_TEXELS, written every frame
  Texture mapY, mapCo, mapCg, mapNormal;  // but for mapNormal written every frame
  // Of the grid's texture, where there is one: RELUME_SLOT_FACTORS, RELUME_SLOT_SHARES, RELUME_SLOT_VECTORS.
  Buffer gridFactors, gridShares, gridVectors;
  Texture gridTexels, gridChroma, gridOpen;  // GL_TEXTURE_3D; the first two are written every frame
  std::size_t gridTextureBytes = 0;
  std::pmr::vector<LinkBatch> batches;
  int nodeSteps = -1;  // repacked links: indices a row where nodes step; -1 = links as they are baked
  // The bake's number of each surfel, kRelumeNone at empty slots; see orderSurfels().
  std::pmr::vector<std::uint32_t> surfelOrder;
  std::pmr::vector<std::uint32_t> skyOrder;  // likewise the patches of the sky
  // Where flat, tilted and all surfels end, and the sky's patches: multiples of RELUME_SURFEL_GROUP.
  GLuint flatEnd = 0, tiltedEnd = 0, surfelEnd = 0, senderEnd = 0;
  SurfelBox box;       // of the surfels' positions
  bool emits = false;  // whether any surfel has emission, or can have
  PullGroup pullGroup;
  GLuint pullGroupCount = 0, pullRoundCount = 0;
  GLuint firstMapCache = 0;            // caches from here on are the light map's
  GLuint mapWidth = 0, mapHeight = 0;  // 0 = no light map; the textures are then one empty texel

  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;
  std::size_t textureBytes = 0;
};

// Words of four halves that a channel's coefficients take: in the caches' buffer, padded, and as layers of the light
// map.
inline int wordsOf(int bands) { return (bands * bands + 3) / 4; }
// Bytes of one cache's coefficients in their buffer.
inline std::size_t cacheBytes(const CacheBands& bands) {
  return 8 * static_cast<std::size_t>(wordsOf(bands.lumaBands) + 2 * wordsOf(bands.chromaBands));
}

// How the driver runs the threads of a work group. OpenGL has no limit that tells the two apart, and a measurement when
// the backend is made would cost every load and cut the work differently from run to run, so the driver's name decides.
// It decides time alone: tests hold both cuts against each other.
enum class GroupThreads {
  serial,    // one after the other, barriers are dear, few groups run at once: software rasterisers
  parallel,  // side by side: hardware
};
GroupThreads groupThreadsOf(const char* renderer);
PullGroup choosePullGroup(GroupThreads threads);

// Bytes of the smallest buffer, so that each can be bound.
inline constexpr std::size_t kSmallestBuffer = 16;
// A buffer of `bytes`, at least kSmallestBuffer; zeros when data is null.
Buffer makeBuffer(const Functions& gl, const void* data, std::size_t bytes, GLenum usage);
template <class T>
Buffer makeArray(const Functions& gl, std::span<const T> data) {
  return makeBuffer(gl, data.data(), data.size_bytes(), GL_STATIC_DRAW);
}

// Copy a buffer to memory, leaving the bindings as they were.
template <class T>
std::pmr::vector<T> readBuffer(const Functions& gl, const Buffer& buffer, std::size_t count,
                               std::pmr::memory_resource* memory) {
  std::pmr::vector<T> data(count, memory);
  GLint bound = 0;
  gl.GetIntegerv(GL_COPY_READ_BUFFER_BINDING, &bound);
  gl.BindBuffer(GL_COPY_READ_BUFFER, buffer.get());
  gl.GetBufferSubData(GL_COPY_READ_BUFFER, 0, static_cast<GLsizeiptr>(count * sizeof(T)), data.data());
  gl.BindBuffer(GL_COPY_READ_BUFFER, static_cast<GLuint>(bound));
  return data;
}

// Take all light off the caches and the light map. State must be saved. Throws std::bad_alloc, with all light still
// there.
void clearLight(const Functions& gl, const Bake& bake, const CacheBands& bands, GpuBake& gpu,
                std::pmr::memory_resource* memory);

// Fill surfelOrder, where it is not yet: only a host that hands over light for each surfel pays for it.
void orderSurfels(const Functions& gl, const Bake& bake, GpuBake& gpu);

// unsupported: a buffer larger than the driver binds, a light map larger than its textures. State must be saved.
// texture: the grid's, may be empty. memory: of what is kept and of what is made for the driver.
Result<GpuBake> uploadBake(const Functions& gl, const Bake& bake, const GridTexture& texture, const CacheBands& bands,
                           GroupThreads threads, std::pmr::memory_resource* memory);

// [byte] of the largest buffer that can be bound; [texel] of the longest side of a 3-D texture.
std::size_t maxStorageBytes(const Functions& gl);
std::uint32_t max3dSide(const Functions& gl);

}  // namespace relume::gl
