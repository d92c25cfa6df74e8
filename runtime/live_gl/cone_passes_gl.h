// SPDX-License-Identifier: MIT
// The passes of a frame of cones in OpenGL, pixel by pixel: one cone or all over each pixel, edges, gathering, a blur,
// what earlier frames found, and what pixels mirror; and the images between them. ConesGl (cones_gl.h) checks what
// comes in. State must be saved around all of it.
#pragma once

#include "relume/result.h"
#include "runtime/gl/timer.h"
#include "runtime/live_gl/cone_levels_gl.h"
#include "runtime/live_gl/cones_gl.h"
#include "runtime/live_gl/live_objects.h"

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume::gl {

class ConePasses {
 public:
  // levels: of the voxels that cones go through; outlive this.
  ConePasses(const Functions& gl, const ConeLevels& levels, const PixelConeOptions& options, bool hemisphere,
             gpu::GroupThreads groups);

  // failed: a shader's log.
  Status compile();
  // What goes through several volumes, once.
  Status compileNested();
  // Images for so many pixels; those of before stay where there is no room: unsupported.
  Status resize(std::uint32_t width, std::uint32_t height);
  // A frame of the CPU's pixels, of this size. mirrored: empty = none is wanted. Throws std::bad_alloc.
  void trace(const PixelReceivers& pixels, const LiveSky& sky, std::span<const glm::vec4> mirrored);
  // Of a host's textures, which are what they have to be.
  void trace(const PixelTextures& textures, const LiveSky& sky);
  // The next frame keeps nothing of this one.
  void reset() { hasBefore_ = false; }

  GLuint lightTexture() const { return images_.light[0].texture.get(); }
  GLuint glossyTexture() const { return hasGlossy_ ? images_.glossy.texture.get() : 0; }
  // Read back, row by row.
  std::vector<glm::vec4> light() const;
  std::vector<glm::vec4> glossy() const;
  std::vector<float> frames() const;
  std::vector<std::uint8_t> edges() const;
  // "surfaces", "cones", "edges", "gather", "blur", "keep", "lobes".
  std::array<PassTime, 7> passTimes();
  std::size_t pixelBytes() const;
  std::size_t directionBytes() const { return directions_.bytes(); }

 private:
  // A pixel image that passes read and write.
  struct PixelImage {
    Texture texture;
    GLenum format = GL_RGBA32F;

    void bind(const Functions& gl, GLuint unit) const {
      gl.ActiveTexture(GL_TEXTURE0 + unit);
      gl.BindTexture(GL_TEXTURE_2D, texture.get());
    }
    void bindImage(const Functions& gl, GLuint unit) const {
      gl.BindImageTexture(unit, texture.get(), 0, GL_FALSE, 0, GL_WRITE_ONLY, format);
    }
  };

  // All of a picture's size. Of two, the first is of this frame and the second of the one before; of `light` the last
  // two are between passes.
  struct PixelImages {
    glm::ivec2 size{0};
    std::array<PixelImage, 2> places, planes, frames;
    std::array<PixelImage, 3> light;
    PixelImage normals, mirrored, glossy, edges;
  };

  // Those that follow cones, through one volume or, once there are several, through those.
  struct Tracing {
    Program hemisphere, lobe;
  };

  const Tracing& tracing() const { return levels_.volumes() > 1 ? nestedTracing_ : tracing_; }
  std::vector<std::pair<std::string, std::string>> defines() const;
  Status compile(Tracing& programs, bool isNested) const;
  void upload(const PixelReceivers& pixels, std::span<const glm::vec4> mirrored);
  std::uint32_t pixels() const { return static_cast<std::uint32_t>(images_.size.x * images_.size.y); }
  void run(const Program& program, std::uint32_t threads) const;
  void bindSurfaces(const Program& program) const;
  void writeSky(const LiveSky& sky);
  void bindSky(const Program& program, const LiveSky& sky) const;
  void lightPixels(const LiveSky& sky, GLuint normals, bool rowsUp);
  void frame(const LiveSky& sky, GLuint normals, GLuint mirrored, const glm::mat4& clipFromWorld, bool rowsUp);
  template <class T>
  std::vector<T> read(const PixelImage& picture, GLenum layout, GLenum type) const;

  const Functions& gl_;
  const ConeLevels& levels_;
  PixelConeOptions options_;
  bool hemisphere_;
  bool isSerial_;  // threads of a work group run one after the other
  Tracing tracing_, nestedTracing_;
  Program surfacesProgram_, edgesProgram_, gatherProgram_, blurProgram_, keepProgram_;
  GrowingBuffer directions_;
  HostTextures hostTextures_;
  PixelImages images_;
  bool hasBefore_ = false;  // a frame of this size, to keep light of
  bool hasGlossy_ = false;
  bool wasRowsUp_ = false;
  glm::mat4 oldClip_{1.0f};
  std::uint32_t frameNumber_ = 0;
  FrameTimer<7> timer_;
};

}  // namespace relume::gl
