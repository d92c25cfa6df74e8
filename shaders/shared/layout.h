// SPDX-License-Identifier: MIT
// What C++ and GLSL must agree on: slots, sizes and structs of the passes. Valid as both. Slots are macros because GLSL
// 4.30 takes only literals in layout qualifiers; no pass uses more than the 8 storage blocks every driver has.
//
// RELUME_VULKAN: the GLSL is for Vulkan. Slots are then bindings of one descriptor set, where those of images follow
// those of buffers, and parameters are push constants; in OpenGL they are plain uniforms.
#ifndef RELUME_LAYOUT_H
#define RELUME_LAYOUT_H

// Storage buffers of the passes.
#define RELUME_SLOT_SURFELS 0    // bounce, surfels: words (runtime/shared/pack_surfel.h)
#define RELUME_SLOT_LEAF_NODE 1  // bounce, surfels: node of each sender (shaders/lib/leaf_node.glsl)
#define RELUME_SLOT_GRIDDED \
  2  // bounce: where the shares of each gridded surfel begin, then all shares (runtime/shared/receivers.h)
#define RELUME_SLOT_LIGHTS 2  // surfels: RelumeLight[]
#define RELUME_SLOT_HOST 3    // surfels: what the host hands over a frame, four floats each
#define RELUME_SLOT_NODES 4   // bounce (out), surfels (in, out), pull (in, out), caches (in): packed radiosity
#define RELUME_SLOT_TEXELS 5  // surfels, caches of the light map (out): packed, of each texel's cache along its normal
#define RELUME_SLOT_EMISSION 6      // surfels: packed emission of each, if any emits
#define RELUME_SLOT_EMITTERS 0      // emitters (out: RELUME_SLOT_EMISSION): RelumeEmitter[]
#define RELUME_SLOT_SURFEL_LIGHT 7  // surfels: irradiance of each by the host's own shader
#define RELUME_SLOT_PULL 0          // pull: a word an inner node (runtime/passes/pull_schedule.h)
#define RELUME_SLOT_RUNS 1          // pull: runs of them, two words each
#define RELUME_SLOT_ROUNDS 2        // pull: first run of each work group, then of each round of the top
#define RELUME_SLOT_ROWS 0          // caches: first link of each cache; repacked links: and where its nodes step
#define RELUME_SLOT_LINKS 1         // caches: cone links, nodes of SH links, heads of compact ones, or repacked words
#define RELUME_SLOT_LINK_SHAPE \
  2  // caches: coefficients of SH links, halves; shapes of compact links; or repacked transfers
#define RELUME_SLOT_FACTORS 0     // grid texture: bands to vectors (runtime/passes/pack_textures.cpp)
#define RELUME_SLOT_SHARES 1      // grid texture: first share of each texel, then all shares
#define RELUME_SLOT_VECTORS 2     // grid texture (out, then in): vectors of each cache
#define RELUME_SLOT_MAP_TEXELS 3  // caches of the light map: texels of each (shaders/lib/map_texel.glsl)

