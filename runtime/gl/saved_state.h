// SPDX-License-Identifier: MIT
// What the backend binds, put back when it is done: the host's renderer never notices that a frame was relit.
#pragma once

#include "runtime/gl/functions.h"

#include <array>

namespace relume::gl {

// What the context says of `what`, or of one of several.
GLint integerOf(const Functions& gl, GLenum what);
GLint integerOf(const Functions& gl, GLenum what, GLuint index);

// What has been bound, to bind it again; 0 where it is no object any more: another context has deleted it, or the host
// a program that was in use. Such an object lives as long as it is bound, and its name cannot be bound again.
GLuint bufferAgain(const Functions& gl, GLint name);
GLuint textureAgain(const Functions& gl, GLint name);

// Remembers on construction and restores on destruction: the program; the generic and the indexed bindings 0 to 7 of
// GL_SHADER_STORAGE_BUFFER; the generic and indexed binding 7 of GL_UNIFORM_BUFFER; the active texture unit; 2-D, 2-D
// array and 3-D texture and sampler of the last of 16 units; image units 0 to 2; the copy buffers, the buffer of
// indirect dispatches and the pixel pack and unpack state.
class SavedState {
 public:
  static constexpr GLuint kStorageSlots = 8, kUniformSlot = 7;

  // units: how many, from 12 or an earlier one to 15. [4..8]
  explicit SavedState(const Functions& gl, GLuint units = 4);
  ~SavedState();
  SavedState(const SavedState&) = delete;
  SavedState& operator=(const SavedState&) = delete;

 private:
  struct Range {
    GLint buffer = 0;
    GLint64 start = 0, size = 0;
  };
  struct Unit {
    GLint texture2D = 0, texture2DArray = 0, texture3D = 0, sampler = 0;
  };
  struct Image {
    GLint name = 0, level = 0, layered = 0, layer = 0, access = 0, format = 0;
  };
  Range queryRange(GLenum binding, GLenum start, GLenum size, GLuint slot) const;
  void restoreRange(GLenum target, GLuint slot, const Range& range) const;

  const Functions& gl_;
  GLint program_ = 0, storage_ = 0, uniform_ = 0, copyRead_ = 0, copyWrite_ = 0, pixelPack_ = 0, pixelUnpack_ = 0,
        indirect_ = 0, activeUnit_ = 0;
  std::array<Range, kStorageSlots> storageSlot_;
  Range uniformSlot_;
  GLuint firstUnit_ = 0;
  std::array<Unit, 8> unit_;  // from the first on
  std::array<Image, 3> image_;
  std::array<GLint, 16> store_{};
};

}  // namespace relume::gl
