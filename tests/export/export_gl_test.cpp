// SPDX-License-Identifier: MIT
// A game in OpenGL that knows nothing of Relume's caches: it draws the exported level with its TEXCOORD set and
// Relighter::irradianceMap() in an RGBA16F texture, sampled bilinearly, and shows what `relume render` does.
#include "tests/export/exported.h"
#include "tools/gl_scene/egl_context.h"
#include "tools/gl_scene/gl_program.h"
#include "tools/render/render_cpu.h"

#include <numbers>

namespace relume {
namespace {

constexpr const char* kVertex = R"(#version 430
layout(location = 0) in vec3 positionWorld;
layout(location = 1) in vec4 lightmapUv;  // of the front, of the back
layout(location = 2) in float number;
uniform vec3 origin, right, up, forward;
out vec4 uv;
flat out int onGrid;  // bit 0: the front, bit 1: the back
flat out float instance;
void main() {
  uv = lightmapUv;
  onGrid = (lightmapUv.xy == vec2(1.0) ? 1 : 0) | (lightmapUv.zw == vec2(1.0) ? 2 : 0);
  instance = number;
  vec3 d = positionWorld - origin;
  float z = dot(d, forward);
  gl_Position = vec4(dot(d, right) / dot(right, right), dot(d, up) / dot(up, up), (z * 1.0001 - 0.02), z);
})";

constexpr const char* kFragment = R"(#version 430
in vec4 uv;
flat in int onGrid;
flat in float instance;
layout(binding = 0) uniform sampler2D irradianceMap;
layout(location = 0) out vec4 color;
void main() {
  bool front = gl_FrontFacing;
  vec3 irradiance = texture(irradianceMap, front ? uv.xy : uv.zw).rgb;
  color = (onGrid & (front ? 1 : 2)) != 0 ? vec4(0.0) : vec4(irradiance / 3.14159265, instance);
})";

struct Vertices {
  std::vector<float> values;       // position, front, back, instance + 1
  std::vector<std::uint8_t> flat;  // by instance: its normals are those of its faces
};

Vertices gatherVertices(const test::Exported& e) {
  Vertices out;
  Context context;
  const auto document = loadGltfDocument(e.path, context);
  EXPECT_TRUE(document);
  for (std::uint32_t i = 0; i < e.again.instances.size(); ++i) {
    const Instance& instance = e.again.instances[i];
    const auto front = test::cornerSet(*document, instance, e.level.texcoord);
    const auto back =
        e.level.backTexcoord < 0 ? std::nullopt : test::cornerSet(*document, instance, e.level.backTexcoord);
    bool flat = true;
    for (std::uint32_t t = 0; t < e.again.meshes[instance.mesh].triangle.size(); ++t) {
      const auto corners = e.again.corners(instance, t);
      for (const glm::vec2 b : {glm::vec2(0.0f), glm::vec2(1.0f, 0.0f), glm::vec2(0.0f, 1.0f)}) {
        const SurfacePoint p{i, t, b};
        flat &= glm::dot(shadingNormal(e.again, p), geometricNormal(e.again, p)) > 0.9999f;
      }
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t c = 3 * t + (instance.flipped && k > 0 ? 3 - k : k);
        const glm::vec2 f = front ? front->at(c) : glm::vec2(1.0f), r = back ? back->at(c) : glm::vec2(1.0f);
        out.values.insert(out.values.end(),
                          {corners[k].x, corners[k].y, corners[k].z, f.x, f.y, r.x, r.y, static_cast<float>(i + 1)});
      }
    }
    out.flat.push_back(flat);
  }
  return out;
}

