// SPDX-License-Identifier: MIT
// Voxels that OpenGL finds are those of the CPU, to the bit; what hosts draw into them is within a voxel of them.
#include "runtime/live_gl/voxels_gl.h"

#include "runtime/shared/shader_text.h"
#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/step_place.h"
#include "runtime/voxels/voxel_volume.h"
#include "shaders/shared/layout.h"
#include "tests/load_level.h"
#include "tests/runtime/counting_loader.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/voxels/boxes.h"
#include "tools/render/voxel_scene.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <bit>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>
#include <vector>

namespace relume {
namespace {

using namespace test;

class VoxelsOnGl : public GlTest {
 protected:
  static VoxelsGl made(const VoxelGeometry& geometry, const VolumeGrid& grid,
                       std::optional<gpu::GroupThreads> groups = {}) {
    auto voxels = VoxelsGl::create(geometry, grid, {EglContext::getProcAddress, groups});
    EXPECT_TRUE(voxels) << voxels.error().message;
    return std::move(*voxels);
  }
};

using Bits = std::vector<std::uint64_t>;

std::size_t countOf(const Bits& bits) {
  std::size_t sum = 0;
  for (const std::uint64_t brick : bits) sum += static_cast<std::size_t>(std::popcount(brick));
  return sum;
}

// How many voxels one has and the other has not.
std::size_t countDifferent(const Bits& a, const Bits& b) {
  EXPECT_EQ(a.size(), b.size());
  std::size_t sum = 0;
  for (std::size_t c = 0; c < std::min(a.size(), b.size()); ++c)
    sum += static_cast<std::size_t>(std::popcount(a[c] ^ b[c]));
  return sum;
}

// Of all parts that stand, or of all that move, as the CPU has it.
Bits bitsOf(const VoxelGeometry& geometry, const VolumeGrid& grid, bool moves) {
  Bits bits(grid.cellCount(), 0);
  std::vector<SnappedTriangle> triangles;
  SnapCounts counts;
  for (const VoxelPart& part : geometry.parts) {
    if (part.moves != moves) continue;
    const VoxelMesh& mesh = geometry.meshes[part.mesh];
    EXPECT_TRUE(snapTriangles(grid, SnapBox::of(grid), mesh, geometry.surfaces, part.toWorld, 0,
                              static_cast<std::uint32_t>(mesh.triangle.size()), triangles, counts));
  }
  addBits(grid, triangles, {}, bits);
  return bits;
}

// A part of triangles with corners around random places, of up to so many metres.
void addTriangles(VoxelLevel& level, std::mt19937& random, std::uint32_t count, float extent, float size,
                  bool moves = false) {
  VoxelLevel::Mesh mesh;
  std::uniform_real_distribution<float> place(-0.05f * extent, 1.05f * extent), off(-size, size);
  for (std::uint32_t t = 0; t < count; ++t) {
    const glm::vec3 at(place(random), place(random), place(random));
    for (int c = 0; c < 3; ++c) mesh.position.push_back(at + glm::vec3(off(random), off(random), off(random)));
    // Along axes, and on corners of voxels, where rounding decides.
    if (t % 5 == 0) mesh.position.back().y = mesh.position[mesh.position.size() - 2].y = at.y;
    if (t % 7 == 0) mesh.position.back() = glm::floor(mesh.position.back());
    mesh.triangle.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    mesh.surface.push_back(t % static_cast<std::uint32_t>(level.surfaces.size()));
  }
  level.parts.push_back({static_cast<std::uint32_t>(level.meshes.size()), glm::mat4x3(1.0f), moves});
  level.meshes.push_back(std::move(mesh));
}

glm::mat4x3 someTurn(std::mt19937& random, float scale, const glm::vec3& to) {
  const glm::vec3 a = unit(random), b = glm::normalize(glm::cross(a, unit(random)));
  return {scale * a, scale * b, scale * glm::cross(a, b), to};
}

VolumeGrid gridOf(int cells, float voxel, const glm::vec3& origin = glm::vec3(0.0f)) {
  VolumeGrid grid;
  grid.cells = glm::ivec3(cells);
  grid.voxel = voxel;
  grid.originWorld = origin;
  return grid;
}

// Integers travel as halves, whose floats no driver changes.
void push(std::vector<float>& in, std::uint32_t word) {
  in.push_back(static_cast<float>(word >> 16));
  in.push_back(static_cast<float>(word & 0xFFFFu));
}

TEST_F(VoxelsOnGl, placesAreTheCpusToTheBit) {
  std::mt19937 random(3);
  const auto word = [&] { return static_cast<std::uint32_t>(random()); };
  std::vector<float> in;
  std::vector<glm::ivec3> expected;
  constexpr std::size_t kPlaces = 20000;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    // Transforms of levels, and any: of all scales and distances, without extent, mirrored.
    const float scale = i % 3 == 0 ? std::ldexp(1.0f, static_cast<int>(word() % 60) - 33) : 1.0f;
    const float far = i % 4 == 0 ? 1e5f : 20.0f;
    glm::mat4x3 toWorld = someTurn(random, scale, far * unit(random));
    if (i % 11 == 0) toWorld[1] = glm::vec3(0.0f);
    if (i % 13 == 0) toWorld[2] *= -1e-6f;
    const VolumeGrid grid = gridOf(32, i % 2 == 0 ? 0.1f : 0.0073f, i % 4 == 0 ? toWorld[3] - 3.0f : glm::vec3(-4.0f));
    const StepPlace place = StepPlace::of(grid, toWorld);
    glm::vec3 position = (i % 3 == 0 ? 1.0f / scale : 1.0f) * 7.0f * unit(random);
    if (i % 17 == 0) {
      for (int k = 0; k < 3; ++k) position[k] = std::bit_cast<float>(word() & ~0x40000000u);  // within 2, and denormal
    }
    if (i % 19 == 0) position *= 1e7f;
    if (i % 23 == 0) position.x = -0.0f;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t c = 0; c < 3; ++c) push(in, static_cast<std::uint32_t>(place.factor[k][c]));
      push(in, static_cast<std::uint32_t>(static_cast<std::uint64_t>(place.offset[k])));
      push(in, static_cast<std::uint32_t>(static_cast<std::uint64_t>(place.offset[k]) >> 32));
      push(in, std::bit_cast<std::uint32_t>(position[static_cast<int>(k)]));
    }
    push(in, static_cast<std::uint32_t>(place.exponent));
    expected.push_back(place.stepsOf(position));
  }
  const Result<std::string> layout = expandShader("shared/layout.h", {}),
                            text = expandShader("lib/live_place.glsl", {});
  ASSERT_TRUE(layout && text);
  const std::vector<float> out =
      runCompute(*layout + *text +
                     "layout(std430, binding = 0) readonly buffer In2 { float inWords[]; };\n"
                     "uint word(uint at) { return uint(inWords[2u * at]) << 16 | uint(inWords[2u * at + 1u]); }\n",
                 "  uint w = 19u * i;\n  RelumePlace p;\n"
                 "  p.x = ivec4(word(w), word(w + 1u), word(w + 2u), word(w + 3u));\n"
                 "  p.y = ivec4(word(w + 6u), word(w + 7u), word(w + 8u), word(w + 9u));\n"
                 "  p.z = ivec4(word(w + 12u), word(w + 13u), word(w + 14u), word(w + 15u));\n"
                 "  p.high = ivec3(word(w + 4u), word(w + 10u), word(w + 16u));\n  p.exponent = int(word(w + 18u));\n"
                 "  ivec3 s = relumeStepsOf(p, uvec3(word(w + 5u), word(w + 11u), word(w + 17u)));\n"
                 "  for (int k = 0; k < 3; ++k) { outData[6u * i + 2u * uint(k)] = float(s[k] >> 16);\n"
                 "    outData[6u * i + 2u * uint(k) + 1u] = float(s[k] & 0xFFFF); }\n",
                 in, kPlaces, 6 * kPlaces);
  for (std::size_t i = 0; i < kPlaces; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int found = static_cast<int>(out[6 * i + 2 * k]) * 65536 + static_cast<int>(out[6 * i + 2 * k + 1]);
      ASSERT_EQ(found, expected[i][static_cast<int>(k)]) << i;
    }
  }
}

