// SPDX-License-Identifier: MIT
// Voxels that OpenGL finds are those of the CPU, to the bit.
#include "tests/live/voxels_on_gl.h"

#include "runtime/shared/shader_text.h"
#include "runtime/voxels/packed_mesh.h"
#include "runtime/voxels/step_place.h"
#include "runtime/voxels/voxel_volume.h"
#include "shaders/shared/layout.h"
#include "tests/load_level.h"
#include "tests/runtime/counting_loader.h"
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
  const PackedGeometry packed = packGeometry(geometry, {});
  for (const VoxelPart& part : geometry.parts) {
    if (part.moves != moves) continue;
    const PackedMesh& mesh = packed.mesh[part.mesh];
    EXPECT_TRUE(snapRuns(grid, SnapBox::of(grid), mesh, part.toWorld, 0, static_cast<std::uint32_t>(mesh.run.size()),
                         triangles, counts));
  }
  addBits(grid, triangles, {}, bits);
  return bits;
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
  const Bits none(volume->grid().cellCount(), 0);
  EXPECT_EQ(gl->movingBits(), volume->hasMoving() ? volume->moving().bits : none);
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

GLbitfield lastBarrier = 0;

// What shaders have counted is written anew by the next call, which must not overtake them.
TEST_F(VoxelsOnGl, waitForAllThatTheNextCallWrites) {
  VoxelLevel level = movingLevel();
  auto gl = VoxelsGl::create(level.geometry(), gridOf(8, 0.5f), {[](const char* name) -> GlProc {
                               if (std::string(name) != "glMemoryBarrier") return EglContext::getProcAddress(name);
                               return reinterpret_cast<GlProc>(+[](GLbitfield bits) {
                                 lastBarrier = bits;
                                 glMemoryBarrier(bits);
                               });
                             }});
  ASSERT_TRUE(gl) << gl.error().message;
  lastBarrier = 0;
  ASSERT_TRUE(gl->move(std::vector<glm::mat4x3>(2, glm::mat4x3(1.0f))));
  EXPECT_EQ(lastBarrier & GL_BUFFER_UPDATE_BARRIER_BIT, static_cast<GLbitfield>(GL_BUFFER_UPDATE_BARRIER_BIT));
  EXPECT_EQ(lastBarrier & GL_TEXTURE_FETCH_BARRIER_BIT, static_cast<GLbitfield>(GL_TEXTURE_FETCH_BARRIER_BIT));
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