// Moving parts (runtime/passes/pack_moving.h): their light, what they hide of links, and what that changes of caches.
#define RELUME_SLOT_LIT_SHAPES 0     // light of parts: words of shapes
#define RELUME_SLOT_PARTS 3          // light of parts, occlusion: RelumePart[]
#define RELUME_SLOT_SENDER_POINTS 5  // occlusion: points of each node, all points, positions and normals of caches
#define RELUME_SLOT_SHAPES 6         // occlusion: words of shapes
#define RELUME_SLOT_MOVING_LIGHT 7   // caches (in), occlusion (in, out): of caches; two vec4 a part, a patch and a view
#define RELUME_SLOT_LIT_PARTS 4      // light of parts (out): the same; the resolve's uniforms are 7 there
#define RELUME_PART_GROUP 64         // threads of a work group that lights a part
// Words of a shape: bricks along x, y, z; boxes of patches along x, y, z; first words of the boxes and of the patches;
// how many patches; two words a brick. Each box has six numbers of patches, kRelumeNone = none.
#define RELUME_SHAPE_BOXES 3u
#define RELUME_SHAPE_PATCH_OF 6u
#define RELUME_SHAPE_PATCHES 7u
#define RELUME_SHAPE_PATCH_COUNT 8u
#define RELUME_SHAPE_BITS 9u
// Behind the patches come the views (runtime/moving/shape_views.h): share, depth, numbers of patches, their weights.
#define RELUME_VIEW_SIDE 12u
#define RELUME_VIEWS 144u
#define RELUME_VIEW_PATCHES 4u
#define RELUME_VIEW_WORDS 10u
// Words of a patch: position, normal, albedo, emission, area.
#define RELUME_PATCH_NORMAL 3u
#define RELUME_PATCH_ALBEDO 6u
#define RELUME_PATCH_EMISSION 9u
#define RELUME_PATCH_AREA 12u
#define RELUME_SHAPE_PATCH_WORDS 13u

// What parts change of a cache, vec4: Y, Co, Cg, and the luma of the sender that they hide most of, when that was
// found; the mean direction of what changes, and that sender's number or one of these; Y, Co, Cg of lamps that are not
// near; their directions and 1, each times the size of Y, summed.
#define RELUME_CHANGE_WORDS 4u
#define RELUME_CHANGE_NONE -1.0      // parts change nothing
#define RELUME_CHANGE_NOT_NEAR -2.0  // no part is near

// Image units of OpenGL follow the slots of buffers in Vulkan.
#define RELUME_VULKAN_IMAGES 8
// Images that caches of the light map write, and those that the fill of the grid's texture writes.
#ifdef RELUME_VULKAN
#define RELUME_IMAGE_Y 8
#define RELUME_IMAGE_CO 9
#define RELUME_IMAGE_CG 10
#define RELUME_IMAGE_GRID_VECTORS 8
#define RELUME_IMAGE_GRID_CHROMA 9
#else
#define RELUME_IMAGE_Y 0
#define RELUME_IMAGE_CO 1
#define RELUME_IMAGE_CG 2
#define RELUME_IMAGE_GRID_VECTORS 0
#define RELUME_IMAGE_GRID_CHROMA 1
#endif

#define RELUME_UNIT_EMISSION 12  // emitters: texture unit of the image that drives a material

// Resolve: in the host's shaders and in the bounce. A host may define these before GlResolve::glsl().
#ifndef RELUME_RESOLVE_UNIT_Y
#define RELUME_RESOLVE_UNIT_Y 12  // texture unit of the light map's Y coefficients
#endif
#ifndef RELUME_RESOLVE_UNIT_CO
#define RELUME_RESOLVE_UNIT_CO 13
#endif
#ifndef RELUME_RESOLVE_UNIT_CG
#define RELUME_RESOLVE_UNIT_CG 14
#endif
#ifndef RELUME_RESOLVE_UNIT_NORMAL
#define RELUME_RESOLVE_UNIT_NORMAL 15  // normal of the texel's cache; w = 1 where there is one
#endif
// Units that hosts alone bind, and only to read the grid's texture; every driver has them.
#ifndef RELUME_RESOLVE_UNIT_GRID_VECTORS
#define RELUME_RESOLVE_UNIT_GRID_VECTORS 16  // luma vectors of the grid's texture; w = weight
#endif
#ifndef RELUME_RESOLVE_UNIT_GRID_CHROMA
#define RELUME_RESOLVE_UNIT_GRID_CHROMA 17
#endif
#ifndef RELUME_RESOLVE_UNIT_GRID_OPEN
#define RELUME_RESOLVE_UNIT_GRID_OPEN 18  // bits of each of its cells
#endif
#ifndef RELUME_RESOLVE_SLOT_CACHES
#define RELUME_RESOLVE_SLOT_CACHES 5  // storage buffer: coefficients of the grid's caches, four halves a uvec2
#endif
#ifndef RELUME_RESOLVE_SLOT_GRID
#define RELUME_RESOLVE_SLOT_GRID 6  // storage buffer: the grid, runtime/shared/pack_grid.h
#endif
#ifndef RELUME_RESOLVE_SLOT_UNIFORMS
#define RELUME_RESOLVE_SLOT_UNIFORMS 7  // uniform buffer: RelumeResolve
#endif

