// SPDX-License-Identifier: MIT
// Indirect light without a bake: a level lights up the moment it is opened, and its walls may be moved. Coarser than a
// bake's: caches stand in the cells of a voxel volume and gather from it, every frame, after CRC (Vardis et al. 2014);
// voxels reflect what caches had a frame before, so that bounces add up over the frames. docs/notes/live.md has errors
// and times.
//
//   create()  find the voxels of a level                       once: 0.3 to 0.9 s for 262,000 triangles
//   centre()  volumes of finer voxels follow the eye           every frame, where there are several
//   move()    parts that move, where they are now              every frame, if they did
//   edit()    the editor: parts placed elsewhere or taken away
//   update()  a frame: direct light on the voxels, then all caches
//   resolve   irradiance() here, or LiveGlResolve in a shader of the host's: added to direct light, as a bake's would
//   be
//
// The voxels are found on the CPU; the passes of update() run there or in OpenGL 4.3 and give the same light to 0.2 %
// of each cache.
//
// Threads: as a Relighter's (relighter.h). Units: lights.h's. OpenGL state is put back as a Relighter puts it back.
// What a call refuses leaves level and light as they were. Memory that runs out is ErrorCode::memory.
#pragma once

#include "relume/lights.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "relume/voxel_geometry.h"

#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// What the names in LiveGlResolve's GLSL begin with, and the texture units that it reads: each light has others where a
// shader reads several. A bake's GlResolve has units 12 to 18, and names that begin with relume.
struct LiveGlNames {
  std::string prefix = "relumeLive";  // [1..64] a letter, then letters, digits and single underscores; not gl_
  std::array<std::uint32_t, 3> textureUnits{12, 13, 14};  // different ones, below GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS
};

struct LiveLightOptions {
  BackendKind backend = BackendKind::cpu;
  glm::vec3 boxMin{0.0f}, boxMax{0.0f};  // [m] where light is wanted; equal = the bounds of the parts' triangles
  // [8..64] on the box's longest side; a cache in each that has surfaces near. A voxel is a quarter of a cell, and
  // rays end in quarters of a voxel: what is thinner closes gaps beside it. Surfaces in one voxel share its light.
  std::uint32_t cells = 32;
  // [1..4] volumes in one another: the outermost has the box, each other one cells half as large as the one around it,
  // as many along each axis as reach across the box, `cells` at most. Those follow the eye (centre()), and stay within
  // the box. Each takes the memory and time of a volume.
  std::uint32_t cascades = 1;
  // The outermost follows the eye as well and keeps its size: a part of a level that has no end. Within two cells of
  // its faces light fades into the sky's, as if nothing hid that, which is all that there is beyond.
  bool boxFollowsEye = false;
  // [m] within 1e9: where create() centres what follows the eye; nothing = the box's middle
  std::optional<glm::vec3> eyeWorld{};
  std::uint32_t raysPerCell = 64;  // [8..4096] a frame: time and noise
  // [voxels] that keep their sides, of what stands and of what moves in each volume; others hide light and are black.
  // 0 = a quarter of the volume, 65536 at least.
  std::uint32_t surfaceBudget = 0;
  ParallelFor parallelFor{};  // empty = one thread; its copies live as long as the light
  // GL backend: as RelightOptions has both; bindings, units and names that are Relume's are the same, so that one text
  // serves a bake and light without one. The CPU backend asks the setup's visibility or visibilityBatch.
  std::string visibilityGlsl{};
  GetProcAddress getProcAddress{};
  LiveGlNames glNames{};  // GL backend
};

struct LiveSky {
  glm::vec3 radiance{0.0f};  // [W/m²/sr] [0..1e9] from everywhere
  // [W/m²/sr] in place of it: an octahedral map of the sphere. Direction d lies at p = (d.x, d.y) / (|d.x| + |d.y| +
  // |d.z|); where d.z < 0 at ((1 - |p.y|) sign(p.x), (1 - |p.x|) sign(p.y)). Columns and rows go from p = -1 to 1.
  std::span<const glm::vec3> map{};
  std::uint32_t side = 0;  // [texel] of the map; [Size map: side²]
};

struct LiveFrame {
  glm::vec3 emissionScale{1.0f};  // [0..1e9] factor on the surfaces' emission
  float bounceScale = 1.0f;       // [0..1] share of last frame's caches that voxels reflect; 0 = one bounce
  float keep = 0.0f;              // [0..1) share of last frame's caches that stays: exp(-seconds / 0.15) hides noise
  LiveSky sky;
  std::uint32_t raySet = 0;   // which of the sets of rays, even in themselves and together: count the frames
  bool freezeVoxels = false;  // gather once more from the voxels as they are lit: more rays, no bounce more
};

