/* SPDX-License-Identifier: MIT */
/*
 * Relume's runtime for C (C89 and later) and for languages that call C: load a bake, light it every frame, read the
 * indirect light; relume_live.h, which this includes, has light without a bake.
 *
 *   relume_context_desc describe = {sizeof describe, RELUME_API_VERSION};
 *   relume_context* context;      relume_context_create(&describe, &context);
 *   relume_bake* bake;            relume_bake_load(context, "level.relume", &bake);
 *   relume_relighter* relighter;  relume_relighter_create(bake, NULL, &relighter);
 *   each frame:                   relume_relight(relighter, &setup);
 *                                 relume_irradiance_map(relighter, texels, size of texels);
 *   relume_relighter_destroy(relighter); relume_bake_destroy(bake); relume_context_destroy(context);
 *
 * Structs. Those with a struct_size grow in later versions: fill them with zeros, set struct_size to sizeof, then the
 * fields of interest. Fields that the caller's struct does not have take their defaults. Zeros are the defaults, but
 * where a field says otherwise.
 *
 * Errors. Functions that can fail return a relume_status. A text that says where and what to do belongs to the handle
 * that the function was called with (relume_..._error()); of functions that create a handle, to the handle they were
 * given. Outputs are written only on success, but for handles, which are NULL after a failure. No exception crosses.
 * A null handle gives RELUME_ERROR_USAGE without a text, which it could not hold. Any other pointer that must not be
 * null gives it with a text that names the pointer.
 *
 * Threads. Handles are independent of each other; a bake may be used by several relighters at once, and the library
 * has no global state. Of one relighter, relume_relight(), relume_reset(), relume_inherit() and
 * relume_relighter_destroy() each need it alone; between them, all functions with a const relume_relighter* may run at
 * the same time on any threads (with RELUME_BACKEND_GL: on the one whose OpenGL context was current at creation). The
 * callbacks of a context may be called from any thread that calls the library, and from those of parallel_for.
 *
 * Lifetime. A bake keeps what it needs of its context, a relighter what it needs of its bake: handles may be destroyed
 * in any order. Destroying NULL does nothing.
 *
 * Units. Radiometric and metric throughout; coordinates are right-handed with +Y up, as glTF has them. Vectors are
 * three consecutive floats, colours are linear red, green, blue (Rec. 709 primaries).
 */
#ifndef RELUME_RELUME_H
#define RELUME_RELUME_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* For hosts whose compiler wants a word at each function; the library itself is told by a list of symbols. */
#ifndef RELUME_API
#define RELUME_API
#endif

/* Raised when a function or a field changes its meaning; additions leave it. */
#define RELUME_API_VERSION 1

typedef enum relume_status {
  RELUME_OK = 0,
  RELUME_ERROR_USAGE = 1,        /* an argument is out of its range */
  RELUME_ERROR_IO = 2,           /* a file could not be read */
  RELUME_ERROR_INVALID_FILE = 3, /* a file was read and is not what it claims to be */
  RELUME_ERROR_FAILED = 4,       /* the work itself failed; a shader that did not compile */
  RELUME_ERROR_UNSUPPORTED = 5,  /* valid, but nothing this build or machine can handle */
  RELUME_ERROR_MEMORY = 6        /* memory ran out */
} relume_status;

typedef enum relume_severity { RELUME_INFO = 0, RELUME_WARNING = 1, RELUME_ERROR = 2 } relume_severity;
/* RELUME_BACKEND_GL keeps the light of caches in halves, of whatever unit the lights are given in: caches whose
 * irradiance in any direction exceeds about 60000 are dimmed as a whole to what halves hold; light below about 1e-3
 * loses digits, below 1e-7 it is gone. RELUME_BACKEND_CPU keeps them in the range of floats. What surfaces send on goes
 * from 2^-40 to 2^32 [W/m^2] with either backend, and loses digits below 2^-32, about 2e-10. */