// Few enough in so many voxels that none hides what another lacks, then large ones, which are cut.
TEST_F(VoxelsOnGl, randomTrianglesSetTheSameBits) {
  std::mt19937 random(1);
  const VolumeGrid grid = gridOf(64, 0.25f);
  VoxelLevel small;
  small.surfaces = {{}, {glm::vec3(0.5f), glm::vec3(0.0f), 0.6f}};
  addTriangles(small, random, 10000, 64.0f, 0.6f);
  EXPECT_EQ(countDifferent(made(small.geometry(), grid).standingBits(), bitsOf(small.geometry(), grid, false)), 0u);
  EXPECT_GT(countOf(bitsOf(small.geometry(), grid, false)), 20000u);
}

// Pieces of triangles that are cut, by the thread that has placed them or by a group for each block of the grid; of
// those that reach as far as numbers do, the few that are within it.
TEST_F(VoxelsOnGl, largeTrianglesAreCutIntoTheSamePieces) {
  std::mt19937 random(2);
  const VolumeGrid grid = gridOf(32, 0.5f);
  for (const float size : {6.0f, 24.0f, 100.0f, 1e6f}) {
    for (const float scale : {1.0f, -1.0f}) {
      VoxelLevel level;
      addTriangles(level, random, size < 10.0f ? 500 : size < 1e3f ? 20 : 4, 64.0f, size);
      auto& at = level.meshes[0].position;
      for (std::size_t v = 0; v < at.size() && size > 50.0f; v += 3) {  // through the grid
        const glm::vec3 a = unit(random), b = glm::cross(a, unit(random)), middle = glm::vec3(32.0f) + 20.0f * a;
        at[v] = middle - size * (a + b);
        at[v + 1] = middle + size * a;
        at[v + 2] = middle + size * b;
      }
      level.parts.back().toWorld = {{scale, 0, 0}, {0, 1, 0}, {0, 0, 1}, {scale < 0.0f ? 64.0f : 0.0f, 0, 0}};
      const Bits expected = bitsOf(level.geometry(), grid, false);
      for (const auto groups : {gpu::GroupThreads::serial, gpu::GroupThreads::parallel})
        EXPECT_EQ(countDifferent(made(level.geometry(), grid, groups).standingBits(), expected), 0u) << size << scale;
      EXPECT_GT(countOf(expected), 10000u) << size;
    }
  }
}

