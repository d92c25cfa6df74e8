// SPDX-License-Identifier: MIT
// Owners of OpenGL names. The context that made them must be current when they die.
#pragma once

#include <epoxy/gl.h>

#include <utility>

namespace relume::gl {

// Owns one name; Delete frees it. Zero is nothing.
template <void (*Delete)(GLuint)>
class Handle {
 public:
  Handle() = default;
  explicit Handle(GLuint name) : name_(name) {}
  Handle(Handle&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~Handle() {
    if (name_ != 0) Delete(name_);
  }
  GLuint get() const { return name_; }

 private:
  GLuint name_ = 0;
};

namespace detail {
inline void deleteBuffer(GLuint name) { glDeleteBuffers(1, &name); }
inline void deleteTexture(GLuint name) { glDeleteTextures(1, &name); }
inline void deleteProgram(GLuint name) { glDeleteProgram(name); }
inline void deleteShader(GLuint name) { glDeleteShader(name); }
inline void deleteQuery(GLuint name) { glDeleteQueries(1, &name); }
}  // namespace detail

using Texture = Handle<detail::deleteTexture>;
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
