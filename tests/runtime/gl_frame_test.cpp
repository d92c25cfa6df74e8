// SPDX-License-Identifier: MIT
// A frame in OpenGL creates no object and allocates nothing on the host once buffers have grown to what it needs.
#include "relume/relighter.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/hot_reload.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

namespace relume {
namespace {

int created = 0;  // GL objects, by the functions that are counted below

// Sets a pointer of epoxy's to a function that counts and calls on, for as long as it lives.
template <class Function>
class Counted;
template <class Result, class... Arguments>
class Counted<Result(GLAPIENTRY*)(Arguments...)> {
 public:
  using Function = Result(GLAPIENTRY*)(Arguments...);
  explicit Counted(Function& pointer) : pointer_(pointer), original_(pointer) {}
  ~Counted() { pointer_ = original_; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;
  void set(Function counting) { pointer_ = counting; }
  Result call(Arguments... arguments) const { return original_(arguments...); }

 private:
  Function& pointer_;
  Function original_;
};

// The function epoxy_glX is replaced within the scope; the name of the variable tells the replacements apart.
#define RELUME_COUNT(name)                                         \
  static Counted<decltype(epoxy_##name)>* name##Counter = nullptr; \
  Counted<decltype(epoxy_##name)> name##Scope(epoxy_##name);       \
  name##Counter = &name##Scope;                                    \
  name##Scope.set([](auto... arguments) {                          \
    ++created;                                                     \
    return name##Counter->call(arguments...);                      \
  })

class GlFrame : public test::GlTest {};

TEST_F(GlFrame, createsNoObjectAndAllocatesNothing) {
  const Bake bake = test::makeSyntheticBake({.surfels = 700, .lightmapCaches = 24, .linksPerCache = 32});
  RelightOptions options;
  options.backend = BackendKind::gl;
  // Called once, epoxy's pointers are the driver's functions.
  GLuint none = 0;
  glGenBuffers(0, &none);
  glGenTextures(0, &none);
  glGenQueries(0, &none);
  glGenFramebuffers(0, &none);
  glGenVertexArrays(0, &none);
  glGenSamplers(0, &none);
  glDeleteShader(glCreateShader(GL_COMPUTE_SHADER));
  glDeleteProgram(glCreateProgram());
  glDeleteSync(glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0));
  RELUME_COUNT(glGenBuffers);
  RELUME_COUNT(glGenTextures);
  RELUME_COUNT(glGenQueries);
  RELUME_COUNT(glGenFramebuffers);
  RELUME_COUNT(glGenVertexArrays);
  RELUME_COUNT(glGenSamplers);
  RELUME_COUNT(glCreateShader);
  RELUME_COUNT(glCreateProgram);
  RELUME_COUNT(glFenceSync);
  Result<Relighter> made = Relighter::create(bake, options);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_GT(created, 10) << "the functions that are counted are not those that are called";
  const std::vector<Light> lights = test::someLights();
  const std::vector<glm::vec3> irradiance(bake.surfels.count(), glm::vec3(0.5f));
  const std::vector<glm::vec3> sky(bake.hierarchy.skyDirection.size(), glm::vec3(0.2f));
  LightSetup byLights, byHost;
  byLights.lights = lights;
  byLights.skyPatches = sky;
  byHost.surfelIrradiance = irradiance;
  const auto frames = [&] {
    for (int i = 0; i < 6; ++i) {
      EXPECT_TRUE(made->relight(byLights));
      EXPECT_TRUE(made->relight(byHost));
      made->gl()->bind();
    }
    glFinish();
  };
  frames();
  created = 0;
  const std::size_t before = test::allocations();
  frames();
  EXPECT_EQ(created, 0);
  EXPECT_EQ(test::allocations(), before);
}

TEST_F(GlFrame, hotReloadHandsTheLightOver) { test::expectLightIsHandedOver(BackendKind::gl); }

}  // namespace
}  // namespace relume
