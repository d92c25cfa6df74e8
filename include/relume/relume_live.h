/* SPDX-License-Identifier: MIT */
/*
 * Light without a bake, and a baked level that is being edited, for C (C89 and later): the rest of relume.h, whose
 * words on structs, errors, threads and units hold here as well. Include either.
 *
 * Handles and the list of a frame's lights are taken from the context's allocate. All else that lights and blends keep
 * is taken by the global operator new, whatever the context has.
 */
#ifndef RELUME_RELUME_LIVE_H
#define RELUME_RELUME_LIVE_H

#include "relume/relume.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct relume_live relume_live;
typedef struct relume_edit_blend relume_edit_blend;

/* ---- Light without a bake: relume/live_light.h says what it is. Threads: as a relighter's, with relume_live_update()
 * in place of relume_relight(). ---- */

/* Of triangles. No struct_size here and in the next three: arrays of them are handed over. */
typedef struct relume_live_surface {
  float albedo[3];   /* [0..1] */
  float emission[3]; /* [W/m^2/sr] [0..1e9] of the front, and of the back where double_sided */
  float coverage;    /* [0..1] share of its triangles that are there, each whole: 1 but for leaves and fences, which
                        are cut into triangles of about a voxel */
  int double_sided;  /* emits from its back as well; both sides of any triangle reflect */
} relume_live_surface;

typedef struct relume_live_mesh {
  const float* positions; /* three floats each, in the axes of the part */
  size_t position_count;
  const unsigned int* triangles; /* three indices each; the front is counter-clockwise */
  size_t triangle_count;
  const unsigned int* surfaces; /* index of each triangle's surface */
} relume_live_mesh;

typedef struct relume_live_part {
  unsigned int mesh;
  float to_world[12]; /* the x, y and z axes, then the origin */
  int moves;          /* placed anew by relume_live_move() */
} relume_live_part;

/* Where a standing part is from now on, and whether it is there at all. */
typedef struct relume_live_edit {
  unsigned int part;
  float to_world[12];
  int present;
} relume_live_edit;

typedef struct relume_live_desc {
  size_t struct_size;
  relume_backend backend;
  const relume_live_surface* surfaces; /* what is handed over here is read by relume_live_create() alone */
  size_t surface_count;
  const relume_live_mesh* meshes;
  size_t mesh_count;
  const relume_live_part* parts;
  size_t part_count;
  float box_min[3], box_max[3]; /* [m] where light is wanted; equal = the bounds of the parts' triangles */
  unsigned int cells;           /* [8..64] on the box's longest side; 0 = 32 */
  unsigned int rays_per_cell;   /* [8..4096] a frame; 0 = 64 */
  unsigned int surface_budget;  /* [voxels] that keep their sides; 0 = a quarter of the volume */
  const char* visibility_glsl;  /* RELUME_BACKEND_GL: as relume_relighter_desc has it, with the same bindings */
  relume_get_proc_address get_proc_address;
  void* get_proc_address_user;
  unsigned int cascades; /* [1..4] volumes in one another, about the eye (LiveLightOptions::cascades); 0 = 1 */
  int box_follows_eye;   /* the outermost moves as well */
  const float* eye;      /* [3] [m] within 1e9: where what follows it is centred at first; NULL = the box's middle */
  /* RELUME_BACKEND_GL, where a shader reads several lights, or a bake beside one (LiveGlNames): what names in
   * relume_live_gl_glsl() begin with in place of relumeLive, NULL = relumeLive; its three texture units, NULL = 12 to
   * 14. A bake's are 12 to 18. */
  const char* gl_prefix;
  const unsigned int* gl_texture_units; /* [3] */
} relume_live_desc;

/* Errors of LiveLight::create(). The text is the context's. */
RELUME_API relume_status relume_live_create(relume_context* context, const relume_live_desc* desc, relume_live** live);
RELUME_API void relume_live_destroy(relume_live* live);
RELUME_API const char* relume_live_error(const relume_live* live);

/* Moving parts, all of them in their order: 12 floats each. */
RELUME_API relume_status relume_live_move(relume_live* live, const float* to_world, size_t count);
RELUME_API relume_status relume_live_edit_parts(relume_live* live, const relume_live_edit* edits, size_t count);
/* The eye is here now [3] [m] within 1e9: volumes follow it (LiveLight::centre()). `moved`: whether any has; may be
 * NULL. */
RELUME_API relume_status relume_live_centre(relume_live* live, const float* eye, int* moved);

typedef struct relume_live_frame {
  size_t struct_size;
  float emission_scale[3]; /* [0..1e9] factor on the surfaces' emission; default 1 */
  float bounce_scale;      /* [0..1] share of last frame's light that surfaces reflect; default 1 */
  float keep;              /* [0..1) share of last frame's light that stays: exp(-seconds / 0.15) hides noise */
  float sky_radiance[3];   /* [W/m^2/sr] [0..1e9] from everywhere */
  const float* sky_map;    /* in place of it: sky_side x sky_side colours (LiveSky::map); NULL = none */
  unsigned int sky_side;   /* [>= 1 with a map] */
  unsigned int ray_set;    /* count the frames */
  int freeze_voxels;       /* gather once more from surfaces as they are lit */
} relume_live_frame;