typedef enum relume_backend { RELUME_BACKEND_CPU = 0, RELUME_BACKEND_GL = 1 } relume_backend;
typedef enum relume_light_kind { RELUME_DIRECTIONAL = 0, RELUME_POINT = 1, RELUME_SPOT = 2 } relume_light_kind;

typedef struct relume_context relume_context;
typedef struct relume_bake relume_bake;
typedef struct relume_relighter relume_relighter;
typedef struct relume_moving_shapes relume_moving_shapes;

/* Runs task(task_data, 0) .. task(task_data, tasks - 1), in any order and on any threads, and returns when all are
 * done. */
typedef void (*relume_task)(void* task_data, unsigned int index);
typedef void (*relume_parallel_for)(void* user, unsigned int tasks, relume_task task, void* task_data);
/* Every error's text, as it happens. `text` lives until the call returns. */
typedef void (*relume_log)(void* user, relume_severity severity, const char* text);

/* The host's memory. allocate: `size` bytes [at least 1] aligned to `alignment` [a power of two, at most 64], or NULL
 * where there are none: the function that needed them gives RELUME_ERROR_MEMORY with a text that names the size, leaks
 * nothing and leaves last frame's light as it was. deallocate: gets back what allocate gave, with the same size and
 * alignment. */
typedef void* (*relume_allocate)(void* user, size_t size, size_t alignment);
typedef void (*relume_deallocate)(void* user, void* memory, size_t size, size_t alignment);

typedef struct relume_context_desc {
  size_t struct_size;
  unsigned int api_version;         /* RELUME_API_VERSION of the header the host was compiled with */
  void* user;                       /* handed to the callbacks */
  relume_log log;                   /* NULL = no log */
  relume_parallel_for parallel_for; /* NULL = everything on the calling thread */
  /* Serve this context, its bakes and their relighters: the handles, what loading takes, what relighters keep. Both or
   * neither; NULL = the global operators new and delete. Exempt are texts (of errors, names, provenance, GLSL), a few
   * hundred bytes while a file is opened and read, the OpenGL driver's own memory, and the file, which is mapped.
   * Called on the threads that call the library, at the same time where those do; the last call is that of the last
   * handle's destruction. After the first frame only a frame allocates that has more lights, driven materials or moving
   * parts than any before, or other shapes; with OpenGL also the first with sky patches or a surfel's own light, and
   * relume_reset. */
  relume_allocate allocate;
  relume_deallocate deallocate;
} relume_context_desc;

/* RELUME_ERROR_USAGE: another api_version than this library's, a struct_size that is too small, one of allocate and
 * deallocate without the other. Where no context comes of it, the text goes to the log. */
RELUME_API relume_status relume_context_create(const relume_context_desc* desc, relume_context** context);
RELUME_API void relume_context_destroy(relume_context* context);
/* Text of the last failure on this handle; "" before there was one. Valid until the next failure on it. */
RELUME_API const char* relume_context_error(const relume_context* context);

/* RELUME_API_VERSION of the library, and its version as "major.minor.patch". */
RELUME_API unsigned int relume_api_version(void);
RELUME_API const char* relume_version(void);
RELUME_API const char* relume_status_text(relume_status status);

/* ---- Bakes ---- */

/* Maps the file of `path` (UTF-8) and uses it in place; it must not be shortened meanwhile, and may be replaced by
 * rename. Checksums and structure are verified. */
RELUME_API relume_status relume_bake_load(relume_context* context, const char* path, relume_bake** bake);
/* Uses `size` bytes in place. They must be aligned to 8 and stay as they are until release(release_user) is called,
 * which happens once, when nothing uses them any more, or before a failing call returns; on any thread that destroys a
 * handle. release may be NULL. */
RELUME_API relume_status relume_bake_from_memory(relume_context* context, const void* bytes, size_t size,
                                                 void (*release)(void* release_user), void* release_user,
                                                 relume_bake** bake);
