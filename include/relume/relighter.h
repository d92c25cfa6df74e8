// SPDX-License-Identifier: MIT
// The runtime: loads a bake, and every frame turns this frame's lights into indirect light. The same steps run on the
// CPU or in OpenGL 4.3+ compute shaders, on the same data; each is the other's test.
//
//   (1) shadow maps          the host's own
//   (2) light the surfels    direct light + last frame's caches + emission -> leaf radiosity
//   (3) pull                 radiosity averaged up the hierarchy
//   (4) light the caches     L_SH = sum over links of radiosity x transfer, into Y, Co, Cg coefficients, and
//   (5) copy                 at once to the texels that hold them, dilation included
//   (5a) fill                where RelightOptions::gridTexture asks for it: the grid as a texture that filters
//   (6) resolve              per pixel, in the host's shader (GlResolve::glsl()) or by irradianceOnLightmap() and
//                            irradianceInGrid() here
//
// Threads. Several Relighters may share one Bake, of whose arrays they keep alive what they have not packed, and run at
// the same time. Of one Relighter, create(), relight(), reset(), moves and destruction each need it alone. Between
// them, with the CPU backend, any number of threads may call its const functions at the same time: look-ups only read.
// With the GL backend every call, const ones included, belongs to the thread on which the context of create() is
// current: the first look-up after a relight() reads the caches back.
//
// Memory that runs out is ErrorCode::memory where a Status or a Result comes back, with the size that was asked for,
// and std::bad_alloc where not; nothing is leaked, and last frame's light stays.
//
// OpenGL state: create() and relight() put back what they bind (program, buffer bindings, texture units, image units,
// active unit); readers bind GL_COPY_READ_BUFFER and put it back. What was deleted while it was bound (a program in
// use, an object that another context deletes) cannot be bound again: nothing is, then. Errors that are pending may be
// forgotten: glGetError() is the host's to call before.
//
// Range. The GL backend keeps the light of caches in halves, of whatever unit the lights are given in. Keep irradiance
// under 60000: caches beyond that, in any direction, are dimmed as a whole to what halves hold. Light below about 1e-3
// loses digits, below 1e-7 it is gone. The CPU backend keeps caches in the range of floats. What surfaces send on,
// their radiosity, goes from 2^-40 to 2^32 [W/m²] with either backend, and loses digits below 2^-32, about 2e-10.
#pragma once

#include "relume/bake_data.h"
#include "relume/lights.h"
#include "relume/result.h"
#include "relume/texture_resolve.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <memory_resource>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

enum class BackendKind { cpu, gl };

// Runs body(0) .. body(tasks - 1), in any order, returning when all are done. The host's job system; the default is a
// plain loop on the calling thread. No body throws: what a callback of the host's throws in one, or memory that runs
// out, is thrown on, or said by an Error, on the thread that called the library.
using ParallelFor = std::function<void(std::uint32_t tasks, const std::function<void(std::uint32_t)>& body)>;

// Address of the OpenGL function `name` ("glUseProgram") for the context that is current, null where there is none:
// glfwGetProcAddress, eglGetProcAddress and SDL 3's SDL_GL_GetProcAddress as they are; SDL 2's with its void* cast.
using GlProc = void (*)();
using GetProcAddress = std::function<GlProc(const char* name)>;

// Instruction sets of the CPU backend's inner loops. `best` asks the processor.
enum class Simd { best, baseline, avx2, avx512 };

// Images of one size that a frame may put on a drivable material (MaterialEmission): memory for them is taken once.
struct DrivenImage {
  std::string material;                 // name, as in Emitters::materials; all of that name
  std::uint32_t width = 0, height = 0;  // [texel] [1..8192]
};

