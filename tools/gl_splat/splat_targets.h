// SPDX-License-Identifier: MIT
// What splats of any kind draw from and into: the pixels' places and normals, two targets of sums, the picture; and the
// records' boxes and weights, as attributes of instances. State must be saved around every call (saved_drawing.h,
// runtime/gl/saved_state.h).
#pragma once

#include "bake/preview/receiver.h"
#include "bake/preview/record.h"
#include "bake/preview/weights.h"
#include "bake/scene/camera_rays.h"
#include "relume/result.h"
#include "runtime/gl/functions.h"
#include "runtime/gl/handle.h"

#include <glm/vec4.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relume::gl {

// What of a record does not depend on the light.
struct SplatShape {
  glm::uvec4 box;              // [pixel]
  glm::vec4 position, normal;  // [m] and reach; unit, and the share of the gradient that counts
  float near;                  // [m] R_k where neighbour clamping asks for it, else 0
};
static_assert(sizeof(SplatShape) == 52);
SplatShape splatShapeOf(const CameraRays& camera, const Record& record, const Interpolation& options);

Error splatUsage(std::string message);
Error splatUnsupported(std::string message);
std::string splatSizeText(std::uint32_t width, std::uint32_t height);

class SplatTargets {
 public:
  // Bindings of the vertex array: of SplatShape, and of what else a record has.
  static constexpr GLuint kShapeBinding = 0, kLightBinding = 1;

  // pictureFormats: of one texture or two, RGBA32F or RGBA32UI.
  SplatTargets(const Functions& functions, const DrawFunctions& drawing, std::vector<GLenum> pictureFormats);
  ~SplatTargets();
  SplatTargets(const SplatTargets&) = delete;
  SplatTargets& operator=(const SplatTargets&) = delete;

  // Textures, framebuffers, and the vertex array, which reads `shapes` and `light`. Once.
  void make(const Buffer& shapes, const Buffer& light, GLsizei lightStride);
  // Objects of their own, without storage.
  Texture makeTexture();
  Buffer makeBuffer();

  // Targets of the camera's size; those there are if it is the same. unsupported: beyond the limits, not a target;
  // memory.
  Status setSize(const CameraRays& camera);
  void forgetSize() { width = height = 0; }
  // Place and facing of the pixels. [Size width * height]
  void sendPixels(std::span<const PixelReceiver> receivers);
  // Anything else of them.
  template <class TexelOf>
  void send(const Texture& texture, std::size_t count, const TexelOf& texelOf) {
    pixels_.resize(count);
    for (std::size_t i = 0; i < count; ++i) pixels_[i] = texelOf(i);
    storage(texture, GL_RGBA32F, pixels_.data());
    sentBytes += count * sizeof(glm::vec4);
  }
  // Send what there is from number `from` on; where that is all, into new memory for `room` of them, so that what is
  // still being drawn keeps what it reads.
  template <class T>
  void sendBuffer(const Buffer& buffer, const std::vector<T>& all, std::size_t from, std::size_t room) {
    sendBytes(buffer, std::as_bytes(std::span(all)).subspan(from * sizeof(T)), from * sizeof(T), room * sizeof(T));
  }

  void clearSums();
  // Into the sums, by blending. second: into the second as well.
  void beginSums(GLuint program, const Interpolation& interpolation, bool second);
  void drawRecords(std::size_t first, std::size_t end);
  // From the sums into the picture, by a program.
  void show(GLuint program);
  void clearPicture();
  void bind(GLuint unit, const Texture& texture);
  // A picture's or sum's texels. [Size width * height]
  std::span<const glm::vec4> read(const Texture& texture);
  // memory: OpenGL has run out of it since the last call.
  Status takeError(const std::string& what);
  std::size_t textureBytes() const { return (std::size_t{4} + picture.size()) * width * height * sizeof(glm::vec4); }

  const Functions gl;  // what handles point to
  const DrawFunctions draw;
  std::uint32_t width = 0, height = 0;
  std::size_t sentBytes = 0;
  Texture place, facing;
  std::array<Texture, 2> sum;
  std::vector<Texture> picture;

 private:
  void storage(const Texture& texture, GLenum format, const void* data);
  void sendBytes(const Buffer& buffer, std::span<const std::byte> bytes, std::size_t at, std::size_t room);
  bool attach(GLuint framebuffer, std::span<const Texture> textures);
  void setViewport();

  std::vector<GLenum> formats_;
  GLint maxSide_ = 0;
  GLuint sumTarget_ = 0, pictureTarget_ = 0, vertexArray_ = 0;
  std::vector<glm::vec4> pixels_;
};

}  // namespace relume::gl
