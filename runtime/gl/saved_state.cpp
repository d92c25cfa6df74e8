// SPDX-License-Identifier: MIT
// See saved_state.h.
#include "runtime/gl/saved_state.h"

#include "shaders/shared/layout.h"

namespace relume::gl {
namespace {

constexpr GLuint kEndUnit = 16;
constexpr std::array<GLenum, 16> kPixelStore = {
    GL_PACK_SWAP_BYTES,    GL_PACK_LSB_FIRST,   GL_PACK_ROW_LENGTH,     GL_PACK_SKIP_ROWS,
    GL_PACK_SKIP_PIXELS,   GL_PACK_ALIGNMENT,   GL_PACK_IMAGE_HEIGHT,   GL_PACK_SKIP_IMAGES,
    GL_UNPACK_SWAP_BYTES,  GL_UNPACK_LSB_FIRST, GL_UNPACK_ROW_LENGTH,   GL_UNPACK_SKIP_ROWS,
    GL_UNPACK_SKIP_PIXELS, GL_UNPACK_ALIGNMENT, GL_UNPACK_IMAGE_HEIGHT, GL_UNPACK_SKIP_IMAGES};
constexpr GLint pixelStoreDefault(GLenum what) {
  return what == GL_PACK_ALIGNMENT || what == GL_UNPACK_ALIGNMENT ? 4 : 0;
}

static_assert(SavedState::kUniformSlot == RELUME_RESOLVE_SLOT_UNIFORMS);

GLuint nameAgain(GLint name, GLboolean(APIENTRYP isObject)(GLuint)) {
  const auto unsignedName = static_cast<GLuint>(name);
  return name != 0 && isObject(unsignedName) == GL_TRUE ? unsignedName : 0;
}

}  // namespace

GLuint bufferAgain(const Functions& gl, GLint name) { return nameAgain(name, gl.IsBuffer); }
GLuint textureAgain(const Functions& gl, GLint name) { return nameAgain(name, gl.IsTexture); }

GLint integerOf(const Functions& gl, GLenum what) {
  GLint value = 0;
  gl.GetIntegerv(what, &value);
  return value;
}

GLint integerOf(const Functions& gl, GLenum what, GLuint index) {
  GLint value = 0;
  gl.GetIntegeri_v(what, index, &value);
  return value;
}

SavedState::Range SavedState::queryRange(GLenum binding, GLenum start, GLenum size, GLuint slot) const {
  Range range;
  range.buffer = integerOf(gl_, binding, slot);
  gl_.GetInteger64i_v(start, slot, &range.start);
  gl_.GetInteger64i_v(size, slot, &range.size);
  return range;
}

void SavedState::restoreRange(GLenum target, GLuint slot, const Range& range) const {
  const GLuint buffer = bufferAgain(gl_, range.buffer);
  if (buffer == 0 || range.size == 0) {
    gl_.BindBufferBase(target, slot, buffer);
  } else {
    gl_.BindBufferRange(target, slot, buffer, static_cast<GLintptr>(range.start), static_cast<GLsizeiptr>(range.size));
  }
}

SavedState::SavedState(const Functions& gl, GLuint units)
    : gl_(gl),
      program_(integerOf(gl_, GL_CURRENT_PROGRAM)),
      storage_(integerOf(gl_, GL_SHADER_STORAGE_BUFFER_BINDING)),
      uniform_(integerOf(gl_, GL_UNIFORM_BUFFER_BINDING)),
      copyRead_(integerOf(gl_, GL_COPY_READ_BUFFER_BINDING)),
      copyWrite_(integerOf(gl_, GL_COPY_WRITE_BUFFER_BINDING)),
      pixelPack_(integerOf(gl_, GL_PIXEL_PACK_BUFFER_BINDING)),
      pixelUnpack_(integerOf(gl_, GL_PIXEL_UNPACK_BUFFER_BINDING)),
      indirect_(integerOf(gl_, GL_DISPATCH_INDIRECT_BUFFER_BINDING)),
      activeUnit_(integerOf(gl_, GL_ACTIVE_TEXTURE)),
      firstUnit_(kEndUnit - units) {
  for (GLuint i = 0; i < kStorageSlots; ++i) {
    storageSlot_[i] =
        queryRange(GL_SHADER_STORAGE_BUFFER_BINDING, GL_SHADER_STORAGE_BUFFER_START, GL_SHADER_STORAGE_BUFFER_SIZE, i);
  }
  uniformSlot_ = queryRange(GL_UNIFORM_BUFFER_BINDING, GL_UNIFORM_BUFFER_START, GL_UNIFORM_BUFFER_SIZE, kUniformSlot);
  for (GLuint i = 0; firstUnit_ + i < kEndUnit; ++i) {
    gl_.ActiveTexture(GL_TEXTURE0 + firstUnit_ + i);
    unit_[i] = {integerOf(gl_, GL_TEXTURE_BINDING_2D), integerOf(gl_, GL_TEXTURE_BINDING_2D_ARRAY),
                integerOf(gl_, GL_TEXTURE_BINDING_3D), integerOf(gl_, GL_SAMPLER_BINDING)};
    gl_.BindSampler(firstUnit_ + i, 0);
  }
  for (GLuint i = 0; i < image_.size(); ++i) {
    image_[i] = {integerOf(gl_, GL_IMAGE_BINDING_NAME, i),    integerOf(gl_, GL_IMAGE_BINDING_LEVEL, i),
                 integerOf(gl_, GL_IMAGE_BINDING_LAYERED, i), integerOf(gl_, GL_IMAGE_BINDING_LAYER, i),
                 integerOf(gl_, GL_IMAGE_BINDING_ACCESS, i),  integerOf(gl_, GL_IMAGE_BINDING_FORMAT, i)};
  }
  gl_.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  gl_.BindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
  for (std::size_t i = 0; i < kPixelStore.size(); ++i) {
    store_[i] = integerOf(gl_, kPixelStore[i]);
    gl_.PixelStorei(kPixelStore[i], pixelStoreDefault(kPixelStore[i]));
  }
}

SavedState::~SavedState() {
  for (std::size_t i = 0; i < kPixelStore.size(); ++i) gl_.PixelStorei(kPixelStore[i], store_[i]);
  for (GLuint i = 0; i < image_.size(); ++i) {
    const Image& image = image_[i];
    gl_.BindImageTexture(i, textureAgain(gl_, image.name), image.level, static_cast<GLboolean>(image.layered != 0),
                         image.layer, static_cast<GLenum>(image.access), static_cast<GLenum>(image.format));
  }
  for (GLuint i = 0; firstUnit_ + i < kEndUnit; ++i) {
    gl_.ActiveTexture(GL_TEXTURE0 + firstUnit_ + i);
    gl_.BindTexture(GL_TEXTURE_2D, textureAgain(gl_, unit_[i].texture2D));
    gl_.BindTexture(GL_TEXTURE_2D_ARRAY, textureAgain(gl_, unit_[i].texture2DArray));
    gl_.BindTexture(GL_TEXTURE_3D, textureAgain(gl_, unit_[i].texture3D));
    gl_.BindSampler(firstUnit_ + i, nameAgain(unit_[i].sampler, gl_.IsSampler));
  }
  // Indexed bindings also set the generic one: restore that last.
  for (GLuint i = 0; i < kStorageSlots; ++i) restoreRange(GL_SHADER_STORAGE_BUFFER, i, storageSlot_[i]);
  restoreRange(GL_UNIFORM_BUFFER, kUniformSlot, uniformSlot_);
  gl_.ActiveTexture(static_cast<GLenum>(activeUnit_));
  gl_.BindBuffer(GL_PIXEL_PACK_BUFFER, bufferAgain(gl_, pixelPack_));
  gl_.BindBuffer(GL_PIXEL_UNPACK_BUFFER, bufferAgain(gl_, pixelUnpack_));
  gl_.BindBuffer(GL_COPY_WRITE_BUFFER, bufferAgain(gl_, copyWrite_));
  gl_.BindBuffer(GL_DISPATCH_INDIRECT_BUFFER, bufferAgain(gl_, indirect_));
  gl_.BindBuffer(GL_COPY_READ_BUFFER, bufferAgain(gl_, copyRead_));
  gl_.BindBuffer(GL_UNIFORM_BUFFER, bufferAgain(gl_, uniform_));
  gl_.BindBuffer(GL_SHADER_STORAGE_BUFFER, bufferAgain(gl_, storage_));
  gl_.UseProgram(nameAgain(program_, gl_.IsProgram));
}

}  // namespace relume::gl