struct RelightOptions {
  BackendKind backend = BackendKind::cpu;
  int lumaBands = 0;    // [0, 1..8] 0 = what the bake recommends; at most the bands of SH links
  int chromaBands = 0;  // [0, 1..lumaBands] 0 = what the bake recommends
  // Keep on the light map the bands that glossy look-ups alone read: the last of 4, 6 or 8. Without, they do without.
  bool glossy = false;
  ParallelFor parallelFor{};  // CPU backend; empty = one thread
  Simd simd = Simd::best;     // CPU backend; one that the processor lacks is refused
  // CPU backend: whether setups may hand over surfelIrradiance and surfelEmission. Without, 4 bytes a surfel are saved.
  bool surfelArrays = true;
  // Materials that images are to drive, each at most once. The CPU backend keeps a third of an image's texels as mip
  // levels, 12 bytes each; OpenGL 16 bytes for each texel and mip level beside them.
  std::vector<DrivenImage> drivenImages{};
  // [0..kMaxMovingParts] how many LightSetup::movingParts a frame has at most; 0 = none. What they need is kept beside
  // the links, 32 bytes a surfel, about twice what the surfels themselves take, some 70 a cache and 5 KiB a part;
  // OpenGL and GpuPasses keep 88 a cache and 17 KiB a part. WebAssembly: in modules of their own (docs/guide/web.md).
  std::uint32_t movingParts = 0;
  // [1, 2, 4 .. 64] frames within which each cache near parts is looked at again, wherever they are by then; 1 = all in
  // every frame. A frame looks at a 32nd of all caches, those of which parts cover more the more often. Until then what
  // they change goes with the light that they hide. The first frame with parts, after create(), reset() or a frame
  // without, looks at all near caches, which takes several times as long.
  std::uint32_t movingLag = 32;
  // Keep the grid as a texture of irradiance vectors, filled every frame, for reads by GridLookup::texture and smooth:
  // cheaper than reading the caches around, for what moves in numbers. Relighter::gridTexture() says what came of it.
  bool gridTexture = false;
  // [0..1] Cells of the texture are read where the weights of its caches differ from those of the caches around by less
  // than this share in the mean; in others the caches around are. 0 = no cell, 1 = all.
  float gridTrust = 0.35f;
  // [byte] of the texture in OpenGL, 72 a point; the CPU backend takes 192 a point, and both what its shares take
  // (bufferSizes()). Its points are four, three, two times or just as dense as the grid's lattice, the
  // first that needs no more; where none does there is no texture.
  std::uint32_t gridTextureBytes = 4u << 20;
  // GL backend: GLSL that defines `float relumeVisibility(uint light, vec3 positionWorld, vec3 normal)` with whatever
  // uniforms, samplers and blocks it needs (the host sets them through GlResolve::surfelProgram(), with moving parts
  // through movingProgram() as well). Numbers outside [0..1] are clamped, NaN is 0. Empty = nothing is in shadow.
  //
  // While it runs, Relume has buffers of its own bound to storage blocks 0 to 7 and uniform block 7, and uses texture
  // units 12 to 15 and image units 0 to 2; all others are as the host has bound them. create() refuses a block that the
  // text gives one of those bindings (0 is a storage block's that has none). The surfels' pass has eight storage blocks
  // itself, which is all that OpenGL promises: more of them are for drivers that have more; uniform blocks, textures
  // and texture buffers are for all.
  //
  // Names that begin with relume, Relume, kRelume, RELUME or gl_ are reserved. The text is compiled within Relume's,
  // where its macros hold to the end: names of its own for those as well. Logs of errors count its lines as string 1.
  std::string visibilityGlsl{};
  // GL backend, which needs it: where it gets OpenGL's functions from. Called within create() alone; each relighter
  // keeps the addresses that it was given, and the library links no OpenGL.
  GetProcAddress getProcAddress{};
  // Where the relighter's memory comes from; null = the global operators new and delete. All of it that create() and
  // later calls take goes through here, in blocks aligned to at least 16 bytes; exempt are texts (std::string: errors,
  // GLSL), copies of `parallelFor`, what functions return as a std::vector, and the OpenGL driver's own. It must
  // outlive the relighter. It is called on the threads that call the relighter's functions: create(), relight() when a
  // frame has more lights or other arrays than any before, inherit(), with OpenGL all that read back, and destruction.
  // Relighters that run at the same time may share one only if it is safe to call from several threads.
  std::pmr::memory_resource* memory = nullptr;
};

// How look-ups read the grid.
enum class GridLookup {
  stencil,  // the caches around the receiver, each by how much of it is seen
  texture,  // the texture, trilinear, in its open cells; else the caches around
  smooth,   // the same by a cubic B-spline where all cells around are open: no creases, and a little blur
};