RELUME_API void relume_bake_destroy(relume_bake* bake);
RELUME_API const char* relume_bake_error(const relume_bake* bake);

typedef struct relume_bake_info {
  size_t struct_size; /* set by the caller */
  unsigned int surfels, nodes, caches, sky_patches, instances;
  unsigned int lightmap_width, lightmap_height; /* [texel] 0 without a light map */
  unsigned int luma_bands, chroma_bands;        /* [1..8] what the bake recommends */
  float grid_origin[3], grid_spacing[3];        /* [m] lattice of the grid */
  unsigned int grid_resolution[3];              /* [points] 0 without a grid */
  char scene_hash[17];                          /* hexadecimal: what the bake was made from */
} relume_bake_info;
RELUME_API relume_status relume_bake_get_info(const relume_bake* bake, relume_bake_info* info);

/* The instance's place on the light map: light-map coordinates of its triangles' corners, in the order of the level's
 * file (Lightmap::cornerUv), two floats in [0..1] per corner, -1 where a triangle is lit by the grid.
 * [index < instances] corner_count [out]: 3 per triangle. coordinates: NULL to ask for the count alone, else room for
 * 2 * *corner_count floats, *corner_count being what it is asked for. back_side: 1 = coordinates of back faces. */
RELUME_API relume_status relume_bake_lightmap_coordinates(const relume_bake* bake, unsigned int instance, int back_side,
                                                          float* coordinates, size_t* corner_count);
/* Name of the instance's glTF node; "" for an index that is too large. Lives as long as the bake. */
RELUME_API const char* relume_bake_instance_name(const relume_bake* bake, unsigned int instance);

/* Materials whose light a frame may replace (relume_material_emission): those that emit, and those that the level marks
 * with extras.relume.drivable. 0 of a bake of file format 3. */
RELUME_API unsigned int relume_bake_drivable_count(const relume_bake* bake);
/* Name of one; "" for an index that is too large. Lives as long as the bake. */
RELUME_API const char* relume_bake_drivable_name(const relume_bake* bake, unsigned int material);

/* Surfels, for hosts that light them themselves: the world positions [m] and unit shading normals of surfels first ..
 * first + count - 1, three floats each. Either output may be NULL. */
RELUME_API relume_status relume_bake_surfels(const relume_bake* bake, size_t first, size_t count, float* positions,
                                             float* normals);

/* Unit directions, as seen from the level, of the patches of sky that relume_light_setup.sky_patches lights: three
 * floats each. [3 * relume_bake_info.sky_patches] */
RELUME_API relume_status relume_bake_sky_directions(const relume_bake* bake, float* directions);

/* ---- Relighters ---- */

/* Address of the OpenGL function `name` ("glUseProgram") for the context that is current, NULL where there is none. */
typedef void (*relume_gl_proc)(void);
typedef relume_gl_proc (*relume_get_proc_address)(void* user, const char* name);

/* Images of one size that frames put on a drivable material. No struct_size: an array of them is handed over. */
typedef struct relume_driven_image {
  const char* material;       /* name, UTF-8; all drivable materials of that name */
  unsigned int width, height; /* [1..8192 texels] */
} relume_driven_image;