// Needles as long as the grid are no trouble; one that is far longer is, and is named.
TEST_F(VoxelsOnGl, sliversAreDoneOrRefused) {
  const VolumeGrid grid = gridOf(64, 0.25f);
  VoxelLevel level;
  level.addQuad({-9, 1, 1}, {71, 63, 60}, {71.5f, 63, 60}, {-9, 1.3f, 1});
  level.addQuad({-9, 30, 1}, {71, 30, 60}, {71, 30.4f, 60.4f}, {-9, 30.1f, 1});
  std::mt19937 random(5);
  for (const float width : {0.01f, 0.1f, 1.0f, 10.0f}) {
    for (int i = 0; i < 4; ++i) {
      const glm::vec3 along = 55.0f * unit(random), across = width * unit(random), middle(32.0f);
      level.addQuad(middle - along, middle + along, middle + along + across, middle - along + across);
    }
  }
  VoxelsGl gl = made(level.geometry(), grid);
  EXPECT_TRUE(gl.isComplete());
  EXPECT_EQ(countDifferent(gl.standingBits(), bitsOf(level.geometry(), grid, false)), 0u);
  level.addQuad({-4e5f, 30, -4e5f}, {8e5f, 30, 8e5f}, {8e5f, 30, 8.1e5f}, {-4e5f, 30, -3.99e5f});
  const auto refused = VoxelsGl::create(level.geometry(), grid, {EglContext::getProcAddress});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
  EXPECT_NE(refused.error().message.find("sliver"), std::string::npos) << refused.error().message;
}