// The grid's texture, as RelightOptions::gridTexture has made it.
struct GridTextureInfo {
  glm::uvec3 resolution{0};     // points along each axis; 0 = there is none
  glm::vec3 originWorld{0.0f};  // [m]
  glm::vec3 spacing{0.0f};      // [m]
  std::size_t cells = 0, openCells = 0;
};

struct PassTime {
  // "surfels", "pull", "caches", with RelightOptions::gridTexture "grid texture", and with RelightOptions::movingParts
  // "moving parts": their own light; what they change of the caches is part of "caches" on the CPU, and of
  // "moving parts" in OpenGL
  const char* pass;
  double ms;  // CPU: wall clock; GL: GPU time between timestamps of the last finished frame
};

// What the host's shader binds to resolve (shaders/resolve.glsl names the slots). 0 where there is none.
struct GlResolveInputs {
  // GL_TEXTURE_2D_ARRAY, RGBA16F, four coefficients a layer: of l bands, but for the last of 4, 6 or 8, which no
  // irradiance has anything of (formats/sh.h, clampedCosineFactors()), without RelightOptions::glossy
  std::uint32_t lightmapY = 0, lightmapCo = 0, lightmapCg = 0;
  std::uint32_t lightmapNormal = 0;  // GL_TEXTURE_2D RGBA8_SNORM: normal of the texel's cache, w = 1 where there is one
  std::uint32_t caches = 0;          // SSBO of the grid's caches: packed halves, Y then Co then Cg coefficients
  std::uint32_t gridIndex = 0;       // SSBO: cache of each grid point
  std::uint32_t uniforms = 0;        // UBO: grid placement, bands, sizes
  // With RelightOptions::gridTexture. GL_TEXTURE_3D: six slabs along z, one for each half of the sphere, with an empty
  // texel between two. RGBA16F: luma vector and weight; RG16F: Co, Cg; R8UI: which cells may be read.
  std::uint32_t gridVectors = 0, gridChroma = 0, gridOpen = 0;
  // SSBO: radiosity [W/m²] of each node of the bake's hierarchy, a word each: relumeUnpackColor() of
  // shaders/lib/pack.glsl
  std::uint32_t nodes = 0;
};

// Step 6 in the host's own shaders, and the surfel pass for its shadows. The relighter's context must be current.
class GlResolve {
 public:
  virtual ~GlResolve() = default;
  virtual GlResolveInputs inputs() const = 0;
  // GLSL 4.30 to put into the host's shader after #version: defines vec3 relumeIrradianceLightmap(vec2 uv, vec3 n), the
  // same with a third argument, the geometric normal, vec3 relumeIrradianceGrid(vec3 positionWorld, vec3 n), the same
  // by the grid's texture, relumeIrradianceGridTexture() and relumeIrradianceGridSmooth(), and glossy light: vec3
  // relumeGlossyLightmap(vec2 uv, vec3 r, float exponent), vec3 relumeGlossyGrid(vec3 positionWorld, vec3 n, vec3 r,
  // float exponent), float relumeGlossyExponent(float roughness), float relumeGlossyShare(float roughness). Slots are
  // those of shaders/shared/layout.h (kResolve...) unless the host defines RELUME_RESOLVE_... macros before it.
  virtual const std::string& glsl() const = 0;
  // Bind all inputs to the default slots of shaders/shared/layout.h, their units without samplers of the host's. Leaves
  // them bound, and the active unit as it was.
  virtual void bind() const = 0;
  // GL program of step 2, for the host's shadow uniforms.
  virtual std::uint32_t surfelProgram() const = 0;
  // GL program that lights moving parts, with the same visibilityGlsl: a host that sets uniforms in one sets them in
  // both. 0 = RelightOptions::movingParts is 0.
  virtual std::uint32_t movingProgram() const = 0;

  // Direct light by a compute shader of the host's own (ray traced, of area lights, of a texture), for frames with
  // LightSetup::surfelIrradianceOnGpu. GLSL 4.30 to put into that shader after #version: defines relumeSurfelSlots,
  // vec3 relumeSurfelPosition(uint i), vec3 relumeSurfelNormal(uint i), float relumeSurfelRadius(uint i) and
  // void relumeSetSurfelIrradiance(uint i, vec3 irradiance), for each i < relumeSurfelSlots. Slots are those of
  // shaders/shared/layout.h (RELUME_SURFELS_SLOT_...) unless the host defines them before it. No barrier is needed
  // between its dispatch and relight().
  virtual const std::string& surfelGlsl() const = 0;
  // Invocations to dispatch, at least.
  virtual std::uint32_t surfelSlots() const = 0;
  // Bind the surfels and the buffer for their irradiance to the default slots. Leaves them bound, and all else as it
  // was but for the buffer that is bound to GL_SHADER_STORAGE_BUFFER itself. The first call makes the one for
  // irradiance, which holds zeros.
  virtual void bindSurfels() const = 0;
};