typedef struct relume_relighter_desc {
  size_t struct_size;
  relume_backend backend;
  int luma_bands;   /* [0, 1..8] 0 = what the bake recommends */
  int chroma_bands; /* [0, 1..luma_bands] 0 = what the bake recommends */
  /* RELUME_BACKEND_GL: GLSL that defines `float relumeVisibility(uint light, vec3 positionWorld, vec3 normal)`. NULL or
   * "" = nothing is in shadow. While it runs, storage blocks 0 to 7, uniform block 7, texture units 12 to 15 and image
   * units 0 to 2 are Relume's: a block at one of those bindings is RELUME_ERROR_USAGE. Names that begin with relume,
   * Relume, kRelume, RELUME or gl_ are reserved. More of both: RelightOptions::visibilityGlsl (relighter.h). */
  const char* visibility_glsl;
  /* RELUME_BACKEND_GL, which needs it: calls glfwGetProcAddress(name), eglGetProcAddress(name),
   * SDL_GL_GetProcAddress(name) or what else made the context. Called within relume_relighter_create() alone; each
   * relighter keeps the addresses that it was given, and the library links no OpenGL. */
  relume_get_proc_address get_proc_address;
  void* get_proc_address_user; /* handed to it */
  /* Materials that images are to drive, each at most once: memory for them is taken here. Read within the call. */
  const relume_driven_image* driven_images;
  size_t driven_image_count;
  int glossy; /* 1 = the light map keeps the bands that relume_glossy_on_lightmap() alone reads; 0 = it does not */
  int grid_texture; /* 1 = keep the grid as a texture of irradiance vectors for the look-ups of relume_grid_lookup */
  /* [0..1] how much a cell's weights may differ from those of the caches around for the texture to be read there
   * (relighter.h); 0 = the default, 0.35 */
  float grid_trust;
  unsigned int grid_texture_bytes; /* of the texture, 72 a point; 0 = the default, 4 MiB */
  unsigned int moving_parts;       /* [0..256] most of relume_light_setup.moving_parts in a frame; 0 = none */
  /* [1, 2, 4 .. 64] frames within which each cache near moving parts is looked at again, 1 = all in every frame
   * (relighter.h); 0 = the default, 32 */
  unsigned int moving_lag;
} relume_relighter_desc;

/* desc: NULL = defaults. With RELUME_BACKEND_GL an OpenGL 4.3 core context must be current, here and in every call.
 * RELUME_ERROR_USAGE: no get_proc_address with RELUME_BACKEND_GL; RELUME_ERROR_UNSUPPORTED: no OpenGL 4.3, or one of
 * its functions is NULL, which the text names. */
RELUME_API relume_status relume_relighter_create(relume_bake* bake, const relume_relighter_desc* desc,
                                                 relume_relighter** relighter);
RELUME_API void relume_relighter_destroy(relume_relighter* relighter);
RELUME_API const char* relume_relighter_error(const relume_relighter* relighter);

/* A punctual light as KHR_lights_punctual defines it. No struct_size: an array of them is handed over. */
typedef struct relume_light {
  relume_light_kind kind;
  float intensity[3];       /* [0..1e20] point, spot: [W/sr]; directional: [W/m^2]. How much of it backends can show:
                               relume_backend */
  float position[3];        /* [m] world */
  float direction[3];       /* the way the light travels, of length 1 (within 1 %); directional, spot */
  float range;              /* [m] 0 = no limit */
  float inner_cone_radians; /* [0..outer] spot */
  float outer_cone_radians; /* [0..pi] spot */
} relume_light;

/* Shares [0..1] of a light that reach `count` points with unit normals: the host's shadows. Write all of visible; it is
 * 0 at first. At most 256 points a call, all facing the light; positions and normals are three floats each. */
typedef void (*relume_visibility)(void* user, unsigned int light, unsigned int count, const float* positions,
                                  const float* normals, float* visible);

/* This frame's light of one drivable material, in place of what the level gave it: a colour, or an image where its
 * emissive texture is. It lights receivers alone: the host draws the emitter itself. emission_scale does not scale it.
 * No struct_size: an array of them is handed over. */
typedef struct relume_material_emission {
  unsigned int material; /* [0..drivable_count - 1] */
  float radiance[3];     /* [W/m^2/sr] [0..1e9] of the whole; with an image, a factor on it */
  /* [W/m^2/sr] [0..1e9] NULL, or [3 * texel_count] linear red, green, blue, row 0 (v = 0, glTF's top one) first. */
  const float* image;
  size_t texel_count; /* width * height as declared in relume_relighter_desc */
  unsigned int
      texture; /* RELUME_BACKEND_GL: in place of image, a GL_TEXTURE_2D of that size with its mip levels; or 0 */
} relume_material_emission;

