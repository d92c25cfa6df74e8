// SPDX-License-Identifier: MIT
// Materials that a frame drives, in OpenGL: the CPU's light, from main memory and from the host's textures; the baked
// light afterwards; textures that cannot be read; no object in a frame.
#include "relume/relighter.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/counting_loader.h"
#include "tests/runtime/driven_bake.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/some_lights.h"

#include <epoxy/gl.h>

#include <limits>
#include <string>
#include <string_view>

namespace relume {
namespace {

using test::kPanel, test::kScreen;

const Bake& bakeOfRoom() {
  static const Bake bake = test::makeDrivenBake({.surfels = 3000, .lightmapCaches = 60, .linksPerCache = 48});
  return bake;
}

Relighter make(BackendKind backend, std::vector<DrivenImage> images, const GetProcAddress& loader) {
  RelightOptions options;
  options.backend = backend;
  options.drivenImages = std::move(images);
  options.getProcAddress = loader;
  Result<Relighter> made = Relighter::create(bakeOfRoom(), options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

class Texture2d {
 public:
  Texture2d(std::uint32_t width, std::uint32_t height, const std::vector<glm::vec3>& texels, bool mips = true) {
    glGenTextures(1, &name_);
    glBindTexture(GL_TEXTURE_2D, name_);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB32F, static_cast<GLsizei>(width), static_cast<GLsizei>(height), 0, GL_RGB,
                 GL_FLOAT, texels.data());
    if (mips) glGenerateMipmap(GL_TEXTURE_2D);
    glBindTexture(GL_TEXTURE_2D, 0);
  }
  ~Texture2d() { glDeleteTextures(1, &name_); }
  Texture2d(const Texture2d&) = delete;
  Texture2d& operator=(const Texture2d&) = delete;
  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

class GlDriven : public test::GlTest {
 protected:
  // Largest difference of both backends' light after some frames of a setup each.
  static double differenceOf(Relighter& gl, const LightSetup& onGl, Relighter& cpu, const LightSetup& onCpu) {
    for (int frame = 0; frame < 3; ++frame) {
      const Status a = gl.relight(onGl), b = cpu.relight(onCpu);
      EXPECT_TRUE(a) << (a ? "" : a.error().message);
      EXPECT_TRUE(b) << (b ? "" : b.error().message);
    }
    return test::coefficientDifference(cpu.cacheCoefficients(), gl.cacheCoefficients(), cpu.coefficientsPerCache());
  }
};

TEST_F(GlDriven, isTheLightOfTheCpu) {
  constexpr std::uint32_t kWidth = 45, kHeight = 32;  // an odd size: levels are means by area
  const std::vector<glm::vec3> image = test::makeStripes(kWidth, kHeight);
  const std::vector<DrivenImage> images = {{"screen", kWidth, kHeight}};
  Relighter gl = make(BackendKind::gl, images, EglContext::getProcAddress), cpu = make(BackendKind::cpu, images, {});
  const std::vector<Light> lights = test::someLights();
  std::vector<MaterialEmission> emissions(2);
  emissions[0].material = kPanel;
  emissions[0].radiance = {1, 5, 2};
  emissions[1].material = kScreen;
  emissions[1].radiance = {2, 1, 3};
  emissions[1].image = image;
  LightSetup setup, baked;
  setup.materialEmissions = emissions;
  EXPECT_LT(differenceOf(gl, setup, cpu, setup), 0.005);
  // One of them alone, the other scaled; beside lights.
  setup.materialEmissions = std::span(emissions).first(1);
  setup.emissionScale = glm::vec3(0.25f);
  setup.lights = lights;
  EXPECT_LT(differenceOf(gl, setup, cpu, setup), 0.005);
  // And none again: exactly what a relighter has that never drove any.
  Relighter fresh = make(BackendKind::gl, {}, EglContext::getProcAddress);
  gl.reset();
  ASSERT_TRUE(gl.relight(baked) && fresh.relight(baked));
  EXPECT_EQ(gl.nodeRadiosity(), fresh.nodeRadiosity());
}

TEST_F(GlDriven, readsTheHostsTextureAsItReadsItsImage) {
  constexpr std::uint32_t kSide = 64;
  const std::vector<glm::vec3> image = test::makeStripes(kSide, kSide);
  const Texture2d texture(kSide, kSide, image);
  const std::vector<DrivenImage> images = {{"screen", kSide, kSide}};
  Relighter gl = make(BackendKind::gl, images, EglContext::getProcAddress), cpu = make(BackendKind::cpu, images, {});
  MaterialEmission byTexture, byImage;
  byTexture.texture = texture.name();
  byImage.image = image;
  LightSetup onGl, onCpu;
  onGl.materialEmissions = {&byTexture, 1};
  onCpu.materialEmissions = {&byImage, 1};
  GLuint bound = 0;
  glGenTextures(1, &bound);
  glBindTexture(GL_TEXTURE_2D, bound);
  EXPECT_LT(differenceOf(gl, onGl, cpu, onCpu), 0.005);
  GLint now = 0;
  glGetIntegerv(GL_TEXTURE_BINDING_2D, &now);
  EXPECT_EQ(static_cast<GLuint>(now), bound) << "the host's binding";
  glDeleteTextures(1, &bound);
}

// A loader whose OpenGL has no memory for textures while `isOut`.
struct NoMemory {
  static inline bool isOut = false, isPending = false;
  static inline void (*storage)(GLenum, GLsizei, GLenum, GLsizei, GLsizei) = nullptr;
  static inline GLenum (*error)() = nullptr;

  static void texStorage2D(GLenum target, GLsizei levels, GLenum format, GLsizei width, GLsizei height) {
    if (isOut) {
      isPending = true;
    } else {
      storage(target, levels, format, width, height);
    }
  }
  static GLenum getError() {
    if (!isPending) return error();
    isPending = false;
    return GL_OUT_OF_MEMORY;
  }
  template <class Function>
  static GlProc functionOf(Function* function) {
    return reinterpret_cast<GlProc>(function);
  }
  static GlProc load(const char* name) {
    const GlProc found = EglContext::getProcAddress(name);
    if (std::string_view(name) == "glTexStorage2D") {
      storage = reinterpret_cast<decltype(storage)>(found);
      return functionOf(&texStorage2D);
    }
    if (std::string_view(name) == "glGetError") {
      error = reinterpret_cast<decltype(error)>(found);
      return functionOf(&getError);
    }
    return found;
  }
};

TEST_F(GlDriven, anImageWithoutMemoryIsRefusedAndTheLightStays) {
  constexpr std::uint32_t kSide = 64;
  const std::vector<glm::vec3> image = test::makeStripes(kSide, kSide);
  const std::vector<DrivenImage> images = {{"screen", kSide, kSide}};
  Relighter gl = make(BackendKind::gl, images, NoMemory::load), cpu = make(BackendKind::cpu, images, {});
  MaterialEmission byImage;
  byImage.image = image;
  LightSetup baked, driven;
  driven.materialEmissions = {&byImage, 1};
  ASSERT_TRUE(gl.relight(baked) && cpu.relight(baked));
  const std::vector<float> before = gl.cacheCoefficients();
  NoMemory::isOut = true;
  const Status refused = gl.relight(driven);
  NoMemory::isOut = false;
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::memory);
  EXPECT_EQ(gl.cacheCoefficients(), before);
  EXPECT_LT(differenceOf(gl, driven, cpu, driven), 0.005) << "and once there is some, its light";
}

TEST_F(GlDriven, texelsThatAreNoRadianceAreNoLight) {
  std::vector<glm::vec3> texels(16, glm::vec3(std::numeric_limits<float>::quiet_NaN(), -1.0f, 0.0f));
  const Texture2d texture(4, 4, texels);
  Relighter gl = make(BackendKind::gl, {{"screen", 4, 4}}, EglContext::getProcAddress),
            dark = make(BackendKind::gl, {}, EglContext::getProcAddress);
  MaterialEmission byTexture, black;
  byTexture.texture = texture.name();
  black.radiance = glm::vec3(0.0f);
  LightSetup setup, none;
  setup.materialEmissions = {&byTexture, 1};
  none.materialEmissions = {&black, 1};
  for (int frame = 0; frame < 2; ++frame) ASSERT_TRUE(gl.relight(setup) && dark.relight(none));
  EXPECT_EQ(gl.nodeRadiosity(), dark.nodeRadiosity());
}

TEST_F(GlDriven, texturesThatCannotBeReadAreRefusedAndLightStays) {
  const std::vector<glm::vec3> image = test::makeStripes(8, 8);
  const Texture2d other(4, 8, test::makeStripes(4, 8)), noMips(8, 8, image, false);
  GLuint array = 0, deleted = 0;
  glGenTextures(1, &array);
  glBindTexture(GL_TEXTURE_2D_ARRAY, array);
  glGenTextures(1, &deleted);
  glBindTexture(GL_TEXTURE_2D, deleted);
  glDeleteTextures(1, &deleted);
  Relighter gl = make(BackendKind::gl, {{"screen", 8, 8}}, EglContext::getProcAddress);
  ASSERT_TRUE(gl.relight({}));
  const std::vector<float> before = gl.cacheCoefficients();
  const auto refused = [&](MaterialEmission emission) {
    LightSetup setup;
    setup.materialEmissions = {&emission, 1};
    const Status status = gl.relight(setup);
    EXPECT_FALSE(status);
    EXPECT_EQ(gl.cacheCoefficients(), before);
    return status ? std::string() : status.error().message;
  };
  const auto texture = [](GLuint name) {
    MaterialEmission emission;
    emission.texture = name;
    return emission;
  };
  EXPECT_NE(refused(texture(deleted)).find("is no GL_TEXTURE_2D"), std::string::npos);
  context_->forgetErrors();  // a driver's complaint, if it has given the name to the array
  EXPECT_NE(refused(texture(other.name())).find("has 4 x 8 texels, expected the 8 x 8"), std::string::npos);
  EXPECT_NE(refused(texture(noMips.name())).find("no mip levels"), std::string::npos);
  GLuint others[2] = {};
  glGenTextures(2, others);
  const GLenum formats[2] = {GL_RGBA8UI, GL_DEPTH_COMPONENT24};
  for (std::size_t i = 0; i < 2; ++i) {
    glBindTexture(GL_TEXTURE_2D, others[i]);
    glTexStorage2D(GL_TEXTURE_2D, 4, formats[i], 8, 8);
    EXPECT_NE(refused(texture(others[i])).find("no colours that filter"), std::string::npos);
  }
  glDeleteTextures(2, others);
  MaterialEmission both = texture(other.name()), undeclared = texture(other.name());
  both.image = image;
  undeclared.material = kPanel;
  EXPECT_NE(refused(both).find("image and texture"), std::string::npos);
  EXPECT_NE(refused(undeclared).find("none is declared"), std::string::npos);
  glDeleteTextures(1, &array);
}

TEST_F(GlDriven, framesCreateNoObjectAndAllocateNothing) {
  const std::vector<glm::vec3> image = test::makeStripes(24, 16);
  const Texture2d texture(8, 8, test::makeStripes(8, 8));
  Relighter gl = make(BackendKind::gl, {{"screen", 24, 16}, {"panel", 8, 8}}, test::countingLoader(0));
  std::vector<MaterialEmission> emissions(2);
  emissions[0].image = image;
  emissions[1].material = kPanel;
  emissions[1].texture = texture.name();
  LightSetup setup;
  setup.materialEmissions = emissions;
  const auto frames = [&] {
    for (int i = 0; i < 4; ++i) {
      EXPECT_TRUE(gl.relight(setup));
      EXPECT_TRUE(gl.relight({}));
    }
    glFinish();
  };
  frames();
  test::forgetCalls(0);
  const std::size_t before = test::allocations();
  frames();
  EXPECT_EQ(test::objectsMade(0), 0);
  EXPECT_EQ(test::allocations(), before);
}

}  // namespace
}  // namespace relume