// Points of a volume: x fastest, point (x, y, z) at originWorld + (x, y, z) * spacing.
struct AmbientVolume {
  glm::vec3 originWorld{0.0f};  // [m]
  glm::vec3 spacing{1.0f};      // [m]
  glm::uvec3 resolution{0};     // [points along each axis]
};

class Relighter {
 public:
  // usage: bands or gridTrust out of range, a Simd the processor lacks, the GL backend without getProcAddress, a block
  // of visibilityGlsl at a binding of Relume's (the message names both), a driven image of no size or of a material
  // that the bake does not know as drivable, or that has no texture coordinates;
  // unsupported: no OpenGL 4.3, a function of it that getProcAddress does not know, buffers larger than the driver
  // allows; invalidFile: the bake breaks an invariant the runtime needs; failed: a shader did not compile (its log in
  // the message); memory: it ran out.
  static Result<Relighter> create(const Bake& bake, const RelightOptions& options);
  Relighter(Relighter&&) noexcept;
  Relighter& operator=(Relighter&&) noexcept;
  ~Relighter();

  // One frame: steps 2 to 5. Each call adds one bounce of last frame's light. A setup that check() refuses is not
  // applied, and its error comes back: last frame's light stays, so a host that does not look sees light that has
  // frozen. Directions of lights may be off unit length by 1 % (kDirectionTolerance); they are normalised.
  [[nodiscard]] Status relight(const LightSetup& setup);
  // What relight() would refuse. usage: a span of the wrong size, a direction that is not of unit length, a number that
  // is not finite, negative, or outside the range include/relume/lights.h gives; the message names light and field.
  // A driven material that the bake does not have, an image that was not declared, a texture that does not exist or is
  // of another size or kind; unsupported: the bake knows no drivable material at all, or a frame of more lights or
  // colours than OpenGL binds at once. Every texel of an image is looked at. Drivers may end loops early: Mesa's
  // llvmpipe lights by the first 65,536 lights alone.
  [[nodiscard]] Status check(const LightSetup& setup) const;
  // Forget last frame's light. GL: throws std::bad_alloc, and forgets nothing, where there is no memory to clear with.
  void reset();
  // Hot reload: begin with the light that `previous`, a relighter of an older bake of the level, has in its grid, so
  // that the first frame is not without its bounces. `bake` is the one that this relighter was made from. Takes effect
  // in the next relight(), and holds 12 bytes per surfel until then. Irradiance at each surfel is read from the grid of
  // `previous`, so that light of the first frame is as coarse as that; what follows converges as ever.
  // usage: another bake, or no RelightOptions::surfelArrays; unsupported: `previous` has no grid; memory: it ran out.
  // What an earlier inherit() has handed over stays after a failure.
  [[nodiscard]] Status inherit(const Relighter& previous, const Bake& bake);

  // Irradiance [W/m²] by all light that arrives over links, for a receiver with unit normal. GL: reads back once after
  // each relight(). lightmapUv [0..1]² from Lightmap::cornerUv (front or back set). Finite and
  // never negative; zero where a coordinate is not finite, or a normal is not finite or longer than 2.
  // `normal` shades; `geometricNormal`, that of the receiver's own plane, says how much of its light the map's caches
  // have not seen where it leaves theirs: hand it over where normals are interpolated or mapped.
  // In the grid a position may be anywhere, however far away. One outside of the grid's box reads the points around the
  // place in the box that is nearest to it; how much of each is seen, and which way it lies, counts from the position
  // itself. Without a grid all is zero.
  [[nodiscard]] glm::vec3 irradianceOnLightmap(const glm::vec2& lightmapUv, const glm::vec3& normal,
                                               const glm::vec3& geometricNormal) const;
  [[nodiscard]] glm::vec3 irradianceOnLightmap(const glm::vec2& lightmapUv, const glm::vec3& normal) const;
  [[nodiscard]] glm::vec3 irradianceInGrid(const glm::vec3& positionWorld, const glm::vec3& normal,
                                           GridLookup lookup = GridLookup::stencil) const;

