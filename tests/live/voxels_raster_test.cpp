// SPDX-License-Identifier: MIT
// What hosts draw into the bits of voxels is within a voxel of those that are computed.
#include "tests/live/voxels_on_gl.h"

#include "runtime/voxels/voxel_volume.h"
#include "tests/load_level.h"
#include "tools/render/voxel_scene.h"

#include <epoxy/gl.h>

#include <cmath>
#include <filesystem>
#include <string>

namespace relume {
namespace {

using namespace test;

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

}  // namespace
}  // namespace relume