// Descriptor sets of both in Vulkan.
#ifndef RELUME_RESOLVE_SET
#define RELUME_RESOLVE_SET 0
#endif
#ifndef RELUME_SURFELS_SET
#define RELUME_SURFELS_SET 0
#endif
#ifdef RELUME_VULKAN
#define RELUME_AT(set_, slot) set = set_, binding = slot
#else
#define RELUME_AT(set_, slot) binding = slot
#endif

// Surfels: in the host's shader that lights them. A host may define these before GlResolve::surfelGlsl().
#ifndef RELUME_SURFELS_SLOT_WORDS
#define RELUME_SURFELS_SLOT_WORDS 0  // storage buffer: packed surfels
#endif
#ifndef RELUME_SURFELS_SLOT_LIGHT
#define RELUME_SURFELS_SLOT_LIGHT 1  // storage buffer, written: irradiance of each
#endif
#ifndef RELUME_SURFELS_SLOT_UNIFORMS
#define RELUME_SURFELS_SLOT_UNIFORMS 2  // uniform buffer, in Vulkan: RelumeSurfels
#endif

// What receivers may have: formats/limits.h, runtime/shared/resolve.h.
#define RELUME_MAX_COORDINATE 1e9f  // [m]
#define RELUME_MAX_NORMAL2 4.0f
#define RELUME_MAX_EXPONENT 1e4f
#define RELUME_MAX_RADIANCE 1e9f  // [W/m²/sr]

// Cells of the grid's texture, and what it knows at least: runtime/shared/grid_texture.h.
#define RELUME_OPEN_CELL 1u
#define RELUME_OPEN_AROUND 2u
#define RELUME_MIN_TEXEL_WEIGHT 0.015625f

// Threads of a work group.
#define RELUME_SURFEL_GROUP 64
#define RELUME_FILL_GROUP 64