  // The same for many receivers at once, on the threads of RelightOptions::parallelFor. Spans of one length; else
  // usage, and nothing is written.
  [[nodiscard]] Status irradianceOnLightmap(std::span<const glm::vec2> lightmapUv, std::span<const glm::vec3> normal,
                                            std::span<const glm::vec3> geometricNormal,
                                            std::span<glm::vec3> irradiance) const;
  [[nodiscard]] Status irradianceInGrid(std::span<const glm::vec3> positionWorld, std::span<const glm::vec3> normal,
                                        std::span<glm::vec3> irradiance, GridLookup lookup = GridLookup::stencil) const;

  // Glossy light, of the same caches: mean radiance [W/m²/sr] in a lobe cos^exponent about the unit direction
  // `reflected`, the viewing ray's mirrored by the shading normal, away from the surface. Multiply by the surface's
  // specular reflectance; glossyExponent() and glossyShare() (glossy.h) take a roughness. As sharp as the bands are:
  // ask for four or more, and for RelightOptions::glossy. Punctual lights' own highlights are not in it, light straight
  // from emitters and sky is. Exponents are clamped to 0..kMaxExponent, NaN is 0; finite, never negative and zero as
  // above. Caches of irradiance links know no direction: on the light map they give irradiance / pi.
  [[nodiscard]] glm::vec3 glossyOnLightmap(const glm::vec2& lightmapUv, const glm::vec3& reflected,
                                           float exponent) const;
  [[nodiscard]] glm::vec3 glossyInGrid(const glm::vec3& positionWorld, const glm::vec3& normal,
                                       const glm::vec3& reflected, float exponent) const;
  // For many receivers at once, as above.
  [[nodiscard]] Status glossyOnLightmap(std::span<const glm::vec2> lightmapUv, std::span<const glm::vec3> reflected,
                                        std::span<const float> exponent, std::span<glm::vec3> radiance) const;
  [[nodiscard]] Status glossyInGrid(std::span<const glm::vec3> positionWorld, std::span<const glm::vec3> normal,
                                    std::span<const glm::vec3> reflected, std::span<const float> exponent,
                                    std::span<glm::vec3> radiance) const;

  // Plain results: the frame's light for shaders and engines that know nothing of caches. usage: a span of the wrong
  // size. On the threads of RelightOptions::parallelFor; GL: reads back, and computes on the processor.
  //
  // [texel] of the light map; zero for a bake without one.
  [[nodiscard]] glm::uvec2 lightmapSize() const;
  // Irradiance [W/m²] for each texel's own normal: halves r, g, b, a, rows as the light map's; a is 1 where there is
  // light and 0 where no receiver reads. Sampled bilinearly at Lightmap::cornerUv, it is irradianceOnLightmap() for
  // receivers with their texels' normals, but beside walls, which a filter reads across: Relume's own reads move there
  // (Lightmap::sight). [Size 4 * width * height]
  [[nodiscard]] Status irradianceMap(std::span<std::uint16_t> rgba16f) const;
  // The same for normals that differ from the texel's (normal maps): four layers of such texels,
  //   E(n) = max(layer_0 + n_x layer_1 + n_y layer_2 + n_z layer_3, 0)
  // a fit over the normals within 60 degrees of the texel's, exact for the texel's own. [Size 16 * width * height]
  [[nodiscard]] Status irradianceMapL1(std::span<std::uint16_t> rgba16f) const;
  // Ambient cubes of a volume from the grid: irradiance [W/m²] for the normals +x, -x, +y, -y, +z, -z of each point.
  // [Size 6 * points]
  [[nodiscard]] Status ambientVolume(const AmbientVolume& volume, std::span<glm::vec3> cubes) const;

