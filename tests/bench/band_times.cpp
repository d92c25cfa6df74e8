// SPDX-License-Identifier: MIT
// PIC Table 3: milliseconds of cache lighting and resolve for every pair of luma and chroma bands, least of some
// frames, on one CPU thread and in OpenGL, beside the paper's. Prints a table of docs/notes/bands.md.
//   bench_band_times BAKE.relume [frames [receivers]]
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "runtime/shared/bands.h"
#include "tools/gl_scene/egl_context.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace relume {
namespace {

// PIC Table 3, GTX 980: rows chroma 2..8, columns luma 2..8.
constexpr double kPaper[7][7] = {{2.48, 2.69, 2.95, 3.59, 3.78, 4.50, 5.35},
                                 {0, 3.21, 3.41, 4.01, 4.07, 5.22, 5.83},
                                 {0, 0, 3.33, 4.14, 4.39, 5.35, 6.31},
                                 {0, 0, 0, 4.69, 5.67, 6.26, 6.78},
                                 {0, 0, 0, 0, 5.95, 6.94, 7.80},
                                 {0, 0, 0, 0, 0, 7.61, 11.89},
                                 {0, 0, 0, 0, 0, 0, 10.35}};

// A point of the light map and a normal 35 degrees off its cache's: both forms of the lobe would be needed nowhere, all
// bands everywhere.
struct Receiver {
  glm::vec2 uv;
  glm::vec3 normal;
};

std::vector<Receiver> makeReceivers(const Caches& caches, std::size_t count) {
  const Lightmap& map = caches.lightmap;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  std::vector<std::uint32_t> filled;
  for (std::uint32_t t = 0; t < map.cache.size(); ++t) {
    if (map.cache[t] != kNoCache) filled.push_back(t);
  }
  std::vector<Receiver> receivers;
  while (!filled.empty() && receivers.size() < count) {
    const std::uint32_t t = filled[receivers.size() * filled.size() / count];
    const glm::vec3 m = caches.normal[map.cache[t]];
    const glm::vec3 side =
        glm::normalize(glm::cross(m, std::abs(m.x) < 0.5f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0)));
    receivers.push_back({{(static_cast<float>(t % map.width) + uniform(random)) / static_cast<float>(map.width),
                          (static_cast<float>(t / map.width) + uniform(random)) / static_cast<float>(map.height)},
                         glm::normalize(m + 0.7f * side)});
  }
  return receivers;
}

LightSetup someLight(std::array<Light, 1>& lights) {
  lights[0].kind = LightKind::directional;
  LightSetup setup;
  setup.lights = lights;
  return setup;
}

double passMs(const Relighter& relighter, const std::string& pass) {
  for (const PassTime& each : relighter.passTimes()) {
    if (pass == each.pass) return each.ms;
  }
  return 0.0;
}

struct Times {
  double caches = 1e9, resolve = 1e9;
};

Result<Times> measureCpu(const Bake& bake, const Bands& bands, const std::vector<Receiver>& receivers, int frames) {
  RelightOptions options;
  options.lumaBands = bands.luma;
  options.chromaBands = bands.chroma;
  Result<Relighter> relighter = Relighter::create(bake, options);
  if (!relighter) return relighter.error();
  std::array<Light, 1> lights;
  const LightSetup setup = someLight(lights);
  Times times;
  glm::vec3 sum(0.0f);
  for (int frame = 0; frame < frames; ++frame) {
    if (Status ok = relighter->relight(setup); !ok) return ok.error();
    times.caches = std::min(times.caches, passMs(*relighter, "caches"));
    const auto begin = std::chrono::steady_clock::now();
    for (const Receiver& r : receivers) sum += relighter->irradianceOnLightmap(r.uv, r.normal);
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    times.resolve = std::min(times.resolve, ms);
  }
  if (!(sum.x >= 0.0f)) return Error{ErrorCode::failed, "light that is no number"};
  return times;
}

constexpr const char* kMain = R"(
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer In { vec4 receiver[]; };
layout(std430, binding = 1) writeonly buffer Out { vec4 found[]; };
uniform uint count;
void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= count) return;
  vec4 a = receiver[2u * i], b = receiver[2u * i + 1u];
  found[i] = vec4(relumeIrradianceLightmap(a.xy, b.xyz), 1.0);
}
)";

Result<GLuint> resolveProgram(const Relighter& relighter) {
  const std::string text = "#version 430\n" + relighter.gl()->glsl() + kMain;
  const char* source = text.c_str();
  const GLuint program = glCreateShaderProgramv(GL_COMPUTE_SHADER, 1, &source);
  GLint linked = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  if (!linked) return Error{ErrorCode::failed, "the resolve shader does not link"};
  return program;
}