void expectLevelsBits(const std::filesystem::path& path, std::uint32_t cells, std::size_t least) {
  const Scene scene = loadLevel(path);
  Context context;
  const auto level = VoxelScene::create(scene, 0.5f, context);
  ASSERT_TRUE(level);
  VoxelOptions options;
  options.cells = cells;
  options.parallelFor = onTwoThreads;
  const auto volume = VoxelVolume::create(level->geometry(), options);
  ASSERT_TRUE(volume) << volume.error().message;
  const auto gl = VoxelsGl::create(level->geometry(), volume->grid(), {EglContext::getProcAddress});
  ASSERT_TRUE(gl) << gl.error().message;
  EXPECT_EQ(gl->standingBits(), volume->standing().bits);
  EXPECT_EQ(gl->movingBits(), volume->moving().bits);
  EXPECT_GT(countOf(volume->standing().bits), least);
}

TEST_F(VoxelsOnGl, twoRoomsHaveTheSameBits) {
  expectLevelsBits(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", 32, 10000);
}

TEST_F(VoxelsOnGl, sponzaHasTheSameBits) {
  const std::filesystem::path path = RELUME_SHARED_DIR "/scenes/sponza/sponza.glb";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  expectLevelsBits(path, 32, 100000);
}

// A room in which two parts move, of many triangles and of a few large ones.
VoxelLevel movingLevel() {
  VoxelLevel level;
  std::mt19937 random(8);
  level.addBox({0, 0, 0}, {16, 16, 16}, true);
  level.addBox({2, 2, 2}, {5, 9, 5}, false);
  addTriangles(level, random, 800, 1.0f, 0.3f, true);
  level.addBox({-2, -0.1f, -3}, {2, 0.1f, 3}, false);
  level.parts.back().moves = true;
  return level;
}

TEST_F(VoxelsOnGl, partsMoveAsOnTheCpu) {
  VoxelLevel level = movingLevel();
  VoxelOptions options;
  options.cells = 24;
  auto volume = VoxelVolume::create(level.geometry(), options);
  ASSERT_TRUE(volume);
  auto gl = VoxelsGl::create(level.geometry(), volume->grid(), {countingLoader(0)});
  ASSERT_TRUE(gl) << gl.error().message;
  forgetCalls(0);
  std::mt19937 random(9);
  for (int f = 0; f < 20; ++f) {
    const float scale = f == 3 ? 0.0f : f == 4 ? 30.0f : 1.0f + 0.1f * static_cast<float>(f);
    std::vector<glm::mat4x3> to{someTurn(random, scale, glm::vec3(8.0f) + 5.0f * unit(random)),
                                someTurn(random, f % 2 == 0 ? 1.0f : -1.0f, glm::vec3(8.0f) + 9.0f * unit(random))};
    ASSERT_TRUE(volume->move(to));
    ASSERT_TRUE(gl->move(to));
    ASSERT_TRUE(gl->isComplete());
    ASSERT_EQ(countDifferent(gl->movingBits(), volume->moving().bits), 0u) << "frame " << f;
  }
  EXPECT_EQ(gl->standingBits(), volume->standing().bits);
  // What stands is edited: gone, back, and elsewhere.
  for (const PartEdit& edit : {PartEdit{1, glm::mat4x3(1.0f), false}, {1}, {1, someTurn(random, 0.7f, {9, 9, 2})}}) {
    ASSERT_TRUE(volume->edit({&edit, 1}));
    ASSERT_TRUE(gl->edit({&edit, 1}));
    ASSERT_EQ(countDifferent(gl->standingBits(), volume->standing().bits), 0u);
  }
  EXPECT_EQ(gl->movingBits(), volume->moving().bits);
  EXPECT_EQ(objectsMade(0), 0);
  EXPECT_GT(calls(0, "glDispatchCompute"), 40);
}

// A host's renderer, with a vertex shader of its own: all triangles of a level in three views.
class RasterHost {
 public:
  explicit RasterHost(const VoxelGeometry& geometry) {
    const Result<std::string> glsl = VoxelsGl::rasterGlsl();
    EXPECT_TRUE(glsl);
    program_ = glCreateProgram();
    const std::string vertex =
        "#version 430 core\nlayout(location = 0) in vec3 at;\nuniform mat4 clipFromWorld;\nout vec3 place;\n"
        "void main() { place = at; gl_Position = clipFromWorld * vec4(at, 1.0); }\n";
    const std::string fragment =
        "#version 430 core\n" + *glsl + "in vec3 place;\nvoid main() { relumeVoxelWrite(place); }\n";
    for (const auto& [kind, text] : {std::pair{GL_VERTEX_SHADER, &vertex}, {GL_FRAGMENT_SHADER, &fragment}}) {
      const GLuint shader = glCreateShader(static_cast<GLenum>(kind));
      const char* pointer = text->c_str();
      glShaderSource(shader, 1, &pointer, nullptr);
      glCompileShader(shader);
      std::string log(4096, '\0');
      GLint ok = GL_FALSE;
      glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
      glGetShaderInfoLog(shader, 4096, nullptr, log.data());
      EXPECT_TRUE(ok) << log.c_str();
      glAttachShader(program_, shader);
      glDeleteShader(shader);
    }
    glLinkProgram(program_);
    std::vector<glm::vec3> corners;
    for (const VoxelPart& part : geometry.parts) {
      const VoxelMesh& mesh = geometry.meshes[part.mesh];
      for (const glm::uvec3& t : mesh.triangle) {
        for (int k = 0; k < 3; ++k) corners.push_back(part.toWorld * glm::vec4(mesh.position[t[k]], 1.0f));
      }
    }
    count_ = static_cast<GLsizei>(corners.size());
    glGenVertexArrays(1, &array_);
    glBindVertexArray(array_);
    glGenBuffers(1, &buffer_);
    glBindBuffer(GL_ARRAY_BUFFER, buffer_);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(12 * corners.size()), corners.data(), GL_STATIC_DRAW);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    glGenFramebuffers(1, &target_);
    glBindFramebuffer(GL_FRAMEBUFFER, target_);
  }
  ~RasterHost() {
    glDeleteFramebuffers(1, &target_);
    glDeleteBuffers(1, &buffer_);
    glDeleteVertexArrays(1, &array_);
    glDeleteProgram(program_);
  }
  RasterHost(const RasterHost&) = delete;
  RasterHost& operator=(const RasterHost&) = delete;

  // Into the texture that is bound.
  void draw(const VoxelsGl& voxels) const {
    glUseProgram(program_);
    glDisable(GL_CULL_FACE);
    glDisable(GL_DEPTH_TEST);
    for (int axis = 0; axis < 3; ++axis) {
      const VoxelRasterView view = voxels.rasterView(axis);
      const auto width = static_cast<GLint>(view.width), height = static_cast<GLint>(view.height);
      glFramebufferParameteri(GL_FRAMEBUFFER, GL_FRAMEBUFFER_DEFAULT_WIDTH, width);
      glFramebufferParameteri(GL_FRAMEBUFFER, GL_FRAMEBUFFER_DEFAULT_HEIGHT, height);
      glViewport(0, 0, width, height);
      voxels.setRasterUniforms(program_, axis);
      glUniformMatrix4fv(glGetUniformLocation(program_, "clipFromWorld"), 1, GL_FALSE, &view.clipFromWorld[0][0]);
      glDrawArrays(GL_TRIANGLES, 0, count_);
    }
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    glUseProgram(0);
  }

 private:
  GLuint program_ = 0, array_ = 0, buffer_ = 0, target_ = 0;
  GLsizei count_ = 0;
};

