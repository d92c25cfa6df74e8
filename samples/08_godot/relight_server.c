/* SPDX-License-Identifier: MIT */
/*
 * Relights for a program that can link nothing: Godot's scripts, and whatever else speaks TCP. One client, on this
 * machine alone.
 *
 *   relight_server LEVEL.relume       prints the port that it listens on, serves the first to connect, and ends with it
 *
 * All numbers are little-endian, of 32 bits.
 *   it sends once    the level's hash as 16 letters; width and height of the light map; count of surfels;
 *                    for each surfel position and normal, six floats
 *   it gets a frame  count of receivers; for each surfel irradiance by direct light, four floats; for each receiver
 *                    position and normal, six floats
 *   it answers       the light map, RGBA16F; for each receiver irradiance, four floats
 */
#include <relume/relume.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

enum { kMaxReceivers = 1 << 20 };

/* 1: all of it came or went; 0: the client is gone. */
static int receiveAll(int client, void* bytes, size_t size) {
  char* at = bytes;
  while (size > 0) {
    const ssize_t got = recv(client, at, size, 0);
    if (got <= 0) return 0;
    at += got;
    size -= (size_t)got;
  }
  return 1;
}

static int sendAll(int client, const void* bytes, size_t size) {
  const char* at = bytes;
  while (size > 0) {
    const ssize_t sent = send(client, at, size, MSG_NOSIGNAL);
    if (sent <= 0) return 0;
    at += sent;
    size -= (size_t)sent;
  }
  return 1;
}

/* A socket on a free port of this machine, the port printed; -1 where there is none. */
static int acceptClient(void) {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);
  struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
  socklen_t length = sizeof address;
  const int one = 1;
  if (listener < 0 || bind(listener, (struct sockaddr*)&address, length) != 0 || listen(listener, 1) != 0 ||
      getsockname(listener, (struct sockaddr*)&address, &length) != 0)
    return -1;
  printf("%d\n", ntohs(address.sin_port));
  fflush(stdout);
  const int client = accept(listener, NULL, NULL);
  close(listener);
  if (client >= 0) setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
  return client;
}

static int fail(relume_status status, const char* text) {
  fprintf(stderr, "relight_server: %s\n", text);
  return status == RELUME_ERROR_MEMORY ? RELUME_ERROR_FAILED : (int)status;
}

/* What is kept from frame to frame; three or four floats each. */
typedef struct {
  uint32_t receivers;
  float *texels, *surfels;                             /* as Godot has them: four, the last one unused */
  float *places, *positions, *normals, *light, *reply; /* of the receivers */
  void* map;
  size_t mapBytes;
} Frames;

static int makeRoom(Frames* f, uint32_t receivers) {
  if (receivers <= f->receivers) return 1;
  f->places = realloc(f->places, receivers * 6 * sizeof(float));
  f->positions = realloc(f->positions, receivers * 3 * sizeof(float));
  f->normals = realloc(f->normals, receivers * 3 * sizeof(float));
  f->light = realloc(f->light, receivers * 3 * sizeof(float));
  f->reply = realloc(f->reply, receivers * 4 * sizeof(float));
  f->receivers = receivers;
  return f->places && f->positions && f->normals && f->light && f->reply;
}

/* What Godot is told of a bake, and room for what it answers. */
static relume_status sendBake(int client, const relume_bake* bake, const relume_bake_info* info, Frames* f) {
  const uint32_t sizes[3] = {info->lightmap_width, info->lightmap_height, info->surfels};
  const size_t surfels = info->surfels;
  float* const both = malloc((surfels + 1) * 12 * sizeof(float));
  f->texels = malloc((surfels + 1) * 4 * sizeof(float));
  f->surfels = malloc((surfels + 1) * 3 * sizeof(float));
  f->mapBytes = (size_t)8 * sizes[0] * sizes[1];
  f->map = malloc(f->mapBytes + 1);
  relume_status status = both && f->texels && f->surfels && f->map ? RELUME_OK : RELUME_ERROR_MEMORY;
  if (status == RELUME_OK) {
    float* const positions = both + 6 * surfels;
    float* const normals = positions + 3 * surfels;
    status = relume_bake_surfels(bake, 0, info->surfels, positions, normals);
    for (size_t i = 0; i < surfels && status == RELUME_OK; ++i) {
      for (size_t c = 0; c < 3; ++c) {
        both[6 * i + c] = positions[3 * i + c];
        both[6 * i + 3 + c] = normals[3 * i + c];
      }
    }
  }
  /* A client that is gone is seen where the next frame would be received. */
  if (status == RELUME_OK && sendAll(client, info->scene_hash, 16) && sendAll(client, sizes, sizeof sizes))
    sendAll(client, both, 6 * surfels * sizeof(float));
  free(both);
  return status;
}

