/* SPDX-License-Identifier: MIT */
/* 01_hello_relight in C: load a bake, relight it under a moving lamp and a sun, ask what light arrives at a point; in
 * memory of the game's own.
 *   cc hello_relight.c $(pkg-config --cflags --libs relume) -lm
 *   hello_relight LEVEL.relume */
#include <relume/relume.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* The game's memory: a block from malloc(), the pointer to it, and behind that what was asked for, aligned. */
typedef struct Memory {
  size_t bytes, most;
} Memory;

static void* allocate(void* user, size_t size, size_t alignment) {
  Memory* memory = (Memory*)user;
  size_t at;
  char* block;
  if (alignment < sizeof(void*)) alignment = sizeof(void*);
  block = (char*)malloc(size + alignment + sizeof(void*));
  if (block == NULL) return NULL;
  at = ((size_t)block + sizeof(void*) + alignment - 1) / alignment * alignment;
  ((void**)at)[-1] = block;
  memory->bytes += size;
  if (memory->bytes > memory->most) memory->most = memory->bytes;
  return (void*)at;
}

static void deallocate(void* user, void* at, size_t size, size_t alignment) {
  (void)alignment;
  ((Memory*)user)->bytes -= size;
  free(((void**)at)[-1]);
}

/* Half a metre over the floor that is nearest to the middle of what the bake lights, which itself may lie in a wall. */
static int over_the_floor(const relume_bake* bake, unsigned int surfels, float point[3]) {
  float *positions, *normals, middle[3] = {0.0f, 0.0f, 0.0f};
  double nearest = 1e30;
  unsigned int i, k;
  positions = (float*)malloc(6 * sizeof(float) * surfels);
  if (positions == NULL) return 0;
  normals = positions + 3 * surfels;
  if (relume_bake_surfels(bake, 0, surfels, positions, normals) != RELUME_OK) {
    free(positions);
    return 0;
  }
  for (i = 0; i < surfels; ++i) {
    for (k = 0; k < 3; ++k) middle[k] += positions[3 * i + k] / (float)surfels;
  }
  for (k = 0; k < 3; ++k) point[k] = middle[k];
  for (i = 0; i < surfels; ++i) {
    const float* p = positions + 3 * i;
    double distance = 0.0;
    for (k = 0; k < 3; ++k) distance += (p[k] - middle[k]) * (p[k] - middle[k]);
    if (normals[3 * i + 1] < 0.7f || distance >= nearest) continue;
    nearest = distance;
    for (k = 0; k < 3; ++k) point[k] = p[k] + (k == 1 ? 0.5f : 0.0f);
  }
  free(positions);
  return 1;
}

/* 16 frames of light; the status that ended them. */
static relume_status run(relume_relighter* relighter, const float point[3]) {
  const float up[3] = {0.0f, 1.0f, 0.0f}, sun_way[3] = {0.28f, -0.75f, 0.6f};
  const float length = (float)sqrt(sun_way[0] * sun_way[0] + sun_way[1] * sun_way[1] + sun_way[2] * sun_way[2]);
  relume_light lights[2] = {{RELUME_DIRECTIONAL}, {RELUME_POINT}};
  relume_light_setup setup;
  int frame, k;
  lights[0].intensity[0] = 9.0f; /* [W/m^2] */
  lights[0].intensity[1] = 8.5f;
  lights[0].intensity[2] = 7.5f;
  for (k = 0; k < 3; ++k) lights[0].direction[k] = sun_way[k] / length;
  lights[1].intensity[0] = 4.0f; /* [W/sr] */
  lights[1].intensity[1] = 3.0f;
  lights[1].intensity[2] = 2.0f;
  relume_light_setup_default(&setup, sizeof setup);
  setup.lights = lights;
  setup.light_count = 2;
  for (frame = 0; frame < 16; ++frame) {
    const double angle = 0.4 * frame;
    float light[3];
    relume_status status;
    lights[1].position[0] = point[0] + (float)cos(angle);
    lights[1].position[1] = point[1] + 0.5f;
    lights[1].position[2] = point[2] + (float)sin(angle);
    status = relume_relight(relighter, &setup);
    if (status == RELUME_OK) status = relume_irradiance_in_grid(relighter, 1, point, up, light);
    if (status != RELUME_OK) return status;
    printf("frame %2d: irradiance at (%.2f %.2f %.2f) facing up: %.4f %.4f %.4f W/m2\n", frame, point[0], point[1],
           point[2], light[0], light[1], light[2]);
  }
  return RELUME_OK;
}

int main(int argc, char** argv) {
  Memory memory = {0, 0};
  relume_context_desc desc = {0};
  relume_bake_info info = {0};
  relume_context* context = NULL;
  relume_bake* bake = NULL;
  relume_relighter* relighter = NULL;
  float point[3];
  relume_status status;
  if (argc != 2) {
    fprintf(stderr, "usage: hello_relight LEVEL.relume\n");
    return 1;
  }
  info.struct_size = sizeof info;
  desc.struct_size = sizeof desc;
  desc.api_version = RELUME_API_VERSION;
  desc.user = &memory;
  desc.allocate = allocate; /* on one thread, as here, they need no lock */
  desc.deallocate = deallocate;
  status = relume_context_create(&desc, &context);
  if (status != RELUME_OK) {
    fprintf(stderr, "%s\n", relume_status_text(status));
    return (int)status;
  }
  status = relume_bake_load(context, argv[1], &bake);
  if (status != RELUME_OK) {
    fprintf(stderr, "%s\n", relume_context_error(context));
  } else if ((status = relume_bake_get_info(bake, &info)) != RELUME_OK ||
             (status = relume_relighter_create(bake, NULL, &relighter)) != RELUME_OK) {
    fprintf(stderr, "%s\n", relume_bake_error(bake));
  } else if (info.grid_resolution[0] == 0) {
    status = RELUME_ERROR_USAGE;
    fprintf(stderr, "%s: no grid to read light in the air from: bake without --grid-caches 0\n", argv[1]);
  } else if (!over_the_floor(bake, info.surfels, point)) {
    status = RELUME_ERROR_MEMORY;
    fprintf(stderr, "%s\n", relume_status_text(status));
  } else if ((status = run(relighter, point)) != RELUME_OK) {
    fprintf(stderr, "%s\n", relume_relighter_error(relighter));
  }
  relume_relighter_destroy(relighter);
  relume_bake_destroy(bake);
  relume_context_destroy(context);
  printf("memory: %lu KiB at most, %lu bytes left\n", (unsigned long)(memory.most / 1024), (unsigned long)memory.bytes);
  return (int)status;
}