/* What moves through a baked level and takes part in its indirect light (relume/moving_shapes.h): it shadows the light
 * that surfaces send to each other, and reflects what falls on it. Rigid meshes become shapes once; each frame says
 * which of them stand where. No struct_size: an array of them is handed over. */
typedef struct relume_moving_mesh {
  const float* positions; /* [m] within 1e8: three floats a vertex, in the mesh's own axes */
  size_t position_count;
  const unsigned int* triangles; /* three vertices each; the front is counter-clockwise */
  size_t triangle_count;         /* [at least 1] */
  const float* albedo;           /* [0..1] three floats each */
  size_t albedo_count;           /* [1 or triangle_count] */
  const float* emission;         /* [W/m^2/sr] [0..1e9] of the fronts, three floats each; NULL = none */
  size_t emission_count;         /* [0, 1 or triangle_count] */
} relume_moving_mesh;

/* A shape as it stands in a frame. No struct_size: an array of them is handed over. */
typedef struct relume_moving_part {
  unsigned int shape; /* index into the meshes of relume_moving_shapes_create() */
  /* Columns x, y, z, then the translation; numbers within 1e8. May mirror; one that flattens the shape hides the part.
   */
  float to_world[12];
} relume_moving_part;

/* Meshes are read within the call. The text is the context's. Shapes may serve any number of relighters, on any threads
 * at once, and must live until the last relume_relight() that names them has returned. What they take is taken by the
 * global operator new.
 * RELUME_ERROR_USAGE: a null array with a count, no triangles, an index out of range, a count of colours that does not
 * fit, a number that is not finite or out of its range: the text names mesh, vertex or triangle. */
RELUME_API relume_status relume_moving_shapes_create(relume_context* context, const relume_moving_mesh* meshes,
                                                     size_t mesh_count, relume_moving_shapes** shapes);
RELUME_API void relume_moving_shapes_destroy(relume_moving_shapes* shapes);

typedef struct relume_light_setup {
  size_t struct_size;
  const relume_light* lights;
  size_t light_count;
  relume_visibility visibility; /* CPU backend; NULL = nothing is in shadow */
  void* visibility_user;
  /* The host's own direct light in place of the lights: irradiance [W/m^2] of each surfel, three floats each.
   * NULL or [3 * surfels] */
  const float* surfel_irradiance;
  const float* surfel_emission; /* [W/m^2/sr] NULL or [3 * surfels] in place of the baked emission */
  const float* sky_patches;     /* [W/m^2/sr] NULL or [3 * sky_patches] radiance of each, in place of the constant */
  float sky_radiance[3];        /* [W/m^2/sr] a constant sky */
  float emission_scale[3];      /* factor on the emission baked and of moving_parts; relume_light_setup_default(): 1 */
  float bounce_scale;           /* [0..1] share of last frame's light; relume_light_setup_default() sets 1 */
  /* Materials whose light is not the baked one, each at most once. Not together with surfel_emission. */
  const relume_material_emission* material_emissions;
  size_t material_emission_count;
  /* What stands where in this frame, at most relume_relighter_desc.moving_parts of them. They are lit by `lights`, with
   * `visibility` (CPU) or visibility_glsl (OpenGL), and by last frame's grid. */
  const relume_moving_part* moving_parts;
  size_t moving_part_count;
  const relume_moving_shapes* moving_shapes; /* what moving_parts name; may be NULL where there are none */
} relume_light_setup;

/* Zeros but for struct_size, emission_scale and bounce_scale. Use it: zeros would switch emitters and bounces off.
 * struct_size: sizeof *setup; as many bytes are written, whatever header the library was built with. */
RELUME_API void relume_light_setup_default(relume_light_setup* setup, size_t struct_size);

/* One frame. A setup that is refused is not applied: last frame's light stays. */
RELUME_API relume_status relume_relight(relume_relighter* relighter, const relume_light_setup* setup);
/* Forget last frame's light. */
RELUME_API relume_status relume_reset(relume_relighter* relighter);