// How many voxels of `a` have none of `b` within one voxel.
std::size_t countAlone(const VolumeGrid& grid, const Bits& a, const Bits& b) {
  const auto has = [&](const Bits& bits, const glm::ivec3& v) {
    return grid.holds(v) && (bits[grid.cellOf(v)] >> brickBit(v) & 1u) != 0;
  };
  std::size_t alone = 0;
  glm::ivec3 v, d;
  for (v.z = 0; v.z < grid.voxels().z; ++v.z) {
    for (v.y = 0; v.y < grid.voxels().y; ++v.y) {
      for (v.x = 0; v.x < grid.voxels().x; ++v.x) {
        if (!has(a, v)) continue;
        bool near = false;
        for (d.z = -1; d.z <= 1; ++d.z)
          for (d.y = -1; d.y <= 1; ++d.y)
            for (d.x = -1; d.x <= 1; ++d.x) near = near || has(b, v + d);
        alone += near ? 0 : 1;
      }
    }
  }
  return alone;
}

// CRC's raster path: what a host draws is within a voxel of what the compute path finds, both ways.
TEST_F(VoxelsOnGl, whatIsDrawnIsWithinAVoxel) {
  VoxelLevel level;
  level.addBox({0, 0, 0}, {9, 5, 7}, true);
  level.addBox({1, 0, 1}, {3, 2, 2}, false);
  // Turned by any angle, and by half a right one, where two axes are alike.
  std::mt19937 random(4);
  level.addBox({-1, -1, -1}, {1, 1, 1}, false);
  level.parts.back().toWorld = someTurn(random, 0.9f, {6, 2.5f, 4});
  level.addBox({-0.7f, -0.7f, -0.7f}, {0.7f, 0.7f, 0.7f}, false);
  const float half = std::sqrt(0.5f);
  level.parts.back().toWorld = {{half, 0, half}, {0, 1, 0}, {-half, 0, half}, {4, 1.2f, 5}};
  VoxelOptions options;
  options.cells = 24;
  const auto volume = VoxelVolume::create(level.geometry(), options);
  ASSERT_TRUE(volume);
  const VolumeGrid& grid = volume->grid();
  VoxelsGl gl = made(level.geometry(), grid);
  const Bits computed = gl.standingBits();
  ASSERT_EQ(countOf(gl.movingBits()), 0u);
  {
    const RasterHost host(level.geometry());
    ASSERT_TRUE(gl.bindRaster(gl.moving()));
    host.draw(gl);
  }
  const Bits drawn = gl.movingBits();
  EXPECT_GT(countOf(drawn), countOf(computed) * 3 / 4);
  EXPECT_LT(countOf(drawn), countOf(computed) * 5 / 4);
  EXPECT_EQ(countAlone(grid, drawn, computed), 0u);
  EXPECT_EQ(countAlone(grid, computed, drawn), 0u);
  // Into the bits of what moves, until that moves again.
  ASSERT_TRUE(gl.move({}));
  EXPECT_EQ(countOf(gl.movingBits()), 0u);
}

