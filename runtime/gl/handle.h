// SPDX-License-Identifier: MIT
// Owners of OpenGL names. The context that made them must be current when they die.
#pragma once

#include "runtime/gl/functions.h"

#include <utility>

namespace relume::gl {

// Owns one name; Delete frees it by the functions it was made with. Zero is nothing.
template <void (*Delete)(const Functions& gl, GLuint name)>
class Handle {
 public:
  Handle() = default;
  Handle(const Functions& gl, GLuint name) : gl_(&gl), name_(name) {}
  Handle(Handle&& other) noexcept : gl_(other.gl_), name_(std::exchange(other.name_, 0)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(gl_, other.gl_);
    std::swap(name_, other.name_);
    return *this;
  }
  ~Handle() {
    if (name_ != 0) Delete(*gl_, name_);
  }
  GLuint get() const { return name_; }

 private:
  const Functions* gl_ = nullptr;
  GLuint name_ = 0;
};

namespace detail {
inline void deleteBuffer(const Functions& gl, GLuint name) { gl.DeleteBuffers(1, &name); }
inline void deleteTexture(const Functions& gl, GLuint name) { gl.DeleteTextures(1, &name); }
inline void deleteProgram(const Functions& gl, GLuint name) { gl.DeleteProgram(name); }
inline void deleteShader(const Functions& gl, GLuint name) { gl.DeleteShader(name); }
inline void deleteSampler(const Functions& gl, GLuint name) { gl.DeleteSamplers(1, &name); }
inline void deleteQuery(const Functions& gl, GLuint name) { gl.DeleteQueries(1, &name); }
}  // namespace detail

using Texture = Handle<detail::deleteTexture>;
using Sampler = Handle<detail::deleteSampler>;
using Program = Handle<detail::deleteProgram>;
using Shader = Handle<detail::deleteShader>;
using Query = Handle<detail::deleteQuery>;

// A buffer and its size.
struct Buffer {
  Handle<detail::deleteBuffer> name;
  GLsizeiptr bytes = 0;

  GLuint get() const { return name.get(); }
};

}  // namespace relume::gl
