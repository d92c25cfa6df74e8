// SPDX-License-Identifier: MIT
// See live_objects.h.
#include "runtime/live_gl/live_objects.h"

#include "runtime/gl/plan_objects.h"
#include "shaders/shared/layout.h"

#include <algorithm>

namespace relume::gl {

Texture makeTexture(const Functions& gl, GLenum target) {
  GLuint name = 0;
  gl.GenTextures(1, &name);
  Texture texture(gl, name);
  gl.ActiveTexture(GL_TEXTURE0 + RELUME_LIVE_UNIT_CELLS);
  gl.BindTexture(target, name);
  gl.TexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl.TexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  return texture;
}

HostTextures::HostTextures(const Functions& gl) : gl_(&gl) {
  GLuint name = 0;
  gl.GenSamplers(1, &name);
  sampler_ = Sampler(gl, name);
  gl.SamplerParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl.SamplerParameteri(name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

void HostTextures::bind(GLuint unit, GLuint texture) const {
  gl_->ActiveTexture(GL_TEXTURE0 + unit);
  gl_->BindTexture(GL_TEXTURE_2D, texture);
  gl_->BindSampler(unit, sampler_.get());
}

void waitForShaders(const Functions& gl) {
  gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                   GL_TEXTURE_UPDATE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

bool GrowingBuffer::reserve(std::size_t wanted) {
  constexpr std::size_t kLeast = 256;
  if (bytes() >= std::max(wanted, kLeast)) return false;
  // A quarter more, so that what moves does not ask again each frame; whole words.
  buffer_ = makeBuffer(*gl_, {}, std::max(wanted + wanted / 4, kLeast) / 16 * 16 + 16, GL_DYNAMIC_DRAW);
  writes_.prepare();
  return true;
}

void GrowingBuffer::write(std::size_t begin, std::span<const std::byte> data) { writes_.write(buffer_, begin, data); }

void GrowingBuffer::clear() {
  gl_->BindBuffer(GL_COPY_WRITE_BUFFER, name());
  gl_->ClearBufferData(GL_COPY_WRITE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
}

std::uint32_t GrowingBuffer::readWord() const {
  std::uint32_t word = 0;
  gl_->BindBuffer(GL_COPY_READ_BUFFER, name());
  gl_->GetBufferSubData(GL_COPY_READ_BUFFER, 0, sizeof word, &word);
  return word;
}

void GrowingBuffer::bind(GLuint slot) const { gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, slot, name()); }

bool GrowingRows::reserve(std::uint32_t wanted) {
  if (rows_ >= std::max(wanted, 1u)) return false;
  texture_ = makeTexture(*gl_, GL_TEXTURE_2D);
  const std::uint32_t most = deviceOf(*gl_, gpu::GroupThreads::parallel).imageSide;
  rows_ = std::max(wanted, std::min(wanted + wanted / 4 + 1, most));
  gl_->TexStorage2D(GL_TEXTURE_2D, 1, format_.stored, static_cast<GLsizei>(width_), static_cast<GLsizei>(rows_));
  return true;
}

void GrowingRows::write(std::span<const std::byte> texels, std::uint32_t firstRow) {
  const std::size_t row = format_.bytes * width_, full = texels.size() / row;
  const std::size_t rest = (texels.size() - row * full) / format_.bytes;
  bind(RELUME_LIVE_UNIT_CELLS);
  if (full > 0)
    gl_->TexSubImage2D(GL_TEXTURE_2D, 0, 0, static_cast<GLint>(firstRow), static_cast<GLsizei>(width_),
                       static_cast<GLsizei>(full), format_.layout, format_.type, texels.data());
  if (rest > 0)
    gl_->TexSubImage2D(GL_TEXTURE_2D, 0, 0, static_cast<GLint>(firstRow + full), static_cast<GLsizei>(rest), 1,
                       format_.layout, format_.type, texels.data() + row * full);
}

void GrowingRows::bind(GLuint unit) const {
  gl_->ActiveTexture(GL_TEXTURE0 + unit);
  gl_->BindTexture(GL_TEXTURE_2D, name());
}

void GrowingRows::bindImage(GLuint unit, GLenum access) const {
  gl_->BindImageTexture(unit, name(), 0, GL_FALSE, 0, access, format_.stored);
}

bool CellTexture::reserve(const glm::ivec3& cells) {
  if (cells == size_) return false;
  texture_ = makeTexture(*gl_, GL_TEXTURE_3D);
  gl_->TexStorage3D(GL_TEXTURE_3D, 1, kWords.stored, cells.x, cells.y, cells.z);
  size_ = cells;
  cells_ = static_cast<std::size_t>(cells.x) * static_cast<std::size_t>(cells.y) * static_cast<std::size_t>(cells.z);
  return true;
}

void CellTexture::write(int x, int y, int z, const void* words) {
  reserve({x, y, z});
  writeLayers({x, y, z}, 0, words);
}

void CellTexture::writeLayers(const glm::ivec3& cells, int layer, const void* words) {
  bind(RELUME_LIVE_UNIT_CELLS);
  gl_->TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, layer, cells.x, cells.y, cells.z, kWords.layout, kWords.type, words);
}

void CellTexture::bind(GLuint unit) const {
  gl_->ActiveTexture(GL_TEXTURE0 + unit);
  gl_->BindTexture(GL_TEXTURE_3D, name());
}

void BrickTexture::make(const glm::ivec3& cells) {
  const glm::ivec3 size = brickTexels(cells);
  texture_ = makeTexture(*gl_, GL_TEXTURE_3D);
  gl_->TexStorage3D(GL_TEXTURE_3D, 1, kBrickFormat, size.x, size.y, size.z);
  words_ = static_cast<std::uint32_t>(size.x) * static_cast<std::uint32_t>(size.y) * static_cast<std::uint32_t>(size.z);
}

void BrickTexture::bindImage(GLuint unit) const {
  gl_->BindImageTexture(unit, name(), 0, GL_TRUE, 0, GL_READ_WRITE, kBrickFormat);
}

std::vector<std::uint64_t> BrickTexture::read() const {
  std::vector<std::uint32_t> words(words_);
  gl_->ActiveTexture(GL_TEXTURE0 + RELUME_LIVE_UNIT_CELLS);
  gl_->BindTexture(GL_TEXTURE_3D, name());
  gl_->GetTexImage(GL_TEXTURE_3D, 0, GL_RED_INTEGER, GL_UNSIGNED_INT, words.data());
  std::vector<std::uint64_t> bits(words.size() / 2);
  for (std::size_t c = 0; c < bits.size(); ++c) bits[c] = words[2 * c] | std::uint64_t{words[2 * c + 1]} << 32;
  return bits;
}

void runThreads(const Functions& gl, const Program& program, std::uint32_t threads) {
  const GLuint groups = threads / RELUME_LIVE_GROUP + (threads % RELUME_LIVE_GROUP > 0 ? 1 : 0);
  if (groups == 0) return;
  gl.ProgramUniform1ui(program.get(), gl.GetUniformLocation(program.get(), "relumeLiveThreads"), threads);
  gl.UseProgram(program.get());
  gl.DispatchCompute(std::min<GLuint>(groups, RELUME_LIVE_MAX_GROUPS),
                     (groups + RELUME_LIVE_MAX_GROUPS - 1) / RELUME_LIVE_MAX_GROUPS, 1);
}

}  // namespace relume::gl