// Triangles that hold no pixel's middle are not drawn, which is little of a level.
TEST_F(VoxelsOnGl, sponzaIsDrawnButForSlivers) {
  const std::filesystem::path path = RELUME_SHARED_DIR "/scenes/sponza/sponza.glb";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  const Scene scene = loadLevel(path);
  Context context;
  const auto level = VoxelScene::create(scene, 1e6f, context);
  ASSERT_TRUE(level);
  std::vector<VoxelPart> parts(level->geometry().parts.begin(), level->geometry().parts.end());
  for (VoxelPart& part : parts) part.moves = false;
  const VoxelGeometry geometry{level->geometry().surfaces, level->geometry().meshes, parts};
  VoxelOptions options;
  options.parallelFor = onTwoThreads;
  const auto volume = VoxelVolume::create(geometry, options);
  ASSERT_TRUE(volume);
  VoxelsGl gl = made(geometry, volume->grid());
  ASSERT_TRUE(gl.bindRaster(gl.moving()));
  RasterHost(geometry).draw(gl);
  const Bits &computed = volume->standing().bits, drawn = gl.movingBits();
  EXPECT_GT(countOf(drawn), countOf(computed) * 9 / 10);
  EXPECT_EQ(countAlone(volume->grid(), drawn, computed), 0u);
  EXPECT_LT(countAlone(volume->grid(), computed, drawn), countOf(computed) / 1000);
}

