// SPDX-License-Identifier: MIT
// Light that pixels find by cones through a lit voxel volume, in OpenGL 4.3: the passes of RadianceMips, PixelCones and
// ConeTracer (runtime/cones), each of which a test compares with its twin there.
//
//   fill()   a frame: the radiance of the voxels of one volume, or of several that lie in one another, from the CPU,
//   from passes of the caches (live_caches_gl.h) or of a bake
//            (bake_voxels_gl.h), or from reflective shadow maps (runtime/cones/rsm_voxels.h), and all levels
//   trace()  a frame: the hemisphere over each pixel of a picture, one cone a pixel or all, and what pixels mirror
//
// Objects are made by create(), by the first fill() of a volume of another size or with the CPU's maps of other sizes
// and the first trace() of a picture of another size, and by no other frame but where moving parts come to have more
// voxels than there is room for. Bindings that a call uses are put back (runtime/gl/saved_state.h). What is refused
// leaves the light of the last frame. The context that was current in create() is current in every other call, and when
// it dies.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/cones/pixel_cones.h"
#include "runtime/cones/rsm_voxels.h"
#include "runtime/live_gl/volume_range.h"
#include "runtime/passes/programs.h"

#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

namespace gl {
class LitSides;
}

struct ConesGlOptions {
  PixelConeOptions pixels;
  RadianceMips::Directions directions = RadianceMips::Directions::six;
  bool hemisphere = true;         // false: what pixels mirror alone
  GetProcAddress getProcAddress;  // of the context that is current
  // What the levels' texels are to suit: halves for hardware, floats for software; nothing = the driver.
  std::optional<gpu::GroupThreads> groups{};
};

// What a camera sees, in textures of the host's: GL_TEXTURE_2D of this size, row 0 at the bottom. Pixels whose numbers
// are out of range or not finite are not seen.
struct PixelTextures {
  std::uint32_t width = 0, height = 0;    // [1..16384]
  std::uint32_t places = 0;               // of floats: position [m]; depth along the viewing axis [m], 0 = nothing
  std::uint32_t planes = 0, normals = 0;  // of floats or signed: unit; of the surface's plane, and to shade with
  std::uint32_t mirrored = 0;             // of floats: unit mirrored direction; exponent of the lobe, negative =
                                          // mirrors nothing. 0 = no glossy light is wanted
  glm::mat4 clipFromWorld{1.0f};          // y upward
};

// The reflective shadow map of a light, in textures of the host's: GL_TEXTURE_2D of `side` times `faces` times `side`
// texels, face above face. Which way faces look does not matter here. Texels with numbers that are out of range or not
// finite reflect nothing.
struct RsmTextures {
  std::uint32_t side = kRsmVoxelsSide;  // [1..4096]
  std::uint32_t faces = 1;              // 1, or 6 of a light that shines all around
  std::uint32_t places = 0;             // of floats: position [m]; area of what the texel sees [m²], 0 = nothing
  std::uint32_t normals = 0;            // of floats or signed: unit, on the side that is lit
  std::uint32_t flux = 0;               // of floats [W]: reflected, albedo times the light that arrives
};

class ConesGl {
 public:
  // usage: as PixelCones::create(); getProcAddress is empty; unsupported: no OpenGL 4.3; failed: a shader's log.
  static Result<ConesGl> create(const ConesGlOptions& options);
  ConesGl(ConesGl&&) noexcept;
  ConesGl& operator=(ConesGl&&) noexcept;
  ~ConesGl();

  // Volumes from the outermost on, as their reflect() left them; or with the radiance that `lit`, sides of each, have.
  // [Size 1 to kMaxCascades; lit: 0 or as many] usage: of other volumes; unsupported: more voxels than OpenGL's buffers
  // and textures hold; memory; failed: a shader's log, with the first of several volumes.
  [[nodiscard]] Status fill(VolumeRange volumes, std::span<const gl::LitSides* const> lit = {});
  [[nodiscard]] Status fill(const VoxelVolume& volume, const gl::LitSides& lit);
  // The volume lit by maps of the lights that are on, and by its emission: as RsmVoxels::light(), to the bit.
  // largestFlux: of a texel's channel; what is above is cut there [W] [0..1e30]. emissionScale: factor [0..1e9]. usage:
  // either out of its range, a map that is none of this kind; unsupported and memory: as above.
  [[nodiscard]] Status fill(const VoxelVolume& volume, std::span<const RsmTextures> maps, float largestFlux,
                            const glm::vec3& emissionScale);
  // Of the CPU's maps, their brightest texel the largest flux. usage: checkRsm().
  [[nodiscard]] Status fill(const VoxelVolume& volume, std::span<const RsmImage> maps, const glm::vec3& emissionScale);

  // A frame. usage: fill() has not been called; a sky or pixels that are refused (checkLiveSky(), checkPixels()), a
  // texture that is none of this kind; unsupported: a picture larger than OpenGL's textures; memory. Pixels of another
  // number drop what was kept.
  [[nodiscard]] Status trace(const PixelTextures& pixels, const LiveSky& sky);
  // Of the CPU's pixels, row 0 on top. mirrored: as PixelTextures has it. [Size 0 or width * height]
  [[nodiscard]] Status trace(const PixelReceivers& pixels, const LiveSky& sky,
                             std::span<const glm::vec4> mirrored = {});
  // Nothing is kept of the frames before.
  void reset();

  // Textures of RGBA32F, of the last frame, until the next: as PixelCones::light(), and radiance that pixels mirror
  // [W/m²/sr], as ConeTracer::glossy(). Rows are as the pixels' were; 0 before there are any.
  std::uint32_t lightTexture() const;
  std::uint32_t glossyTexture() const;
  // Read back, as PixelCones has them. Waits for the GPU. [Size width * height]
  std::vector<glm::vec4> light() const;
  std::vector<glm::vec3> glossy() const;
  std::vector<float> frames() const;
  std::vector<std::uint8_t> edges() const;
  // Of a volume's sides as cones read them, read back; black where none does. [W/m²/sr] [Size
  // VoxelVolume::sideCount()]
  std::vector<glm::vec3> sideRadiance(std::size_t volume = 0) const;
  // Levels above its voxels, and as RadianceMips::texels(), read back. [1..levels(volume)]
  std::uint32_t levels(std::size_t volume = 0) const;
  std::vector<glm::vec4> texels(std::uint32_t level, std::size_t volume = 0) const;

  // Of the last frame that the GPU has finished; "voxels" on the CPU.
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  struct State;
  explicit ConesGl(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relume