// Light at a place in a shader of the host's. The context of create() must be current.
class LiveGlResolve {
 public:
  virtual ~LiveGlResolve() = default;
  // GLSL 4.30 to put into the host's shader after #version: defines vec3 relumeLiveIrradiance(vec3 positionWorld, vec3
  // n) [W/m²] and vec3 relumeLiveGlossy(vec3 positionWorld, vec3 n, vec3 r, float exponent), mean radiance in a
  // cos^exponent lobe about r, with LiveGlNames::prefix in place of relumeLive. Both read the caches around a place
  // once for an invocation: call them for one place and normal. Texts of several lights may stand in one shader, by
  // prefixes and texture units of their own: two of one prefix do not compile.
  virtual const std::string& glsl() const = 0;
  // Before a draw with such a shader: its uniforms, and its textures, which stay bound to LiveGlNames::textureUnits,
  // without samplers of the host's; the active unit is as it was.
  // usage: no linked program has that number; another sampler that the program reads has one of these units, a bake's
  // or another light's for example; the message names it. Both are looked for when a program is handed over for the
  // first time, once its own samplers are set.
  [[nodiscard]] virtual Status setUniforms(std::uint32_t program) const = 0;
  virtual void bind() const = 0;
  // GL program of direct light on the voxels, for the host's shadow uniforms.
  virtual std::uint32_t directProgram() const = 0;
};

class LiveLight {
 public:
  // usage: an option out of range, an index or a number of the geometry's out of its range (the message names surface,
  // mesh, triangle or part), a box that is not finite or inside out, more than 2^25 triangles once they are split into
  // pieces of at most eight voxels, the GL backend without getProcAddress, bad glNames, a block of
  // visibilityGlsl at a binding of Relume's; unsupported: no OpenGL 4.3; failed: a shader did not compile; memory.
  static Result<LiveLight> create(const VoxelGeometry& geometry, const LiveLightOptions& options);
  LiveLight(LiveLight&&) noexcept;
  LiveLight& operator=(LiveLight&&) noexcept;
  ~LiveLight();

  // The eye is here now: what follows it moves in whole cells of its own, so that its middle lies within 3/4 of a cell
  // of the eye on each axis, or as near as the box has it. Voxels and caches of the cells that it keeps stay as they
  // are; caches of those that are new begin with the light of the volume around them, so that one that has jumped
  // farther than itself begins anew. Returns whether any has moved. usage: an eye that is not within 1e9 m; memory.
  Result<bool> centre(const glm::vec3& eyeWorld);

  // [Size moving parts, in their order] usage: another number of transforms, a number in one beyond 1e8; memory.
  [[nodiscard]] Status move(std::span<const glm::mat4x3> toWorld);
  // usage: no such part, one that moves, a number of a transform beyond 1e8; memory.
  [[nodiscard]] Status edit(std::span<const PartEdit> edits);

  // A frame. Of the setup its lights and, on the CPU, their visibility count. usage: a light that Relighter::check()
  // refuses, a number of the frame out of its range, a map of another size; unsupported: more voxels than OpenGL's
  // buffers hold, after which there is no light until a frame fits; memory.
  [[nodiscard]] Status update(const LightSetup& setup, const LiveFrame& frame);
  // No light, as before the first frame.
  void reset();

  // Irradiance [W/m²] by all light but the punctual lights' own, at a receiver with unit normal, from the caches around
  // it that it sees: those of the innermost volume that holds it and, within two of its cells of a face, more and more
  // of the one around it. Caches are near surfaces, those of parts that move among them: in open air, more than a cell
  // to a cell and a half from any, light is that of the nearest ones in sight, which takes up to a
  // millisecond (gl(): a shader finds none there). Finite and never negative; zero outside of a box that stays, where
  // no cache is in sight, and where position or normal is not finite. With OpenGL the first call after a frame reads
  // the caches back.
  [[nodiscard]] glm::vec3 irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const;
  // Null with the CPU backend.
  [[nodiscard]] const LiveGlResolve* gl() const;

  [[nodiscard]] VoxelStats voxels() const;
  [[nodiscard]] std::uint32_t caches() const;  // as of the last update()
  // Of the last call of each: "voxelise", "move", "cells", "direct", "bounce", "gather"; with OpenGL the last three are
  // GPU time of a frame that it has finished.
  [[nodiscard]] std::vector<PassTime> passTimes() const;
  // Bytes by what they are for.
  [[nodiscard]] std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  struct State;
  struct Destroy {
    void operator()(State* state) const noexcept;
  };
  explicit LiveLight(std::unique_ptr<State, Destroy> state);
  std::unique_ptr<State, Destroy> state_;
};

}  // namespace relume