TEST_F(VoxelsOnGl, texturesToDrawIntoAreLookedAt) {
  VoxelLevel level = movingLevel();
  VolumeGrid grid = gridOf(8, 0.5f);
  grid.cells = {8, 6, 7};
  VoxelsGl gl = made(level.geometry(), grid);
  const auto refuses = [&](GLenum target, GLenum format, const glm::ivec3& size, const std::string& text) {
    GLuint texture = 0;
    glGenTextures(1, &texture);
    glBindTexture(target, texture);
    if (target == GL_TEXTURE_3D)
      glTexStorage3D(target, 1, format, size.x, size.y, size.z);
    else
      glTexStorage2D(target, 1, format, size.x, size.y);
    glBindTexture(target, 0);
    const Status status = gl.bindRaster(texture);
    context_->forgetErrors();  // of binding it as another kind
    EXPECT_EQ(status.operator bool(), text.empty());
    if (!status) {
      EXPECT_EQ(status.error().code, ErrorCode::usage);
      EXPECT_NE(status.error().message.find(text), std::string::npos) << status.error().message;
    }
    glDeleteTextures(1, &texture);
  };
  refuses(GL_TEXTURE_2D, GL_R32UI, {16, 6, 1}, "is no GL_TEXTURE_3D");
  refuses(GL_TEXTURE_3D, GL_R32I, {16, 6, 7}, "is not of GL_R32UI");
  refuses(GL_TEXTURE_3D, GL_RGBA8, {16, 6, 7}, "is not of GL_R32UI");
  refuses(GL_TEXTURE_3D, GL_R32UI, {8, 6, 7}, "has 8 x 6 x 7 texels, expected 16 x 6 x 7");
  refuses(GL_TEXTURE_3D, GL_R32UI, {16, 6, 7}, "");
  const Status none = gl.bindRaster(0);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("texture 0"), std::string::npos) << none.error().message;
  ASSERT_TRUE(gl.bindRaster(gl.moving()));
  GLint found = 0;
  glGetIntegeri_v(GL_IMAGE_BINDING_NAME, 0, &found);
  EXPECT_EQ(static_cast<GLuint>(found), gl.moving());
}

TEST_F(VoxelsOnGl, nothingIsNothing) {
  const VolumeGrid grid = gridOf(8, 1.0f);
  EXPECT_EQ(countOf(made({}, grid).standingBits()), 0u);
  VoxelLevel level;
  level.addQuad({4, 4, 4}, {4, 4, 4}, {5, 4, 4}, {7, 4, 4});
  level.addBox({-9, -9, -9}, {-3, -3, -3}, false);
  EXPECT_EQ(countOf(made(level.geometry(), grid).standingBits()), 0u);
}