// RGBA of each pixel, row 0 on top: irradiance / pi, and the number of the instance + 1; zeros on the grid.
std::vector<glm::vec4> drawGame(const Vertices& vertices, const CameraRays& rays, glm::uvec2 mapSize,
                                const std::vector<std::uint16_t>& map, int width, int height) {
  const Result<GlProgram> program = linkProgram("game", kVertex, kFragment);
  EXPECT_TRUE(program) << program.error().message;
  if (!program) return {};
  const GlTexture texture = GlTexture::make(), target = GlTexture::make(), depth = GlTexture::make();
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, target.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, width, height);
  glBindTexture(GL_TEXTURE_2D, depth.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_DEPTH_COMPONENT32F, width, height);
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA16F, static_cast<GLsizei>(mapSize.x), static_cast<GLsizei>(mapSize.y));
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, static_cast<GLsizei>(mapSize.x), static_cast<GLsizei>(mapSize.y), GL_RGBA,
                  GL_HALF_FLOAT, map.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  const GlFramebuffer frame = GlFramebuffer::make();
  glBindFramebuffer(GL_FRAMEBUFFER, frame.name());
  glFramebufferTexture(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, target.name(), 0);
  glFramebufferTexture(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth.name(), 0);
  EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
  const GlVertexArray array = GlVertexArray::make();
  const GlBuffer buffer = GlBuffer::make();
  glBindVertexArray(array.name());
  glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.values.size() * sizeof(float)), vertices.values.data(),
               GL_STATIC_DRAW);
  const int sizes[] = {3, 4, 1};
  for (GLuint i = 0, offset = 0; i < 3; offset += static_cast<GLuint>(sizes[i++])) {
    glEnableVertexAttribArray(i);
    glVertexAttribPointer(i, sizes[i], GL_FLOAT, GL_FALSE, 8 * sizeof(float),
                          reinterpret_cast<const void*>(offset * sizeof(float)));
  }
  glUseProgram(program->name());
  const auto uniform = [&](const char* name, const glm::vec3& v) {
    glUniform3f(glGetUniformLocation(program->name(), name), v.x, v.y, v.z);
  };
  uniform("origin", rays.origin), uniform("right", rays.right), uniform("up", rays.up),
      uniform("forward", rays.forward);
  glViewport(0, 0, width, height);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(vertices.values.size() / 8));
  std::vector<glm::vec4> read(static_cast<std::size_t>(width * height)), out(read.size());
  glReadPixels(0, 0, width, height, GL_RGBA, GL_FLOAT, read.data());
  for (int y = 0; y < height; ++y)
    std::copy_n(&read[static_cast<std::size_t>((height - 1 - y) * width)], width,
                &out[static_cast<std::size_t>(y * width)]);
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
  return out;
}

TEST(ExportLevelInOpenGl, aGamesPixelsAreThoseOfRender) {
  const Result<EglContext> gl = EglContext::create();
  if (!gl) GTEST_SKIP() << gl.error().message;
  BakeOptions options = presetOptions(Preset::draft);
  options.surfels.count = 2000;
  test::Exported e = test::exportOf(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", options);
  e.bake.caches.lightmap.sight = {};  // a game's filter reads across walls
  const Vertices vertices = gatherVertices(e);
  Context context;
  const auto tracer = RayTracer::create(e.scene, "avx2", context, RayStructure::thorough, RayGeometry::drawn);
  ASSERT_TRUE(tracer) << tracer.error().message;
  RenderRequest request;
  request.bake = &e.bake;
  request.emissive = true;
  request.sky.radiance = {1.0f, 1.3f, 2.0f};
  request.width = 160;
  request.height = 90;
  request.samples = 1;
  request.bounces = 4;
  for (const Camera& camera : e.scene.cameras) {
    request.camera = camera;
    const auto frame = renderCpu(*tracer, request, context);
    ASSERT_TRUE(frame) << frame.error().message;
    const std::vector<glm::vec3> drawn = composeAov(*frame, Aov::indirect);
    const auto relit = relightRequest(request, {}, {}, {});
    ASSERT_TRUE(relit) << relit.error().message;
    const glm::uvec2 size = relit->all->lightmapSize();
    std::vector<std::uint16_t> map(std::size_t{4} * size.x * size.y);
    ASSERT_TRUE(relit->all->irradianceMap(map));
    const CameraRays rays(camera, request.width, request.height);
    const std::vector<glm::vec4> game = drawGame(vertices, rays, size, map, 160, 90);
    ASSERT_EQ(game.size(), drawn.size());

    std::size_t compared = 0, off = 0;
    double difference = 0.0, sum = 0.0, worst = 0.0;
    for (std::uint32_t y = 0; y < request.height; ++y) {
      for (std::uint32_t x = 0; x < request.width; ++x) {
        Ray ray;
        rays.at(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, ray.origin, ray.direction);
        const Hit hit = tracer->trace(ray);
        const glm::vec4 mine = game[y * request.width + x];
        // Where both see one surface, whose normal is that of its texels.
        if (!hit || mine.a != static_cast<float>(hit.instance + 1) || vertices.flat[hit.instance] == 0) continue;
        const glm::vec3 albedo = albedoAt(e.scene, hit.point());
        for (int k = 0; k < 3; ++k) {
          if (albedo[k] <= 0.0f) continue;
          const double expected = drawn[y * request.width + x][k], error = std::abs(mine[k] - expected);
          difference += error;
          sum += expected;
          worst = std::max(worst, error / (0.05 + expected));
          off += error > 0.01 * (0.05 + expected);
          ++compared;
        }
      }
    }
    RecordProperty("worst", std::to_string(worst));
    std::printf("%s: %zu values, mean error %.4f %%, worst %.2f %%, %zu beyond 1 %%\n", camera.name.c_str(), compared,
                100.0 * difference / sum, 100.0 * worst, off);
    EXPECT_GT(compared, std::size_t{3} * request.width * request.height / 3);
    EXPECT_LT(difference, 0.002 * sum);
    EXPECT_LT(off, compared / 200);
  }
}

}  // namespace
}  // namespace relume