// Light without a bake (runtime/live_gl): storage buffers, texture units, rows of textures.
#define RELUME_LIVE_SLOT_SIDES 0       // three vec4 a side: position [voxels], normal, emission; albedo in their w
#define RELUME_LIVE_SLOT_STENCILS 1    // five words a side (live_stencils.comp)
#define RELUME_LIVE_SLOT_VOXELS 2      // two words a voxel: 127 times its axis + 128, emitters; place, 10 bits each
#define RELUME_LIVE_SLOT_DIRECT 3      // vec4 a side: irradiance [W/m²]
#define RELUME_LIVE_SLOT_SAMPLES 4     // four pairs of words a side: runtime/voxels/voxel_layer.h, SideSample
#define RELUME_LIVE_SLOT_LIGHTS 5      // RelumeLight[]
#define RELUME_LIVE_SLOT_NODES 1       // of a bake: packed radiosity of its nodes
#define RELUME_LIVE_SLOT_SENDERS 4     // of a bake: live_bake.comp
#define RELUME_LIVE_SLOT_CACHES 0      // gather: the voxel of each cache, 10 bits each
#define RELUME_LIVE_SLOT_RAY_CELLS 1   // gather: RelumeRayCell[], cells as in the texture of bits
#define RELUME_LIVE_SLOT_SUB_VOXELS 2  // gather: two words a voxel that has sub-voxels, their bits
#define RELUME_LIVE_SLOT_CARRY 0       // carry: the slot that each cache had before, ~0 = none
#define RELUME_LIVE_SLOT_POSITIONS 0   // voxelise: floats, three a vertex
#define RELUME_LIVE_SLOT_TRIANGLES 1   // voxelise: three vertices, then the part
#define RELUME_LIVE_SLOT_PLACES 2      // voxelise: RelumePlace[]
#define RELUME_LIVE_SLOT_LARGE 3       // voxelise: an indirect dispatch, and the triangles that it is for
#define RELUME_LIVE_IMAGE_BRICKS 0     // voxelise, clear, raster (live_raster.glsl): image unit of the bits
#define RELUME_LIVE_UNIT_CELLS 12
#define RELUME_LIVE_UNIT_SUB_VOXELS 13
#define RELUME_LIVE_UNIT_LIGHT 14
#define RELUME_LIVE_UNIT_RAYS 13      // gather
#define RELUME_LIVE_UNIT_RADIANCE 14  // gather
#define RELUME_LIVE_UNIT_MOVING 15    // gather
#define RELUME_LIVE_MAX_VOLUMES 4
#define RELUME_LIVE_BLEND_CELLS 2.0f  // from a face on, in which a volume takes over from the one around it
#define RELUME_LIVE_SUB_VOXELS_A_ROW 2048
#define RELUME_LIVE_CACHES_A_ROW 256  // seven texels each
#define RELUME_LIVE_SIDES_A_ROW 2048
#define RELUME_LIVE_GROUP 64
#define RELUME_LIVE_MAX_GROUPS 65535
#define RELUME_LIVE_BLOCK 32    // [voxels] side of the blocks in which large triangles are voxelised
#define RELUME_LIVE_LIFT 0.05f  // [voxel] of places off their surface, which is rounded

// Splats of radiance records (tools/gl_splat): attributes of a record, texture units, uniforms, targets.
#define RELUME_SPLAT_AT_BOX 0       // uvec4 [pixel]: minX, minY, maxX, maxY
#define RELUME_SPLAT_AT_POSITION 1  // [m] p_k; w: reach
#define RELUME_SPLAT_AT_NORMAL 2    // n_k; w: share of the gradient that counts
#define RELUME_SPLAT_AT_NEAR 3      // [m] R_k where neighbour clamping asks for it, else 0
#define RELUME_SPLAT_AT_LIGHT 4     // nine vec4: splat_records.frag
#define RELUME_SPLAT_LIGHTS 9
#define RELUME_SPLAT_MIRROR_LIGHTS 2  // of a radiance record: tangent, its number; bitangent
#define RELUME_SPLAT_UNIT_PLACE 12    // [m] xyz position, w width of a pixel
#define RELUME_SPLAT_UNIT_FACING 13   // xyz normal, 0 where nothing is seen; w [m] occluder
#define RELUME_SPLAT_UNIT_LIT 14      // xyz normal that light is read for
#define RELUME_SPLAT_UNIT_LOBE 14     // xyz axis, w exponent
#define RELUME_SPLAT_SLOT_RADIANCE 0  // 9 order² floats a radiance record: bake/preview/hsh_cells.h
#define RELUME_SPLAT_SLOT_TILTS 1     // HshTilt::tables()
#define RELUME_SPLAT_SLOT_LOBES 2     // LobeTable::coefficients()
#define RELUME_SPLAT_UNIT_SUM 12      // picture: xyz sum of w_k E'_k reflected, w sum of w_k
#define RELUME_SPLAT_UNIT_SUM_SKY 14  // picture: of light from the sky
#define RELUME_SPLAT_AT_SIZE 0        // vec2 [pixel] of the targets
#define RELUME_SPLAT_AT_ACCURACY 1    // a
#define RELUME_SPLAT_AT_WEIGHT 2      // int: RecordWeight of bake/preview/weights.h
#define RELUME_SPLAT_AT_GUARDED 3     // bool: RecordReach::guarded
#define RELUME_SPLAT_AT_GRADIENTS 4   // bool
#define RELUME_SPLAT_AT_MAX_TILT 5    // int [degrees]
#define RELUME_SPLAT_SMOOTH 0
#define RELUME_SPLAT_WARD 1
#define RELUME_SPLAT_TABELLION 2
#define RELUME_SPLAT_FAR 1e30f  // [m] stands for infinity

