// SPDX-License-Identifier: MIT
// Steps 2 to 5 of a frame (relighter.h) as data, for a renderer of the host's own: Vulkan, or what else runs compute
// shaders. GpuPasses says which buffers and images there are, which programs read and write them, and for each frame
// what to copy and what to dispatch, in order. It calls no graphics API, and links none. The OpenGL backend of the
// relighter runs the same data; vulkan_executor.h runs it in Vulkan.
//
//   once         make buffers() and images() with their contents, a pipeline for each of programs() and a descriptor
//                set for each of bindingSets(); then forgetContents()
//   every frame  frame(setup): copy its uploads; run its dispatches, with a barrier before each that waits; and one
//   more
//                before anything reads the results
//   to resolve   put resolveGlsl() into a shader of the host's and bind resolveBindings() to it
//
// Bindings are numbered for one descriptor set, 0 in the programs: no two of a set share a number, of whatever kind
// they are. Images are read and written in one and the same layout (VK_IMAGE_LAYOUT_GENERAL), or moved from layout to
// layout by the host, which sees in GpuBinding::isWritten when. Work groups are one-dimensional.
//
// What is in `light` resources stays from frame to frame: each frame adds one bounce of the light before. Frames are
// therefore run in order, none left out; a frame that cannot be run is followed by reset(). Several levels are several
// GpuPasses, which share nothing.
//
// Threads: each GpuPasses belongs to one thread at a time; const functions may be called from several. Memory: as
// relighter.h has it; frame() takes none once a frame has had as many lights, surfels' arrays and moving shapes. Units:
// lights.h's.
//
// Moving parts (moving_shapes.h) are asked for by RelightOptions::movingParts, and what they need is made once, as
// everything is: no buffer grows. "moving parts" has room for as many as that, "moving shapes" for
// GpuDevice::movingShapeBytes; "light of moving parts" has 32 bytes a cache and 17 KiB a part, which programs alone
// write; "places on senders" is constant. A frame with parts uploads the parts, and the shapes where it names others
// than the frame with parts before it, or after reset(). Before the dispatches of its caches it has those of
// GpuPass::movingParts: the light of the parts, then what they hide of links. Frames without parts are those of passes
// that have none, to the bit. Lights of the setup shine on parts without shadows: the function relumeVisibility() of
// RelightOptions::visibilityGlsl is OpenGL's alone, and what a shader with gpuSurfelGlsl() finds is of surfels. With
// surfelIrradianceOnGpu or surfelIrradiance, surfels leave LightSetup::lights alone, so that the list is of parts: hand
// over the lamps that reach one.
#pragma once

#include "relume/bake_data.h"
#include "relume/lights.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "relume/texture_resolve.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace relume {

// What a device can do, and what it is used for. The defaults are what every Vulkan 1.1 device has.
struct GpuDevice {
  std::size_t storageBytes = std::size_t{1} << 27;  // [byte] of the largest binding: maxStorageBufferRange
  std::size_t storageAlignment = 256;               // [byte] [power of 2] of an offset: minStorageBufferOffsetAlignment
  std::uint32_t imageSide = 4096;     // [texel] of the largest image: maxImageDimension2D (Vulkan 1.0 demands 4096)
  std::uint32_t volumeSide = 256;     // [texel] of the largest volume: maxImageDimension3D
  std::uint32_t sharedBytes = 16384;  // [byte] of a work group: maxComputeSharedMemorySize
  std::uint32_t groups = 65535;       // [1..] of a dispatch: maxComputeWorkGroupCount[0]
  // Threads of a group run one after the other, as in software drivers (VK_PHYSICAL_DEVICE_TYPE_CPU). It decides time
  // alone.
  bool isSerial = false;
  std::uint32_t maxLights = 64;  // of a frame
  bool hasSurfelArrays = false;  // frames may have surfelIrradiance or surfelEmission, 32 bytes a surfel
  bool hasSurfelShader = false;  // frames may have surfelIrradianceOnGpu, 16 bytes a surfel
  // [byte] MovingShapes::bytes() of a frame's movingShapes, at most: some 16 KiB a shape. Counts with
  // RelightOptions::movingParts alone.
  std::size_t movingShapeBytes = std::size_t{1} << 18;
};

enum class GpuUse : std::uint8_t {
  constant,  // holds its contents for ever
  frame,     // the host copies into it what a frame says
  light,     // programs write it
};