/* Hot reload: begin with the light of `previous`, a relighter of an older bake of the level, so that the first frame is
 * not without its bounces. `bake` is the one that `relighter` was made from. Takes effect in the next relume_relight().
 */
RELUME_API relume_status relume_inherit(relume_relighter* relighter, const relume_bake* bake,
                                        const relume_relighter* previous);

/* ---- Light ---- */

/* Irradiance [W/m^2] at `count` receivers, three floats each. uvs: two floats each, from the light-map coordinates.
 * geometric_normals: of the receivers' planes, where normals are interpolated or mapped; NULL = normals. positions may
 * be anywhere: one outside of the grid's box reads the points around the nearest place in it; how much of each is seen,
 * and which way it lies, counts from the position itself. */
RELUME_API relume_status relume_irradiance_on_lightmap(const relume_relighter* relighter, size_t count,
                                                       const float* uvs, const float* normals,
                                                       const float* geometric_normals, float* irradiance);
RELUME_API relume_status relume_irradiance_in_grid(const relume_relighter* relighter, size_t count,
                                                   const float* positions, const float* normals, float* irradiance);

/* How the grid is read. Without relume_relighter_desc.grid_texture, and in cells that may not be read, all three read
 * the caches around. */
typedef enum relume_grid_lookup {
  RELUME_GRID_STENCIL = 0, /* the caches around the receiver, each by how much of it is seen */
  RELUME_GRID_TEXTURE = 1, /* the texture, trilinear */
  RELUME_GRID_SMOOTH = 2   /* the texture by a cubic B-spline */
} relume_grid_lookup;
RELUME_API relume_status relume_irradiance_in_grid_by(const relume_relighter* relighter, relume_grid_lookup lookup,
                                                      size_t count, const float* positions, const float* normals,
                                                      float* irradiance);

typedef struct relume_grid_texture_info {
  size_t struct_size;             /* set by the caller */
  unsigned int resolution[3];     /* [points] 0 = there is no texture */
  float origin[3], spacing[3];    /* [m] */
  unsigned int cells, open_cells; /* open: may be read */
} relume_grid_texture_info;
RELUME_API relume_status relume_grid_texture_get_info(const relume_relighter* relighter,
                                                      relume_grid_texture_info* info);

/* Glossy light: mean radiance [W/m^2/sr] in lobes cos^exponent about unit directions, three floats each: the viewing
 * rays mirrored by the shading normals, away from the surfaces. Multiply by specular reflectance. Exponents, one per
 * receiver, are clamped to 0..10000. As sharp as the bands are: see relume_relighter_desc.glossy. */
RELUME_API relume_status relume_glossy_on_lightmap(const relume_relighter* relighter, size_t count, const float* uvs,
                                                   const float* reflected, const float* exponents, float* radiance);
RELUME_API relume_status relume_glossy_in_grid(const relume_relighter* relighter, size_t count, const float* positions,
                                               const float* normals, const float* reflected, const float* exponents,
                                               float* radiance);

/* Plain results: textures and volumes for shaders that know nothing of caches. `bytes` is the size of the output and
 * must be exact.
 *   relume_irradiance_map      RGBA16F, lightmap_width * lightmap_height texels of 8 bytes: irradiance for each texel's
 *                              own normal; a = 1 where there is light. Filters read across walls, which
 *                              relume_irradiance_on_lightmap() does not
 *   relume_irradiance_map_l1   four layers of those: E(n) = max(layer 0 + n.x layer 1 + n.y layer 2 + n.z layer 3, 0)
 *   relume_ambient_volume      6 * 3 floats per point, x fastest: irradiance for +x, -x, +y, -y, +z, -z
 *   relume_cache_coefficients  floats: coefficients_per_cache per cache; see relighter.h */
