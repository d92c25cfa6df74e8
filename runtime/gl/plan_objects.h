// SPDX-License-Identifier: MIT
// A plan of passes (runtime/passes/frame_plan.h) in OpenGL: its buffers, textures and programs, which live as long as
// the relighter, and the running of its frames.
#pragma once

#include "relume/result.h"
#include "runtime/gl/handle.h"
#include "runtime/gl/host_writes.h"
#include "runtime/gl/saved_state.h"
#include "runtime/passes/frame_plan.h"

#include <array>
#include <memory_resource>
#include <optional>
#include <string_view>
#include <vector>

namespace relume::gl {

// OpenGL has no limit that tells the two apart, and a measurement when the backend is made would cost every load and
// cut the work differently from run to run, so the driver's name decides.
gpu::GroupThreads groupThreadsOf(const char* renderer);
// What is wanted, or suits the context's driver.
gpu::GroupThreads groupThreadsOf(const Functions& gl, std::optional<gpu::GroupThreads> wanted);

// What the driver can do. It has no limit of lights and arrays: buffers grow with what frames hand over.
GpuDevice deviceOf(const Functions& gl, gpu::GroupThreads threads);

// A buffer of `bytes`, of which `data` are the first; zeros where there are none. memory: for a copy until it is handed
// over. What is written to it before the device has used it goes by HostWrites.
Buffer makeBuffer(const Functions& gl, std::span<const std::byte> data, std::size_t bytes, GLenum usage,
                  std::pmr::memory_resource* memory = std::pmr::get_default_resource());

// Copy a buffer to memory, leaving the bindings as they were.
template <class T>
std::pmr::vector<T> readBuffer(const Functions& gl, const Buffer& buffer, std::size_t count,
                               std::pmr::memory_resource* memory) {
  std::pmr::vector<T> data(count, memory);
  const GLint bound = integerOf(gl, GL_COPY_READ_BUFFER_BINDING);
  gl.BindBuffer(GL_COPY_READ_BUFFER, buffer.get());
  gl.GetBufferSubData(GL_COPY_READ_BUFFER, 0, static_cast<GLsizeiptr>(count * sizeof(T)), data.data());
  gl.BindBuffer(GL_COPY_READ_BUFFER, bufferAgain(gl, bound));
  return data;
}

class PlanObjects {
 public:
  // Nothing yet. `plan` must outlive this.
  PlanObjects(const Functions& gl, const gpu::FramePlan& plan, std::pmr::memory_resource* memory);

  // State must be saved, here and below. unsupported: not enough memory; failed: a shader's log.
  Status make(std::string_view visibilityGlsl);

  const Buffer& buffer(std::uint32_t index) const { return buffers_[index]; }
  const Texture& texture(std::uint32_t index) const { return textures_[index]; }
  GLuint program(std::string_view path) const;
  // [vec4 each] irradiance of the surfels for the host's shader to write; made, all zero, when it is first asked for.
  void makeSurfelLight();
  bool hasSurfelLight() const { return bufferBytes(gpu::kSurfelLight) >= surfelLightBytes(); }
  // The texture of an image that a frame hands over, likewise.
  void makeDrivenImage(std::uint32_t image);
  // Bytes of textures, by what they are for; of the grid's alone.
  std::size_t textureBytes(GpuUse use) const;
  std::size_t gridTextureBytes() const;
  std::size_t bufferBytes(std::uint32_t index) const { return static_cast<std::size_t>(buffers_[index].bytes); }

  // Bind what shaders of the host's or a set of the plan's read and write.
  void bind(std::span<const GpuBinding> bindings) const;
  // A frame's uploads, then its dispatches, by their number among the plan's last.
  void upload(std::span<const GpuUpload> uploads);
  void run(std::size_t number, const GpuDispatch& dispatch) const;
  // Take all light off the caches and the light map. Throws std::bad_alloc, with all light still there.
  void clearLight(const Bake& bake);

 private:
  struct PlanProgram {
    Program name;
    std::pmr::vector<GLint> location;  // [Size parameters]
  };

  std::size_t surfelLightBytes() const { return plan_.surfelSlots() * sizeof(glm::vec4); }
  Texture makeTexture(const GpuImage& image) const;
  void fillTexture(const GpuImage& image, const Texture& texture, const void* texels) const;
  void uploadImage(const GpuUpload& upload) const;
  void setParameters(std::uint32_t program, const GpuDispatch& dispatch) const;

  const Functions& gl_;
  const gpu::FramePlan& plan_;
  std::pmr::memory_resource* memory_;
  std::pmr::vector<Buffer> buffers_;
  std::pmr::vector<Texture> textures_;  // those of images that frames hand over when the first one comes
  std::pmr::vector<PlanProgram> programs_;
  HostWrites writes_;
  std::array<Sampler, kGpuSamplers> samplers_;  // between mip levels, where images may be handed over
};

}  // namespace relume::gl