struct GpuBuffer {
  const char* name = "";  // for messages and captures; lives as long as the program
  GpuUse use = GpuUse::constant;
  bool isUniform = false;                    // a uniform buffer; else a storage buffer
  std::size_t bytes = 0;                     // [multiple of 4, >= 16]
  std::span<const std::byte> contents = {};  // [Size 0..bytes] at the beginning, followed by zeros
};

enum class GpuFormat : std::uint8_t { rgba16f, rg16f, rgba32f, rgba8snorm, r8ui };

// Bytes of a texel.
constexpr std::size_t texelBytes(GpuFormat format) {
  return format == GpuFormat::rgba32f ? 16 : format == GpuFormat::rgba16f ? 8 : format == GpuFormat::r8ui ? 1 : 4;
}

struct GpuImage {
  const char* name = "";
  GpuUse use = GpuUse::constant;
  TextureShape shape = TextureShape::flat;
  GpuFormat format = GpuFormat::rgba16f;
  glm::uvec3 size{1};                        // [texel] z: layers of an array, depth of a volume
  std::uint32_t levels = 1;                  // mip levels
  std::span<const std::byte> contents = {};  // of level 0, rows without padding; empty = zeros
};

// Layers of an array of images, [1..].
constexpr std::uint32_t layersOf(const GpuImage& image) {
  return image.shape == TextureShape::array ? image.size.z : 1;
}

// [texel] Of a mip level; z is the depth of a volume and 1 otherwise.
inline glm::uvec3 levelSize(const GpuImage& image, std::uint32_t level) {
  const auto half = [level](std::uint32_t side) { return side >> level > 0 ? side >> level : 1; };
  return {half(image.size.x), half(image.size.y), image.shape == TextureShape::volume ? half(image.size.z) : 1};
}

enum class GpuBindingKind : std::uint8_t { storageBuffer, uniformBuffer, sampledImage, storageImage };

// How a sampled image is read: clamped to its edges, or between mip levels and beyond the edges as named.
enum class GpuSampler : std::uint8_t { linear, nearest, mipRepeat, mipClampU, mipClampV, mipClamp };
inline constexpr std::size_t kGpuSamplers = 6;
constexpr bool readsMips(GpuSampler sampler) { return sampler >= GpuSampler::mipRepeat; }
constexpr bool clampsU(GpuSampler sampler) {
  return sampler != GpuSampler::mipRepeat && sampler != GpuSampler::mipClampV;
}
constexpr bool clampsV(GpuSampler sampler) {
  return sampler != GpuSampler::mipRepeat && sampler != GpuSampler::mipClampU;
}

struct GpuBinding {
  std::uint32_t binding = 0;
  GpuBindingKind kind = GpuBindingKind::storageBuffer;
  bool isWritten = false;
  GpuSampler sampler = GpuSampler::linear;  // of a sampled image, which is a combined one
  std::uint32_t resource = 0;               // index into buffers() or images()
  std::size_t offset = 0, bytes = 0;        // [byte] of a buffer; bytes 0 = all of it
};

// A specialisation constant, of 32 bits.
struct GpuConstant {
  std::uint32_t id = 0, value = 0;
};

// Push constants of a program, at most. Every Vulkan device has 128.
inline constexpr std::size_t kGpuParameterBytes = 112;

// Storage buffers of a program, at most: maxPerStageDescriptorStorageBuffers.
inline constexpr std::uint32_t kGpuStorageBuffers = 8;

// A compute shader; its entry point is main.
struct GpuProgram {
  std::string name;                           // its file and definitions
  std::span<const std::uint32_t> spirv = {};  // for Vulkan 1.1; empty where this build has none for these bands
  std::vector<GpuConstant> constants = {};
  std::size_t parameterBytes = 0;  // [0..kGpuParameterBytes] its push constants
};

// What a program is run with. Sets of one program have the same bindings and kinds; samplers may differ.
struct GpuBindingSet {
  std::uint32_t program = 0;
  std::span<const GpuBinding> bindings = {};
};

enum class GpuPass : std::uint8_t { emission, surfels, pull, movingParts, caches, gridTexture };

struct GpuDispatch {
  GpuPass pass = GpuPass::surfels;  // for captures and timers
  bool waits = false;               // reads what dispatches before it have written, or writes what they read
  std::uint32_t bindingSet = 0, groups = 0;
  std::array<std::byte, kGpuParameterBytes> parameters = {};  // push constants: GpuProgram::parameterBytes of them
};

