// SPDX-License-Identifier: MIT
// Buffers and textures that grow with a level's voxels and caches, and are kept from frame to frame.
#pragma once

#include "runtime/gl/handle.h"
#include "runtime/gl/host_writes.h"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume::gl {

// A storage buffer with room for more than it holds.
class GrowingBuffer {
 public:
  explicit GrowingBuffer(const Functions& gl) : gl_(&gl), writes_(gl) {}
  // Room for so many bytes. True where there was none: what it held is gone, and all is zero.
  bool reserve(std::size_t wanted);
  // [begin + data within what was reserved]
  void write(std::size_t begin, std::span<const std::byte> data);
  void clear();
  void bind(GLuint slot) const;
  // The first word, read back.
  std::uint32_t readWord() const;
  GLuint name() const { return buffer_.get(); }
  std::size_t bytes() const { return static_cast<std::size_t>(buffer_.bytes); }

 private:
  const Functions* gl_;
  Buffer buffer_;
  HostWrites writes_;
};

// How a texture's texels are stored and handed over.
struct TexelFormat {
  GLenum stored, layout, type;
  std::size_t bytes;
};
inline constexpr TexelFormat kFloats{GL_RGBA32F, GL_RGBA, GL_FLOAT, 16};
inline constexpr TexelFormat kWords{GL_RGBA32UI, GL_RGBA_INTEGER, GL_UNSIGNED_INT, 16};

// Rows of texels that are read by their number alone, with room for more rows than are needed.
class GrowingRows {
 public:
  GrowingRows(const Functions& gl, TexelFormat format, std::uint32_t width)
      : gl_(&gl), format_(format), width_(width) {}
  // Room for so many rows, one at least. True where there was none: what it held is gone. State must be saved, here and
  // below; unit 12 is used.
  bool reserve(std::uint32_t wanted);
  // Texels of so many rows from the first on. The last one may be in part.
  void write(std::span<const std::byte> texels, std::uint32_t firstRow = 0);
  void bind(GLuint unit) const;
  void bindImage(GLuint unit, GLenum access) const;
  GLuint name() const { return texture_.get(); }
  std::uint32_t rows() const { return rows_; }
  std::size_t bytes() const { return format_.bytes * width_ * rows_; }

 private:
  const Functions* gl_;
  TexelFormat format_;
  std::uint32_t width_, rows_ = 0;
  Texture texture_;
};

// Four words a cell.
class CellTexture {
 public:
  explicit CellTexture(const Functions& gl) : gl_(&gl) {}
  // Room for so many cells. True where there was none: what it held is gone. State must be saved, here and below; unit
  // 12 is used.
  bool reserve(const glm::ivec3& cells);
  // Of all cells, or of a box of them whose layers begin at one.
  void write(int x, int y, int z, const void* words);
  void writeLayers(const glm::ivec3& cells, int layer, const void* words);
  void bind(GLuint unit) const;
  GLuint name() const { return texture_.get(); }
  const glm::ivec3& size() const { return size_; }
  std::size_t count() const { return cells_; }
  std::size_t bytes() const { return kWords.bytes * cells_; }

 private:
  const Functions* gl_;
  glm::ivec3 size_{0};
  std::size_t cells_ = 0;
  Texture texture_;
};

// Two words of bits a cell, beside each other along x, which shaders set.
class BrickTexture {
 public:
  explicit BrickTexture(const Functions& gl) : gl_(&gl) {}
  // Once. State must be saved, here and below.
  void make(const glm::ivec3& cells);
  void bindImage(GLuint unit) const;
  GLuint name() const { return texture_.get(); }
  std::uint32_t words() const { return words_; }
  std::vector<std::uint64_t> read() const;  // [Size cells]

 private:
  const Functions* gl_;
  std::uint32_t words_ = 0;
  Texture texture_;
};
inline constexpr GLenum kBrickFormat = GL_R32UI;
// Of the texture over so many cells. [texel]
inline glm::ivec3 brickTexels(const glm::ivec3& cells) { return {2 * cells.x, cells.y, cells.z}; }

// Uniforms by their names; those that a program does not have are left.
inline void setUniform(const Functions& gl, const Program& program, const char* name, std::uint32_t value) {
  gl.ProgramUniform1ui(program.get(), gl.GetUniformLocation(program.get(), name), value);
}
inline void setUniform(const Functions& gl, const Program& program, const char* name, std::int32_t value) {
  gl.ProgramUniform1i(program.get(), gl.GetUniformLocation(program.get(), name), value);
}
inline void setUniform(const Functions& gl, const Program& program, const char* name, float value) {
  gl.ProgramUniform1f(program.get(), gl.GetUniformLocation(program.get(), name), value);
}
inline void setUniform(const Functions& gl, const Program& program, const char* name, const glm::vec3& v) {
  gl.ProgramUniform3f(program.get(), gl.GetUniformLocation(program.get(), name), v.x, v.y, v.z);
}
inline void setUniform(const Functions& gl, const Program& program, const char* name, const glm::uvec2& v) {
  gl.ProgramUniform2ui(program.get(), gl.GetUniformLocation(program.get(), name), v.x, v.y);
}
inline void setUniform(const Functions& gl, const Program& program, const char* name, const glm::uvec3& v) {
  gl.ProgramUniform3ui(program.get(), gl.GetUniformLocation(program.get(), name), v.x, v.y, v.z);
}

// Waits for all that shaders have written, whoever reads it next.
void waitForShaders(const Functions& gl);

// A texture of one level without a filter, bound to unit 12. State must be saved.
Texture makeTexture(const Functions& gl, GLenum target);

// 2-D textures of the host's that shaders read texel by texel: by a sampler of its own, since one without mip levels
// is not complete by the parameters that textures begin with, and reads as black.
class HostTextures {
 public:
  explicit HostTextures(const Functions& gl);
  // State must be saved.
  void bind(GLuint unit, GLuint texture) const;

 private:
  const Functions* gl_;
  Sampler sampler_;
};

// A voxel's axis as shaders read it beside the front's radiance: 127 times the unit vector, 128 added to each.
inline std::uint32_t packAxis(const glm::ivec3& axis) {
  const glm::uvec3 bytes(axis + 128);
  return bytes.x << 16 | bytes.y << 8 | bytes.z;
}

// A voxel's place, 10 bits each.
inline std::uint32_t packVoxel(const glm::ivec3& v) {
  return static_cast<std::uint32_t>(v.x) | static_cast<std::uint32_t>(v.y) << 10 |
         static_cast<std::uint32_t>(v.z) << 20;
}

// So many threads of a program that has lib/live_threads.glsl.
void runThreads(const Functions& gl, const Program& program, std::uint32_t threads);

template <class T>
std::span<const std::byte> bytesOf(const T& array) {
  return std::as_bytes(std::span(array.data(), array.size()));
}

}  // namespace relume::gl
