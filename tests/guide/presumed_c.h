/* SPDX-License-Identifier: MIT */
/* What excerpts in C presume that a game has, as presumed.h does for those in C++. */

/* context */
static relume_context* context;

/* bake */
static relume_bake* bake;

/* relighter */
static relume_relighter* relighter;

/* setup */
static relume_light_setup setup;

/* lights count */
static relume_light* lights;
static size_t count;

/* texels width height */
static unsigned short* texels;
static size_t width, height;

/* glfwGetProcAddress */
relume_gl_proc glfwGetProcAddress(const char* name);

/* positions position_count triangles triangle_count brown */
static float *positions, *brown;
static unsigned int* triangles;
static size_t position_count, triangle_count;

/* boxes longest_side */
static relume_edit_box boxes[2];
static float longest_side;

/* blend live_before live_after */
static relume_edit_blend* blend;
static relume_live *live_before, *live_after;

/* shares uvs normals before after irradiance */
static float *shares, *uvs, *normals, *before, *after, *irradiance;

/* heap heap_allocate heap_deallocate */
static int heap;
void* heap_allocate(void* user, size_t size, size_t alignment);
void heap_deallocate(void* user, void* memory, size_t size, size_t alignment);