// Bytes to copy before the frame's first dispatch: to the beginning of a buffer, or to all of an image's level. Those
// of rgba32f images have three floats a texel; the fourth is never read.
struct GpuUpload {
  bool isImage = false;
  std::uint32_t resource = 0, level = 0;
  std::span<const std::byte> bytes = {};
};

// Valid until the next call of frame(), and while the images of its setup are.
struct GpuFrame {
  std::span<const GpuUpload> uploads = {};
  std::span<const GpuDispatch> dispatches = {};
};

class GpuPasses {
 public:
  // Of the options bands, glossy, drivenImages, movingParts, movingLag, gridTexture and what belongs to it, parallelFor
  // and memory count.
  // usage: as Relighter::create(), visibilityGlsl, a device number of 0; invalidFile: likewise; unsupported: more than
  // the device binds or holds; memory: it ran out.
  static Result<GpuPasses> create(const Bake& bake, const RelightOptions& options, const GpuDevice& device);
  GpuPasses(GpuPasses&&) noexcept;
  GpuPasses& operator=(GpuPasses&&) noexcept;
  ~GpuPasses();

  // Whether a device can run them, which create() may have been told less or more of. unsupported: it binds less memory
  // or at coarser offsets, or has smaller images, fewer groups or less memory for one; usage: a number of it that
  // create() refuses.
  [[nodiscard]] Status checkDevice(const GpuDevice& device) const;

  // What to make once. Contents are valid until forgetContents().
  [[nodiscard]] std::span<const GpuBuffer> buffers() const;
  [[nodiscard]] std::span<const GpuImage> images() const;
  [[nodiscard]] std::span<const GpuProgram> programs() const;
  [[nodiscard]] std::span<const GpuBindingSet> bindingSets() const;
  // GLSL 4.50 that program i was compiled from, #version included, for hosts that compile by themselves. failed: an
  // index out of range.
  [[nodiscard]] Result<std::string> programGlsl(std::size_t i) const;
  // Give back the memory that contents are in.
  void forgetContents();

  // One frame. `setup` is refused as Relighter::relight() refuses it, and in addition if it has more lights, larger
  // movingShapes, other arrays or textures than GpuDevice says; the frames go on as if the call had not been made.
  // setup.movingShapes is read by this call alone.
  [[nodiscard]] Result<GpuFrame> frame(const LightSetup& setup);
  // Read nothing of the light before in the next frame.
  void reset();

  // Step 6 for a shader of the host's: GLSL to put after its #version 450, with the functions of GlResolve::glsl(), in
  // descriptor set RELUME_RESOLVE_SET, which is 0 unless the host defines it before; and what is bound there. Same as
  // gpuResolveGlsl() for the bands and the texture that came to be.
  [[nodiscard]] const std::string& resolveGlsl() const;
  [[nodiscard]] std::span<const GpuBinding> resolveBindings() const;

  // Direct light by a compute shader of the host's, for its shadows, with gpuSurfelGlsl(). Dispatch it for
  // surfelSlots() threads before a frame with LightSetup::surfelIrradianceOnGpu; that frame's first dispatch waits.
  // Empty without GpuDevice::hasSurfelShader.
  [[nodiscard]] std::span<const GpuBinding> surfelBindings() const;
  [[nodiscard]] std::uint32_t surfelSlots() const;

  [[nodiscard]] int lumaBands() const;
  [[nodiscard]] int chromaBands() const;

 private:
  struct State;
  struct Destroy {
    void operator()(State* state) const noexcept;
  };
  explicit GpuPasses(std::unique_ptr<State, Destroy> state);
  std::unique_ptr<State, Destroy> state_;
};

// GpuPasses::resolveGlsl() where there is no bake: for shaders that are compiled when the game is built. options: its
// bands, glossy and gridTexture; kind: of the bakes' links. usage: bands that are not given, or out of range.
[[nodiscard]] Result<std::string> gpuResolveGlsl(const RelightOptions& options, LinkKind kind);

// GLSL to put after #version 450 of a shader that lights the surfels itself: what GlResolve::surfelGlsl() defines, in
// descriptor set RELUME_SURFELS_SET, 0 unless it is defined before. The same for all bakes.
[[nodiscard]] Result<std::string> gpuSurfelGlsl();

}  // namespace relume