// Cones (runtime/live_gl/cones_gl.h); cells are bound as those of light without a bake.
#define RELUME_CONE_SLOT_DIRECTIONS 0  // the hemisphere's cones: direction, tangent; then the texels of the sky's map
#define RELUME_CONE_SLOT_LIST 0        // levels: the voxels of each that are not empty, or were not; 10 bits an axis
#define RELUME_CONE_SLOT_SOURCES 0     // inject: the voxel of the caches' radiance that each one has; ~0 = none
#define RELUME_CONE_SLOT_RSM_VOXELS 0  // of maps: RelumeRsmVoxel[]
#define RELUME_CONE_SLOT_BRIGHTEST 2   // bits of the brightest voxel's largest channel: lib/cone_unit.glsl
#define RELUME_CONE_SLOT_RSM_SUMS 1    // of maps: six words a side: three channels' low words, then their high ones
#define RELUME_CONE_UNIT_RADIANCE 14   // two texels a voxel: front, axis as RELUME_LIVE_SLOT_VOXELS; back, depth
#define RELUME_CONE_UNIT_SIDES 15      // four texels a voxel: front's position [voxels], share; normal; the back's
#define RELUME_CONE_UNIT_SOURCE 15     // inject: radiance of the caches' sides
#define RELUME_CONE_UNIT_RSM_PLACES 8  // of maps: position [m], area [m²]; 0 = nothing is seen
#define RELUME_CONE_UNIT_RSM_NORMALS 9
#define RELUME_CONE_UNIT_RSM_FLUX 10  // [W]
#define RELUME_CONE_UNIT_FIRST 8      // level 1
#define RELUME_CONE_UNIT_LEVELS 9     // all further levels, one behind the other along z
#define RELUME_CONE_UNIT_PLACES 10    // of pixels: position [m], depth [m]; 0 = nothing is seen
#define RELUME_CONE_UNIT_PLANES 11    // the plane's normal
#define RELUME_CONE_UNIT_NORMALS 13   // to shade with; of lobes the mirrored direction, exponent
#define RELUME_CONE_UNIT_LIGHT 8      // between pixels, here and below
#define RELUME_CONE_UNIT_EDGES 9
#define RELUME_CONE_UNIT_OLD_LIGHT 12  // of the frame before, here and below
#define RELUME_CONE_UNIT_OLD_PLACES 13
#define RELUME_CONE_UNIT_OLD_PLANES 14
#define RELUME_CONE_UNIT_OLD_FRAMES 15
#define RELUME_CONE_UNITS 8  // the last ones of the 16 that every OpenGL has
#define RELUME_CONE_MAX_LEVELS 9
#define RELUME_CONE_PATTERN 5  // pixels a side

#ifdef __cplusplus
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>