TEST_F(VoxelsOnGl, whatIsRefusedChangesNothing) {
  VoxelLevel level = movingLevel();
  const VolumeGrid grid = gridOf(8, 0.5f);
  EXPECT_FALSE(VoxelsGl::create(level.geometry(), grid, {{}}));
  VoxelsGl gl = made(level.geometry(), grid);
  level.meshes[0].position[0].x = std::numeric_limits<float>::quiet_NaN();
  const auto bad = VoxelsGl::create(level.geometry(), grid, {EglContext::getProcAddress});
  ASSERT_FALSE(bad);
  EXPECT_NE(bad.error().message.find("mesh 0: vertex 0"), std::string::npos) << bad.error().message;
  const Bits moving = gl.movingBits(), standing = gl.standingBits();
  const auto refuses = [](const Status& status, const std::string& text) {
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::usage);
    EXPECT_NE(status.error().message.find(text), std::string::npos) << status.error().message;
  };
  std::vector<glm::mat4x3> to(2, glm::mat4x3(1.0f));
  to[1][2].y = std::numeric_limits<float>::infinity();
  refuses(gl.move(to), "part 3: column 2");
  refuses(gl.move({to.data(), 1}), "got 1 transforms, expected one for each of 2");
  refuses(gl.edit(std::vector<PartEdit>{{4}}), "part 4 of 4");
  refuses(gl.edit(std::vector<PartEdit>{{2}}), "part 2, which moves");
  refuses(gl.edit(std::vector<PartEdit>{{0, glm::mat4x3(0.0f)}, {1, to[1]}}), "part 1: column 2");
  EXPECT_EQ(gl.movingBits(), moving);
  EXPECT_EQ(gl.standingBits(), standing);
}

TEST_F(VoxelsOnGl, bindingsOfTheHostAreAsTheyWere) {
  VoxelLevel level = movingLevel();
  VoxelsGl gl = made(level.geometry(), gridOf(8, 0.5f));
  GLuint buffer = 0, texture = 0;
  glGenBuffers(1, &buffer);
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_3D, texture);
  glTexStorage3D(GL_TEXTURE_3D, 1, GL_RGBA8, 4, 4, 4);
  glBindBuffer(GL_COPY_WRITE_BUFFER, buffer);
  glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, buffer);
  for (GLuint slot = 0; slot < 3; ++slot) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, slot, buffer);
  glActiveTexture(GL_TEXTURE0 + RELUME_LIVE_UNIT_CELLS);
  glBindTexture(GL_TEXTURE_3D, texture);
  glBindImageTexture(0, texture, 0, GL_FALSE, 2, GL_READ_ONLY, GL_RGBA8);
  glActiveTexture(GL_TEXTURE0 + 5);
  ASSERT_TRUE(gl.move(std::vector<glm::mat4x3>(2, glm::mat4x3(1.0f))));
  ASSERT_TRUE(gl.edit({}));
  gl.movingBits();
  EXPECT_FALSE(gl.bindRaster(texture));
  GLint found = 0;
  for (GLuint slot = 0; slot < 3; ++slot) {
    glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, slot, &found);
    EXPECT_EQ(static_cast<GLuint>(found), buffer);
  }
  glGetIntegerv(GL_COPY_WRITE_BUFFER_BINDING, &found);
  EXPECT_EQ(static_cast<GLuint>(found), buffer);
  glGetIntegerv(GL_DISPATCH_INDIRECT_BUFFER_BINDING, &found);
  EXPECT_EQ(static_cast<GLuint>(found), buffer);
  glGetIntegerv(GL_ACTIVE_TEXTURE, &found);
  EXPECT_EQ(found, GL_TEXTURE0 + 5);
  glGetIntegeri_v(GL_IMAGE_BINDING_NAME, 0, &found);
  EXPECT_EQ(static_cast<GLuint>(found), texture);
  glGetIntegeri_v(GL_IMAGE_BINDING_LAYER, 0, &found);
  EXPECT_EQ(found, 2);
  glActiveTexture(GL_TEXTURE0 + RELUME_LIVE_UNIT_CELLS);
  glGetIntegerv(GL_TEXTURE_BINDING_3D, &found);
  EXPECT_EQ(static_cast<GLuint>(found), texture);
  glGetIntegerv(GL_CURRENT_PROGRAM, &found);
  EXPECT_EQ(found, 0);
  glDeleteBuffers(1, &buffer);
  glDeleteTextures(1, &texture);
}

}  // namespace
}  // namespace relume