/* Until the client is gone. */
static int serve(int client, const relume_bake_info* info, relume_relighter* relighter, Frames* f) {
  relume_light_setup setup;
  relume_light_setup_default(&setup, sizeof setup);
  uint32_t count = 0;
  while (receiveAll(client, &count, sizeof count)) {
    if (count > kMaxReceivers) return fail(RELUME_ERROR_USAGE, "more than a million receivers: not a client of ours");
    if (!makeRoom(f, count)) return fail(RELUME_ERROR_MEMORY, "out of memory");
    if (!receiveAll(client, f->texels, (size_t)4 * info->surfels * sizeof(float)) ||
        !receiveAll(client, f->places, (size_t)6 * count * sizeof(float)))
      break;
    for (size_t i = 0; i < info->surfels; ++i) {
      for (size_t c = 0; c < 3; ++c) f->surfels[3 * i + c] = f->texels[4 * i + c];
    }
    for (size_t i = 0; i < count; ++i) {
      for (size_t c = 0; c < 3; ++c) {
        f->positions[3 * i + c] = f->places[6 * i + c];
        f->normals[3 * i + c] = f->places[6 * i + 3 + c];
      }
    }
    setup.surfel_irradiance = f->surfels;
    relume_status status = relume_relight(relighter, &setup);
    if (status == RELUME_OK) status = relume_irradiance_map(relighter, f->map, f->mapBytes);
    if (status == RELUME_OK) status = relume_irradiance_in_grid(relighter, count, f->positions, f->normals, f->light);
    if (status != RELUME_OK) return fail(status, relume_relighter_error(relighter));
    for (size_t i = 0; i < count; ++i) {
      for (size_t c = 0; c < 3; ++c) f->reply[4 * i + c] = f->light[3 * i + c];
      f->reply[4 * i + 3] = 1.0f;
    }
    if (!sendAll(client, f->map, f->mapBytes) || !sendAll(client, f->reply, (size_t)4 * count * sizeof(float))) break;
  }
  return 0;
}

int main(int argc, char** argv) {
  if (argc != 2) {
    fprintf(stderr, "usage: relight_server LEVEL.relume\n");
    return RELUME_ERROR_USAGE;
  }
  relume_context_desc desc = {.struct_size = sizeof desc, .api_version = RELUME_API_VERSION};
  relume_context* context = NULL;
  relume_bake* bake = NULL;
  relume_relighter* relighter = NULL;
  relume_bake_info info = {.struct_size = sizeof info};
  relume_status status = relume_context_create(&desc, &context);
  if (status != RELUME_OK) return fail(status, relume_status_text(status));
  if ((status = relume_bake_load(context, argv[1], &bake)) != RELUME_OK)
    return fail(status, relume_context_error(context));
  if ((status = relume_relighter_create(bake, NULL, &relighter)) != RELUME_OK ||
      (status = relume_bake_get_info(bake, &info)) != RELUME_OK)
    return fail(status, relume_bake_error(bake));
  if (info.grid_resolution[0] == 0)
    fprintf(stderr,
            "relight_server: %s: no grid, so that what moves gets no indirect light: bake without --grid-caches 0\n",
            argv[1]);

  const int client = acceptClient();
  if (client < 0) return fail(RELUME_ERROR_UNSUPPORTED, "no port to listen on");
  Frames frames = {0};
  status = sendBake(client, bake, &info, &frames);
  const int code =
      status == RELUME_OK ? serve(client, &info, relighter, &frames) : fail(status, relume_status_text(status));
  close(client);
  relume_relighter_destroy(relighter);
  relume_bake_destroy(bake);
  relume_context_destroy(context);
  return code;
}