namespace relume::gl {
using uint = std::uint32_t;
using glm::ivec3;
using glm::ivec4;
using glm::uvec2;
using glm::uvec3;
using glm::uvec4;
using glm::vec3;
using glm::vec4;
#endif

const uint kRelumeNone = 0xFFFFFFFFu;  // no cache; a surfel that reads the grid

// Grid: include/relume/caches.h and formats/grid_depth.h.
const uint kRelumeBrickWords = 27u;
const uint kRelumeHanging = 0xFFFFFFFEu;
const int kRelumeDepthSide = 17;

// Pull: low bits of a run's two words, its first node and its first inner node. The rest of both is the number of inner
// nodes. Weights are over kRelumePullWeightOne.
const uint kRelumePullNodeBits = 25u;
const uint kRelumePullWeightOne = 65534u;

const uint kRelumeCacheBits = 22u;  // runtime/shared/receivers.h: bits of a cache beside its share

// std430
struct RelumeLight {
  vec4 position;   // [m] w: [1/m²] 1 / range², 0 = no range, -1 = directional
  vec4 direction;  // unit, the way the light travels; w: factor on the cosine around it, so that a spot's edge
  vec4 intensity;  // point, spot [W/sr]; directional [W/m²]; w: plus this rises from 0 to 1 (point: 0 and 1)
};

// std430. Where a part stands in a grid: StepPlace of runtime/voxels/step_place.h.
struct RelumePlace {
  ivec4 x, y, z;  // an axis each: factors of the three coordinates, then the low word of the offset
  ivec3 high;     // the high words
  int exponent;   // of the factors
  int mirrored;   // 1 = it is
  int unused, unused2, unused3;
};

// std430. What rays meet of a cell, of what stands and of what moves: bits of the voxels that have sub-voxels
// (runtime/voxels/sub_voxels.h), and the number of the first of them.
struct RelumeRayCell {
  uvec2 standing, moving;
  uint firstStanding, firstMoving;
};

// std430. A voxel that reflective shadow maps light (runtime/cones/rsm_voxels.h). Of its front and its back the side
// that has the flux, kRelumeNone = no cone reads it; emission [W/m²/sr]; w: [1/(m² sr)] radiance by flux.
struct RelumeRsmVoxel {
  uint axis;  // as RELUME_LIVE_SLOT_VOXELS
  uint front, back;
  float frontShare;  // of the area of both
  vec4 frontLight, backLight;
};

// std430. A moving part as it stands in a frame: runtime/moving/place_shape.h.
struct RelumePart {
  vec3 toGridX;  // columns: directions into the shape's grid [voxels/m]
  uint shape;    // its first word
  vec3 toGridY;
  uint firstPatch;  // among all patches of the frame, past the means of as many parts as there may be
  vec3 toGridZ;
  float radius;     // [m] of the sphere around it
  vec3 centre;      // [m]
  float voxel;      // [m] in the shape's own axes
  vec3 origin;      // [m] the translation
  float ball;       // [m] PartSphere::ball
  vec3 gridOrigin;  // [voxels] of the shape's grid, from its own origin
  float viewShare;  // ShapePlace::shareOf() of a view, times its length along the view
  vec3 toWorldX;    // columns: from the shape's axes
  float viewDepth;  // scale of the depth of views
  vec3 toWorldY;
  float least;  // that it covers where its light ends
  vec3 toWorldZ;
  float unused5;
};

// By what a run of emitter entries is driven.
const uint kRelumeBaked = 0u, kRelumeColor = 1u, kRelumeImage = 2u;

// std430
struct RelumeEmitter {
  uint slot;       // in the emission's buffer
  uint baked;      // [W/m²/sr] packed (runtime/shared/pack_color.h)
  float tapWidth;  // Emitters::tapWidth
  uint unused;
  uvec4 tap;  // Emitters::tap
};

// std140
struct RelumeResolve {
  vec3 gridOriginWorld;         // [m]
  uint gridBricks;              // first word in the grid's buffer: brick of each cell; kRelumeNone = no bricks
  vec3 gridSpacing;             // [m]
  uint gridFine;                // the bricks
  uvec3 gridResolution;         // 0 = no grid
  uint gridCaches;              // the caches: 3 + gridDepthWords words each
  uint gridDepthWords;          // 0 = it is not known how far caches see
  float gridDepthUnit;          // [m]
  float gridFinestSpacing;      // [m]
  uint mapSight;                // first word: Lightmap::sight; kRelumeNone = all points are read where they are
  vec3 gridTextureSpacing;      // [m]
  uint gridTextureStep;         // texels along z from half to half
  uvec3 gridTextureResolution;  // 0 = no texture
  uint unused2;
};

// std140
struct RelumeSurfels {
  vec3 origin;   // [m] SurfelBox
  uint slots;    // how many there are
  vec3 step_;    // [m]
  float radius;  // [m] of a disc of a surfel's area
};

// Parameters of a pass's dispatches, P(type, name) each: vectors begin where both std430 and C++ put them.
#define RELUME_BOUNCE_PARAMETERS(P) P(uint, relumeFirstSurfel) P(uint, relumeEndSurfel)

// relumeDrivenBy: kRelumeBaked, kRelumeColor or kRelumeImage; relumeFactor on it, of a colour the colour [W/m²/sr]
#define RELUME_DRIVE_PARAMETERS(P) \
  P(vec3, relumeFactor) P(uint, relumeDrivenBy) P(uint, relumeFirstEntry) P(uint, relumeEndEntry)

// relumeBoxOrigin, relumeBoxStep [m]: SurfelBox. relumeFlatEnd: up to here, surfels read relumeTexelColor.
// relumeHostOffset: first colour of the host's irradiance, emission and sky patches in its buffer; kRelumeNone = not
// handed over. relumeSkyRadiance [W/m²/sr]. relumeBounceScale: 0 also in the first frame. relumeMapSize [texel].
// relumeEmits: as baked or driven; then beside what the host hands over. relumeLitOnGpu: by the host's shader.
// relumeSurfelRadius: [m] of a disc of a surfel's area.
#define RELUME_SURFEL_PARAMETERS(P) \
  P(vec3, relumeBoxOrigin)          \
  P(uint, relumeFlatEnd)            \
  P(vec3, relumeBoxStep)            \
  P(uint, relumeSurfelEnd)          \
  P(uvec3, relumeHostOffset)        \
  P(uint, relumeSenderEnd)          \
  P(vec3, relumeEmissionScale)      \
  P(uint, relumeLightCount)         \
  P(vec3, relumeSkyRadiance)        \
  P(float, relumeBounceScale)       \
  P(uvec2, relumeMapSize)           \
  P(uint, relumeEmits)              \
  P(uint, relumeLitOnGpu)           \
  P(float, relumeSurfelRadius)

// relumeFirst: group; of the top, round.
#define RELUME_PULL_PARAMETERS(P) P(uint, relumeFirst) P(uint, relumeEndRound)

// A batch: the caches and links that one binding of the link buffers covers. relumeFirstLink: link at its start;
// relumeWordOffset, relumeHalfOffset: its first word and half within the bindings. relumeShapeStride: coefficients of
// an SH link.
#define RELUME_BATCH_PARAMETERS(P) \
  P(uint, relumeFirstCache)        \
  P(uint, relumeEndCache)          \
  P(uint, relumeFirstLink)         \
  P(uint, relumeWordOffset)        \
  P(uint, relumeHalfOffset)        \
  P(uint, relumeShapeStride)

// relumeGridLinks: how many irradiance links have a shape, counted from the bake's first. The last two: of the light
// map alone.
#define RELUME_CACHE_PARAMETERS(P) \
  RELUME_BATCH_PARAMETERS(P)       \
  P(uint, relumeGridLinks)         \
  P(uint, relumeFirstMapCache)     \
  P(uint, relumeMapWidth)

// relumeFirstLight: vec4 of the first part's light. relumeBounceScale: 0 also in the first frame.
#define RELUME_PART_LIGHT_PARAMETERS(P) \
  P(vec3, relumeEmissionScale)          \
  P(float, relumeBounceScale)           \
  P(uint, relumeFirstPart)              \
  P(uint, relumeEndPart) P(uint, relumeFirstLight) P(uint, relumeLightCount) P(uint, relumeFirstView)

// relumeFirstView: vec4 of the views' light. relumePoints, relumePlaces: first words of points and of caches' places.
#define RELUME_OCCLUDE_PARAMETERS(P) \
  RELUME_BATCH_PARAMETERS(P)         \
  P(uint, relumePartCount)           \
  P(uint, relumeFirstLight)          \
  P(uint, relumePoints)              \
  P(uint, relumePlaces)              \
  P(uint, relumeFirstView)           \
  P(uint, relumeFrame)               \
  P(uint, relumeLag)                 \
  P(float, relumeEachFrame)

#define RELUME_FILL_PARAMETERS(P) P(uvec3, relumeResolution) P(uint, relumeFirst) P(uint, relumeEnd)

// RELUME_PARAMETERS(list) declares them in GLSL.
#ifndef __cplusplus
#ifdef RELUME_VULKAN
#define RELUME_DECLARE(type, name) type name;
#define RELUME_PARAMETERS(list) layout(push_constant) uniform RelumeParameters{list(RELUME_DECLARE)};
#else
#define RELUME_DECLARE(type, name) uniform type name;
#define RELUME_PARAMETERS(list) list(RELUME_DECLARE)
#endif
#endif

#ifdef __cplusplus
#define RELUME_DECLARE(type, name) type name;
struct RelumeBounceParameters {
  RELUME_BOUNCE_PARAMETERS(RELUME_DECLARE)
};
struct RelumeDriveParameters {
  RELUME_DRIVE_PARAMETERS(RELUME_DECLARE)
};
struct RelumeSurfelParameters {
  RELUME_SURFEL_PARAMETERS(RELUME_DECLARE)
};
struct RelumePullParameters {
  RELUME_PULL_PARAMETERS(RELUME_DECLARE)
};
struct RelumeCacheParameters {
  RELUME_CACHE_PARAMETERS(RELUME_DECLARE)
};
struct RelumePartLightParameters {
  RELUME_PART_LIGHT_PARAMETERS(RELUME_DECLARE)
};
struct RelumeOccludeParameters {
  RELUME_OCCLUDE_PARAMETERS(RELUME_DECLARE)
};
struct RelumeFillParameters {
  RELUME_FILL_PARAMETERS(RELUME_DECLARE)
};
#undef RELUME_DECLARE
static_assert(sizeof(RelumeDriveParameters) == 24 && sizeof(RelumeSurfelParameters) == 100 &&
              sizeof(RelumeCacheParameters) == 36 && sizeof(RelumeFillParameters) == 20);
static_assert(offsetof(RelumeSurfelParameters, relumeSkyRadiance) == 64 &&
              offsetof(RelumeSurfelParameters, relumeMapSize) == 80);
static_assert(sizeof(RelumePartLightParameters) == 36 && sizeof(RelumeOccludeParameters) == 56);
static_assert(sizeof(RelumePart) == 144 && offsetof(RelumePart, centre) == 48 && offsetof(RelumePart, toWorldZ) == 128);
static_assert(sizeof(RelumeSurfels) == 32 && sizeof(RelumeEmitter) == 32 && offsetof(RelumeEmitter, tap) == 16);
static_assert(sizeof(RelumeLight) == 48 && offsetof(RelumeLight, direction) == 16 &&
              offsetof(RelumeLight, intensity) == 32);
static_assert(sizeof(RelumeRsmVoxel) == 48 && offsetof(RelumeRsmVoxel, frontLight) == 16);
static_assert(sizeof(RelumeRayCell) == 24 && sizeof(RelumePlace) == 80 && offsetof(RelumePlace, high) == 48);
static_assert(sizeof(RelumeResolve) == 96 && offsetof(RelumeResolve, gridTextureResolution) == 80 &&
              offsetof(RelumeResolve, gridDepthWords) == 48 && offsetof(RelumeResolve, gridSpacing) == 16 &&
              offsetof(RelumeResolve, gridResolution) == 32);
}  // namespace relume::gl
#endif

#endif