  // Step 6 in the host's shaders, by textures and plain uniforms alone (texture_resolve.h). The host makes the textures
  // once, writes those that are light after each relight(), and puts the GLSL behind its #version: valid in GLSL 3.30
  // and ES 3.00 and all later, it defines the functions of GlResolve::glsl() but for what needs OpenGL 4.3, and, for
  // OpenGL ES, highp as the default precision of float and int from there on.
  // unsupported: a grid of more than 2^24 words.
  [[nodiscard]] Result<TextureResolve> textureResolve() const;
  [[nodiscard]] Result<std::string> textureResolveGlsl() const;
  // Texels of one of its textures, [0..textures). usage: an index out of range, a span of another size than
  // ResolveTexture::bytes; nothing is written then. On the threads of RelightOptions::parallelFor; GL: reads back.
  [[nodiscard]] Status writeResolveTexture(std::size_t texture, std::span<std::byte> texels) const;

  // Coefficients [W/m²/sr] of the unique caches after relight(): lumaBands² of Y, then chromaBands² of Co, then of Cg,
  // a cache at a time. Caches on the light map have no more than CacheBands::onMap() of them (runtime/shared/bands.h),
  // the rest is zero. [Size n_C * coefficientsPerCache()]. GL: reads back.
  [[nodiscard]] std::vector<float> cacheCoefficients() const;
  // The same into memory of the caller's. usage: a span of another size.
  [[nodiscard]] Status cacheCoefficients(std::span<float> coefficients) const;
  // Radiosity [W/m²] of all nodes after relight(). [Size nodes] GL: reads back.
  [[nodiscard]] std::vector<glm::vec3> nodeRadiosity() const;

  // What the bake was made from: Provenance::sceneHash. A game that knows the hash of its level tells by it whether the
  // bake is of that level.
  [[nodiscard]] std::uint64_t sceneHash() const;

  [[nodiscard]] int lumaBands() const;
  [[nodiscard]] int chromaBands() const;
  [[nodiscard]] int coefficientsPerCache() const;
  [[nodiscard]] BackendKind backend() const;
  [[nodiscard]] std::vector<PassTime> passTimes() const;
  // Name and bytes of each buffer the runtime holds or reads every frame.
  [[nodiscard]] std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;
  // What GridLookup::texture reads. Where it has no points all look-ups read the caches around.
  [[nodiscard]] GridTextureInfo gridTexture() const;

  // What only the GL backend has; null on the CPU. Lives as long as this relighter.
  [[nodiscard]] const GlResolve* gl() const;

 private:
  struct State;
  struct Destroy {
    void operator()(State* state) const noexcept;
  };
  explicit Relighter(std::unique_ptr<State, Destroy> state);
  std::unique_ptr<State, Destroy> state_;
};

// Mean radiance of each sky patch from an equirectangular map: width x height RGB radiance [W/m²/sr], row 0 at +Y, the
// middle of a row at -Z, columns turning toward +X. A texel belongs to the patch whose centre is nearest. Empty when
// texels.size() is not width * height or either is 0.
[[nodiscard]] std::vector<glm::vec3> projectEnvironment(std::span<const glm::vec3> skyDirection,
                                                        std::span<const glm::vec3> texels, std::uint32_t width,
                                                        std::uint32_t height);

// Radiance of each sky patch under a sky of one colour overhead and another underfoot, by height between them.
[[nodiscard]] std::vector<glm::vec3> twoColorSky(std::span<const glm::vec3> skyDirection, const glm::vec3& overhead,
                                                 const glm::vec3& underfoot);

// The same under a sky of spherical harmonics: radiance [W/m²/sr] is the sum of coefficients times orthonormal
// functions, without Condon-Shortley signs: 0.282095; 0.488603 (y, z, x); and so on, y_l^m at l * l + l + m. What is
// negative counts as 0. Empty unless there are 1, 4, 9, 16, 25, 36, 49 or 64 coefficients.
[[nodiscard]] std::vector<glm::vec3> shSky(std::span<const glm::vec3> skyDirection,
                                           std::span<const glm::vec3> coefficients);

// Relight until the change of the caches' total falls below `tolerance` (relative) [>= 0], at most maxFrames [>= 0]
// times: a closed room of albedo 0.95 takes some 130 frames, plaster about 20. Returns the number of frames, or what
// check() says of the setup; usage: a tolerance or maxFrames out of range, NaN is. For tools and tests; a game
// converges over its frames by itself.
[[nodiscard]] Result<int> relightUntilConverged(Relighter& relighter, const LightSetup& setup, float tolerance = 1e-4f,
                                                int maxFrames = 1024);

}  // namespace relume