Result<Times> measureGl(const Bake& bake, const Bands& bands, const std::vector<Receiver>& receivers, int frames) {
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  options.lumaBands = bands.luma;
  options.chromaBands = bands.chroma;
  Result<Relighter> relighter = Relighter::create(bake, options);
  if (!relighter) return relighter.error();
  const Result<GLuint> program = resolveProgram(*relighter);
  if (!program) return program.error();
  std::vector<float> in;
  for (const Receiver& r : receivers)
    in.insert(in.end(), {r.uv.x, r.uv.y, 0, 0, r.normal.x, r.normal.y, r.normal.z, 0});
  GLuint buffers[2], queries[2];
  glGenBuffers(2, buffers);
  glGenQueries(2, queries);
  for (int k = 0; k < 2; ++k) {
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[k]);
    glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(in.size() * sizeof(float)),
                 k == 0 ? in.data() : nullptr, GL_STATIC_DRAW);
  }
  std::array<Light, 1> lights;
  const LightSetup setup = someLight(lights);
  Times times;
  for (int frame = 0; frame < frames; ++frame) {
    if (Status ok = relighter->relight(setup); !ok) return ok.error();
    glFinish();
    times.caches = std::min(times.caches, passMs(*relighter, "caches"));
    relighter->gl()->bind();
    for (GLuint k = 0; k < 2; ++k) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, k, buffers[k]);
    glUseProgram(*program);
    glProgramUniform1ui(*program, glGetUniformLocation(*program, "count"), static_cast<GLuint>(receivers.size()));
    glQueryCounter(queries[0], GL_TIMESTAMP);
    glDispatchCompute(static_cast<GLuint>((receivers.size() + 63) / 64), 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    glQueryCounter(queries[1], GL_TIMESTAMP);
    GLuint64 at[2] = {};
    for (int k = 0; k < 2; ++k) glGetQueryObjectui64v(queries[k], GL_QUERY_RESULT, &at[k]);
    times.resolve = std::min(times.resolve, static_cast<double>(at[1] - at[0]) * 1e-6);
  }
  glDeleteBuffers(2, buffers);
  glDeleteQueries(2, queries);
  glDeleteProgram(*program);
  return times;
}

template <class Measure>
int table(const char* title, const Measure& measure) {
  std::printf("\n%s:\n\n| chroma \\ luma |", title);
  for (int luma = 1; luma <= 8; ++luma) std::printf(" %d |", luma);
  std::printf("\n|---|---:|---:|---:|---:|---:|---:|---:|---:|");
  for (int chroma = 1; chroma <= 8; ++chroma) {
    std::printf("\n| %d |", chroma);
    for (int luma = 1; luma <= 8; ++luma) {
      if (luma < chroma) {
        std::printf(" |");
        continue;
      }
      const Result<Times> times = measure(Bands{luma, chroma});
      if (!times) return std::fprintf(stderr, "%s\n", times.error().message.c_str()), 1;
      std::printf(" %.2f + %.2f |", times->caches, times->resolve);
      std::fflush(stdout);
    }
  }
  std::printf("\n");
  return 0;
}

int run(const char* file, int frames, std::size_t count) {
  const Result<Bake> bake = readBake(file);
  if (!bake) return std::fprintf(stderr, "%s\n", bake.error().message.c_str()), 1;
  const std::vector<Receiver> receivers = makeReceivers(bake->caches, count);
  std::printf("%u caches, %u links, %zu receivers; caches + resolve, ms, least of %d frames\n", bake->caches.count(),
              bake->links.count(), receivers.size(), frames);
  if (table("CPU, one thread", [&](const Bands& bands) { return measureCpu(*bake, bands, receivers, frames); }))
    return 1;
  const Result<EglContext> context = EglContext::create();
  if (!context) {
    std::printf("\nno OpenGL: %s\n", context.error().message.c_str());
  } else if (table(context->renderer().c_str(),
                   [&](const Bands& bands) { return measureGl(*bake, bands, receivers, frames); })) {
    return 1;
  }
  std::printf(
      "\nPIC Table 3 (GTX 980), caches + shading:\n\n| chroma \\ luma | 2 | 3 | 4 | 5 | 6 | 7 | 8 "
      "|\n|---|---:|---:|---:|---:|---:|---:|---:|\n");
  for (int chroma = 2; chroma <= 8; ++chroma) {
    std::printf("| %d |", chroma);
    for (int luma = 2; luma <= 8; ++luma)
      luma < chroma ? std::printf(" |") : std::printf(" %.2f |", kPaper[chroma - 2][luma - 2]);
    std::printf("\n");
  }
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: bench_band_times BAKE.relume [frames [receivers]]\n"), 1;
  return relume::run(argv[1], argc > 2 ? std::atoi(argv[2]) : 10,
                     argc > 3 ? static_cast<std::size_t>(std::atoi(argv[3])) : 57600);
}
