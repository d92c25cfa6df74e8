// SPDX-License-Identifier: MIT
// Owners of OpenGL names: made when asked for, deleted with the owner, movable. The context they were made in must be
// current when they die.
#pragma once

#include <epoxy/gl.h>

#include <utility>

namespace relume {

template <class Traits>
class GlHandle {
 public:
  GlHandle() = default;
  explicit GlHandle(GLuint name) : name_(name) {}
  static GlHandle make() { return GlHandle(Traits::make()); }
  GlHandle(GlHandle&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlHandle& operator=(GlHandle&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  GlHandle(const GlHandle&) = delete;
  GlHandle& operator=(const GlHandle&) = delete;
  ~GlHandle() {
    if (name_ != 0) Traits::destroy(name_);
  }
  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

namespace gl_traits {
struct Buffer {
  static GLuint make() {
    GLuint n = 0;
    glGenBuffers(1, &n);
    return n;
  }
  static void destroy(GLuint n) { glDeleteBuffers(1, &n); }
};
struct Texture {
  static GLuint make() {
    GLuint n = 0;
    glGenTextures(1, &n);
    return n;
  }
  static void destroy(GLuint n) { glDeleteTextures(1, &n); }
};
struct Sampler {
  static GLuint make() {
    GLuint n = 0;
    glGenSamplers(1, &n);
    return n;
  }
  static void destroy(GLuint n) { glDeleteSamplers(1, &n); }
};
struct VertexArray {
  static GLuint make() {
    GLuint n = 0;
    glGenVertexArrays(1, &n);
    return n;
  }
  static void destroy(GLuint n) { glDeleteVertexArrays(1, &n); }
};
struct Framebuffer {
  static GLuint make() {
    GLuint n = 0;
    glGenFramebuffers(1, &n);
    return n;
  }
  static void destroy(GLuint n) { glDeleteFramebuffers(1, &n); }
};
struct Program {
  static GLuint make() { return glCreateProgram(); }
  static void destroy(GLuint n) { glDeleteProgram(n); }
};
struct Shader {
  static void destroy(GLuint n) { glDeleteShader(n); }
};
}  // namespace gl_traits

using GlBuffer = GlHandle<gl_traits::Buffer>;
using GlTexture = GlHandle<gl_traits::Texture>;
using GlSampler = GlHandle<gl_traits::Sampler>;
using GlVertexArray = GlHandle<gl_traits::VertexArray>;
using GlFramebuffer = GlHandle<gl_traits::Framebuffer>;
using GlProgram = GlHandle<gl_traits::Program>;
using GlShader = GlHandle<gl_traits::Shader>;

}  // namespace relume