/* Zeros but for struct_size, emission_scale and bounce_scale. */
RELUME_API void relume_live_frame_default(relume_live_frame* frame, size_t struct_size);

/* One frame. Of `setup` lights and visibility count. frame: NULL = the defaults. */
RELUME_API relume_status relume_live_update(relume_live* live, const relume_light_setup* setup,
                                            const relume_live_frame* frame);
RELUME_API relume_status relume_live_reset(relume_live* live);
/* Irradiance [W/m^2] at `count` receivers with unit normals, three floats each: of the caches around them, which are
 * near surfaces; in open air of the nearest in sight, which takes longer (LiveLight::irradiance()). */
RELUME_API relume_status relume_live_irradiance(const relume_live* live, size_t count, const float* positions,
                                                const float* normals, float* irradiance);

typedef struct relume_live_info {
  size_t struct_size;
  unsigned int voxels, dropped_voxels; /* dropped: of these, without sides: they are black */
  unsigned int caches;                 /* as of the last frame */
} relume_live_info;
RELUME_API relume_status relume_live_get_info(const relume_live* live, relume_live_info* info);

/* RELUME_BACKEND_GL: GLSL 4.30 for the host's shader (LiveGlResolve), NULL on the CPU; before a draw with it the
 * uniforms of that program, and textures, which stay bound (RELUME_ERROR_USAGE: no linked program has that number, or
 * another sampler of the program has one of the light's texture units); the program that lights the voxels directly, 0
 * on the CPU. */
RELUME_API const char* relume_live_gl_glsl(const relume_live* live);
RELUME_API relume_status relume_live_gl_bind(const relume_live* live, unsigned int program);
RELUME_API unsigned int relume_live_gl_direct_program(const relume_live* live);

/* ---- A baked level that is being edited: near the changed parts two lights without a bake, of the level as it was
 * baked and as it is, correct the bake's light (relume/edit_blend.h). Blends do not change: any threads may use one at
 * once. ---- */

/* Of a changed part, where it was or where it is, in the world. No struct_size: an array of them is handed over. */
typedef struct relume_edit_box {
  float min[3], max[3]; /* [m] within 1e8 */
} relume_edit_box;

typedef struct relume_edit_blend_desc {
  size_t struct_size;
  const relume_edit_box* boxes; /* read by relume_edit_blend_create() alone */
  size_t box_count;             /* 0 = nothing has changed */
  float voxel; /* [m] (0..1e8] of both lights: the longest side of their box / (4 relume_live_desc.cells); no default */
  float reach; /* [m] [0..1e8] how far from a box its change counts in full; 0 = by the box's size */
  float fade;  /* [m] [0..1e8] within which it fades beyond that; 0 = as wide as the reach */
  /* [Size box_count] [m] [0..1e8] of each box, as far as which its change counts in full at least: of a part that
   * emits, as far as its light goes. NULL = 0 for all; read by relume_edit_blend_create() alone */
  const float* box_reaches;
} relume_edit_blend_desc;

/* RELUME_ERROR_USAGE: a box that is not finite and right side out, named by its index, a length out of its range. The
 * text is the context's. */
RELUME_API relume_status relume_edit_blend_create(relume_context* context, const relume_edit_blend_desc* desc,
                                                  relume_edit_blend** blend);
RELUME_API void relume_edit_blend_destroy(relume_edit_blend* blend);
RELUME_API const char* relume_edit_blend_error(const relume_edit_blend* blend);

/* How much the edit counts at `count` positions. shares: two floats each: change, of what the lights say has changed,
 * and contact, of the light after the edit itself. On the changed parts themselves both are 1, wherever they are. */
RELUME_API relume_status relume_edit_blend_share(const relume_edit_blend* blend, size_t count, const float* positions,
                                                 float* shares);
/* Irradiance [W/m^2] of the bake corrected by that of the light before and after the edit, three floats each: the
 * bake's to the bit where change is 0, for which before and after may be anything. The output may be baked, before or
 * after, and must not overlap the shares. */
RELUME_API relume_status relume_edit_blend_irradiance(const relume_edit_blend* blend, size_t count, const float* shares,
                                                      const float* baked, const float* before, const float* after,
                                                      float* irradiance);

/* The same in shaders: GLSL that EditBlend::glsl() describes, of every blend the same. Lives as long as the blend. */
RELUME_API const char* relume_edit_blend_glsl(const relume_edit_blend* blend);
/* Its uniforms. */
typedef struct relume_edit_blend_info {
  size_t struct_size;  /* set by the caller */
  unsigned int boxes;  /* int relumeEditBoxes, at most 32: more are joined */
  float voxel;         /* float relumeEditVoxel */
  const float* values; /* vec4 relumeEditBox[], two a box; NULL where there are none. They live as long as the blend */
} relume_edit_blend_info;
RELUME_API relume_status relume_edit_blend_get_info(const relume_edit_blend* blend, relume_edit_blend_info* info);

#ifdef __cplusplus
}
#endif

#endif
