/* SPDX-License-Identifier: MIT */
/*
 * A game that lights its level in OpenGL and links no OpenGL but EGL, which gives the runtime its functions: the light
 * must be the CPU's. Exit status 0: it is; 5: there is no OpenGL 4.3 without a window here; else a failure.
 */
#include <relume/relume.h>

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A current OpenGL 4.3 context without a window; 0 when there is none. */
static int make_context(void) {
  static const EGLint wanted[] = {
      EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context;
  if (extensions != NULL && strstr(extensions, "EGL_MESA_platform_surfaceless") != NULL)
    display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
  if (display == EGL_NO_DISPLAY || !eglInitialize(display, NULL, NULL) || !eglBindAPI(EGL_OPENGL_API)) return 0;
  context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, wanted);
  return context != EGL_NO_CONTEXT && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context);
}

static relume_gl_proc get_proc_address(void* user, const char* name) {
  (void)user;
  return eglGetProcAddress(name);
}

/* Irradiance at a surfel of the bake after three frames under a sun. */
static relume_status light(relume_bake* bake, relume_backend backend, const float normal[3], const float point[3],
                           float irradiance[3]) {
  relume_relighter_desc desc = {0};
  relume_relighter* relighter = NULL;
  relume_light sun = {RELUME_DIRECTIONAL, {9.0f, 8.5f, 7.5f}, {0}, {0.28f, -0.75f, 0.6f}, 0, 0, 0};
  relume_light_setup setup;
  relume_status status;
  int frame;
  desc.struct_size = sizeof desc;
  desc.backend = backend;
  desc.get_proc_address = get_proc_address;
  status = relume_relighter_create(bake, &desc, &relighter);
  if (status != RELUME_OK) {
    fprintf(stderr, "%s\n", relume_bake_error(bake));
    return status;
  }
  relume_light_setup_default(&setup, sizeof setup);
  setup.lights = &sun;
  setup.light_count = 1;
  for (frame = 0; frame < 3 && status == RELUME_OK; ++frame) status = relume_relight(relighter, &setup);
  if (status == RELUME_OK) status = relume_irradiance_in_grid(relighter, 1, point, normal, irradiance);
  if (status != RELUME_OK) fprintf(stderr, "%s\n", relume_relighter_error(relighter));
  relume_relighter_destroy(relighter);
  return status;
}

int main(int argc, char** argv) {
  relume_context_desc desc = {0};
  relume_context* context = NULL;
  relume_bake* bake = NULL;
  float point[3], normal[3], cpu[3], gl[3];
  int k;
  if (argc != 2) return 1;
  if (!make_context()) {
    fprintf(stderr, "no OpenGL 4.3 without a window\n");
    return RELUME_ERROR_UNSUPPORTED;
  }
  desc.struct_size = sizeof desc;
  desc.api_version = RELUME_API_VERSION;
  if (relume_context_create(&desc, &context) != RELUME_OK || relume_bake_load(context, argv[1], &bake) != RELUME_OK ||
      relume_bake_surfels(bake, 0, 1, point, normal) != RELUME_OK)
    return RELUME_ERROR_FAILED;
  for (k = 0; k < 3; ++k) point[k] += 0.05f * normal[k];
  if (light(bake, RELUME_BACKEND_CPU, normal, point, cpu) != RELUME_OK ||
      light(bake, RELUME_BACKEND_GL, normal, point, gl) != RELUME_OK)
    return RELUME_ERROR_FAILED;
  for (k = 0; k < 3; ++k) {
    printf("%.4f on the CPU, %.4f in OpenGL\n", cpu[k], gl[k]);
    if (!(cpu[k] > 0.0f) || !(fabs(cpu[k] - gl[k]) <= 0.02 * cpu[k])) return RELUME_ERROR_FAILED;
  }
  relume_bake_destroy(bake);
  relume_context_destroy(context);
  return 0;
}