RELUME_API relume_status relume_irradiance_map(const relume_relighter* relighter, void* rgba16f, size_t bytes);
RELUME_API relume_status relume_irradiance_map_l1(const relume_relighter* relighter, void* rgba16f, size_t bytes);
RELUME_API relume_status relume_ambient_volume(const relume_relighter* relighter, const float origin[3],
                                               const float spacing[3], const unsigned int resolution[3], float* cubes,
                                               size_t bytes);
RELUME_API unsigned int relume_coefficients_per_cache(const relume_relighter* relighter);
RELUME_API relume_status relume_cache_coefficients(const relume_relighter* relighter, float* coefficients,
                                                   size_t bytes);

/* ---- Textures and plain uniforms to resolve with in any graphics API: relume/texture_resolve.h says what they hold
 * ---- Make relume_resolve_texture_count() textures once; after each relume_relight() write those that are light. */

typedef enum relume_texture_shape {
  RELUME_TEXTURE_FLAT = 0,
  RELUME_TEXTURE_ARRAY = 1,
  RELUME_TEXTURE_VOLUME = 2
} relume_texture_shape;

typedef enum relume_texel_format {
  RELUME_TEXEL_RGBA16F = 0,
  RELUME_TEXEL_RG16F = 1,
  RELUME_TEXEL_RGBA8 = 2,
  RELUME_TEXEL_R8 = 3
} relume_texel_format;

typedef struct relume_resolve_texture {
  size_t struct_size;  /* set by the caller */
  const char* sampler; /* its uniform in the GLSL; lives as long as the library */
  relume_texture_shape shape;
  relume_texel_format format;
  unsigned int width, height, depth; /* [texel] depth: layers of an array */
  int filtered;                      /* linear; else nearest; clamped to the edge either way */
  int light;                         /* written anew after each relume_relight(); else once */
  size_t bytes;                      /* of its texels, without padding */
} relume_resolve_texture;

RELUME_API relume_status relume_resolve_texture_count(const relume_relighter* relighter, unsigned int* count);
RELUME_API relume_status relume_resolve_texture_get_info(const relume_relighter* relighter, unsigned int texture,
                                                         relume_resolve_texture* info);
/* bytes: of `texels`, exactly those of the texture. */
RELUME_API relume_status relume_resolve_texture_write(const relume_relighter* relighter, unsigned int texture,
                                                      void* texels, size_t bytes);
/* uniform vec4 relumeGrid[6] of that GLSL. They do not change. */
RELUME_API relume_status relume_resolve_uniforms(const relume_relighter* relighter, float grid[24]);
/* GLSL for after #version, 3.30 and ES 3.00 at least, and its length without the closing 0. Writes what fits into
 * `bytes`, always with that 0; `text` may be NULL with 0 bytes, to ask for the length. */
RELUME_API relume_status relume_resolve_glsl(const relume_relighter* relighter, char* text, size_t bytes,
                                             size_t* length);

/* ---- OpenGL: RELUME_BACKEND_GL only, else RELUME_ERROR_USAGE ---- */

/* GLSL 4.30 for the host's shader, after #version (relighter.h, GlResolve). Lives as long as the relighter; NULL on the
 * CPU. */
RELUME_API const char* relume_gl_resolve_glsl(const relume_relighter* relighter);
/* Bind all inputs of that GLSL. Leaves them bound. */
RELUME_API relume_status relume_gl_bind_resolve(const relume_relighter* relighter);
/* Name of the program that lights the surfels, for the shadow uniforms of visibility_glsl; 0 on the CPU. */
RELUME_API unsigned int relume_gl_surfel_program(const relume_relighter* relighter);
/* The same of the program that lights moving parts, whose uniforms are its own; 0 without moving_parts as well. */
RELUME_API unsigned int relume_gl_moving_program(const relume_relighter* relighter);

#ifdef __cplusplus
}
#endif

/* Light without a bake, and edits of a level with one. */
#include "relume/relume_live.h"

#endif
