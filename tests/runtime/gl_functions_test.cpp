// SPDX-License-Identifier: MIT
// OpenGL's functions come from the host, a table per relighter: what happens where the host has none, or not all of
// them, or an older OpenGL; and that relighters of several loaders and contexts keep to their own. In C++ and in C.
#include "runtime/gl/functions.h"

#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "relume/relume.h"
#include "tests/runtime/counting_loader.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/synthetic_bake.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

using test::calls, test::countingLoader, test::forgetCalls, test::objectsDeleted, test::objectsMade;

#define RELUME_GL_NAME(name, NAME) "gl" #name,
const std::vector<std::string> kNames = {RELUME_GL_FUNCTIONS(RELUME_GL_NAME)};
#undef RELUME_GL_NAME

// One that may be written: its surfels lie on an instance.
Bake smallBake() {
  Bake bake = test::makeSyntheticBake({.surfels = 300, .lightmapCaches = 24, .linksPerCache = 16});
  bake.instances = std::vector<BakedInstance>(1);
  bake.caches.lightmap.parts = std::vector<LightmapPart>(1);
  return bake;
}

RelightOptions optionsOf(const GetProcAddress& getProcAddress) {
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = getProcAddress;
  return options;
}

// Two frames under a sun, and what they light.
std::vector<float> light(Relighter& relighter) {
  const Light sun{.kind = LightKind::directional, .intensity = {3, 2, 1}, .direction = {0.6f, -0.8f, 0.0f}};
  LightSetup setup;
  setup.lights = {&sun, 1};
  for (int frame = 0; frame < 2; ++frame) EXPECT_TRUE(relighter.relight(setup));
  std::vector<float> lit = relighter.cacheCoefficients();
  EXPECT_GT(*std::max_element(lit.begin(), lit.end()), 0.0f);
  return lit;
}

class GlFunctions : public test::GlTest {
 protected:
  void SetUp() override {
    test::GlTest::SetUp();
    forgetCalls(0);
    forgetCalls(1);
  }
};

TEST(GlFunctionsWithoutLoader, areAUsageErrorThatNamesLoaders) {
  const Result<Relighter> made = Relighter::create(smallBake(), optionsOf({}));
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::usage);
  for (const char* name :
       {"getProcAddress", "get_proc_address", "glfwGetProcAddress", "SDL_GL_GetProcAddress", "eglGetProcAddress"})
    EXPECT_NE(made.error().message.find(name), std::string::npos) << made.error().message;
  // The CPU backend asks for none.
  RelightOptions cpu = optionsOf([](const char*) -> GlProc { throw 1; });
  cpu.backend = BackendKind::cpu;
  EXPECT_TRUE(Relighter::create(smallBake(), cpu));
}

TEST_F(GlFunctions, missingOnesAreNamedAndNothingIsCalled) {
  const Bake bake = smallBake();
  EXPECT_GT(kNames.size(), 50u);
  for (const std::string& absent : kNames) {
    forgetCalls(0);
    const Result<Relighter> made = Relighter::create(bake, optionsOf([&](const char* name) -> GlProc {
                                                       return name == absent ? nullptr : countingLoader(0)(name);
                                                     }));
    ASSERT_FALSE(made) << absent;
    EXPECT_EQ(made.error().code, ErrorCode::unsupported);
    EXPECT_NE(made.error().message.find("needs " + absent + ","), std::string::npos) << made.error().message;
    // At most the version was asked for.
    EXPECT_EQ(calls(0), absent == "glGetString" ? 0 : 1) << absent;
    EXPECT_EQ(calls(0), calls(0, "glGetString")) << absent;
  }
}

const char* versionText = "";  // what the context below claims to be

// The functions of a context of that version; `asked` gets the names of those that are asked for.
GetProcAddress loaderOfVersion(const char* text, std::vector<std::string>& asked) {
  versionText = text;
  return [&asked](const char* name) -> GlProc {
    asked.emplace_back(name);
    if (asked.back() != "glGetString") return countingLoader(0)(name);
    const PFNGLGETSTRINGPROC getString = [](GLenum) { return reinterpret_cast<const GLubyte*>(versionText); };
    return reinterpret_cast<GlProc>(getString);
  };
}

TEST_F(GlFunctions, ofOlderContextsAreNotAskedFor) {
  for (const char* text : {"4.2.0 vendor", "4.1 Metal - 83", "3.3 (Core Profile) Mesa", "OpenGL ES 3.2 Mesa",
                           "OpenGL ES-CM 1.1", "", "4", "4.", ".5", "-4.5", "vendor 4.6"}) {
    std::vector<std::string> asked;
    const Result<Relighter> made = Relighter::create(smallBake(), optionsOf(loaderOfVersion(text, asked)));
    ASSERT_FALSE(made) << text;
    EXPECT_EQ(made.error().code, ErrorCode::unsupported) << text;
    EXPECT_NE(made.error().message.find("OpenGL 4.3 or newer, found \"" + std::string(text) + "\""), std::string::npos)
        << made.error().message;
    EXPECT_EQ(asked, std::vector<std::string>{"glGetString"});
  }
  EXPECT_EQ(calls(0), 0);
  for (const char* text : {"4.3", "4.3.0 vendor", "4.5 (Core Profile) Mesa 22.3.6", "4.10", "5.0", "10.0 vendor"}) {
    std::vector<std::string> asked;
    const Result<gl::Functions> functions = gl::loadFunctions(loaderOfVersion(text, asked));
    EXPECT_TRUE(functions) << text << ": " << functions.error().message;
    EXPECT_GE(asked.size(), kNames.size());
  }
}

const char* extensionText = "";  // the only one that the context below claims to have

TEST_F(GlFunctions, buffersOfQueriesAreThereByVersionOrExtension) {
  const auto hasThem = [](const char* version, const char* extension) {
    extensionText = extension;
    std::vector<std::string> asked;
    const GetProcAddress ofVersion = loaderOfVersion(version, asked);
    const Result<gl::Functions> functions = gl::loadFunctions([&](const char* name) -> GlProc {
      if (std::string(name) != "glGetStringi") return ofVersion(name);
      const PFNGLGETSTRINGIPROC getString = [](GLenum, GLuint) {
        return reinterpret_cast<const GLubyte*>(extensionText);
      };
      return reinterpret_cast<GlProc>(getString);
    });
    EXPECT_TRUE(functions) << functions.error().message;
    return functions->hasQueryBuffer;
  };
  EXPECT_FALSE(hasThem("4.3", "GL_ARB_query_buffer_object_of_another_kind"));
  EXPECT_TRUE(hasThem("4.3", "GL_ARB_query_buffer_object"));
  EXPECT_TRUE(hasThem("4.4", "GL_other"));
}

TEST_F(GlFunctions, relightersAndFailuresDeleteWhatTheyMake) {
  const Bake bake = smallBake();
  RelightOptions options = optionsOf(countingLoader(0));
  {
    Result<Relighter> made = Relighter::create(bake, options);
    ASSERT_TRUE(made) << made.error().message;
    light(*made);
    EXPECT_GT(objectsMade(0), 20);
    EXPECT_LT(objectsDeleted(0), objectsMade(0));
  }
  EXPECT_EQ(objectsDeleted(0), objectsMade(0));
  forgetCalls(0);
  options.visibilityGlsl = "float relumeVisibility(uint light, vec3 positionWorld, vec3 normal) { return nothing; }";
  const Result<Relighter> broken = Relighter::create(bake, options);
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().code, ErrorCode::failed);
  context_->forgetErrors();
  EXPECT_GT(objectsMade(0), 20);
  EXPECT_EQ(objectsDeleted(0), objectsMade(0));
}

TEST_F(GlFunctions, ofTwoLoadersAndTwoContextsStayApart) {
  const Bake bake = smallBake();
  Result<EglContext> second = EglContext::create({.debug = true});
  ASSERT_TRUE(second) << second.error().message;
  Result<Relighter> there = Relighter::create(bake, optionsOf(countingLoader(1)));
  ASSERT_TRUE(there) << there.error().message;
  EXPECT_EQ(calls(0), 0);
  ASSERT_TRUE(context_->makeCurrent());
  const int before = calls(1);
  std::vector<float> lit;
  {
    Result<Relighter> here = Relighter::create(bake, optionsOf(countingLoader(0)));
    ASSERT_TRUE(here) << here.error().message;
    lit = light(*here);
    EXPECT_GT(calls(0), 0);
    EXPECT_EQ(calls(1), before);
  }
  // The one that is left has its functions still.
  forgetCalls(0);
  ASSERT_TRUE(second->makeCurrent());
  EXPECT_EQ(light(*there), lit);
  EXPECT_GT(calls(1), before);
  { const Relighter ended = std::move(*there); }
  EXPECT_EQ(objectsDeleted(1), objectsMade(1));
  EXPECT_EQ(calls(0), 0);
  EXPECT_EQ(second->errorCount(), 0) << second->lastError();
  ASSERT_TRUE(context_->makeCurrent());
}

std::vector<GLenum> pendingErrors;  // of the OpenGL below, the first one first
PFNGLBUFFERDATAPROC bufferData = nullptr;
bool isOutOfMemory = false;

GlProc errorLoader(const char* name) {
  const std::string n = name;
  const GlProc own = countingLoader(0)(name);
  if (n == "glGetError") {
    return reinterpret_cast<GlProc>(+[]() -> GLenum {
      if (pendingErrors.empty()) return GL_NO_ERROR;
      const GLenum first = pendingErrors.front();
      pendingErrors.erase(pendingErrors.begin());
      return first;
    });
  }
  if (n != "glBufferData") return own;
  bufferData = reinterpret_cast<PFNGLBUFFERDATAPROC>(own);
  return reinterpret_cast<GlProc>(+[](GLenum target, GLsizeiptr size, const void* data, GLenum usage) {
    if (isOutOfMemory) pendingErrors.push_back(GL_OUT_OF_MEMORY);
    bufferData(target, size, data, usage);
  });
}

// Errors that the host has left are not the backend's, and hide none of its own.
TEST_F(GlFunctions, errorsOfTheHostAreNotTakenForOnesOwn) {
  pendingErrors = {GL_OUT_OF_MEMORY};
  isOutOfMemory = false;
  const Result<Relighter> made = Relighter::create(smallBake(), optionsOf(errorLoader));
  EXPECT_TRUE(made) << made.error().message;
  pendingErrors = {GL_INVALID_ENUM, GL_INVALID_OPERATION};
  isOutOfMemory = true;
  const Result<Relighter> refused = Relighter::create(smallBake(), optionsOf(errorLoader));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
  EXPECT_NE(refused.error().message.find("not enough memory"), std::string::npos) << refused.error().message;
  pendingErrors.clear();
  isOutOfMemory = false;
}

PFNGLGETINTEGER64VPROC getInteger64 = nullptr;

// What a frame hands over is bound as well.
TEST_F(GlFunctions, framesOfMoreThanTheDriverBindsAreRefusedByName) {
  constexpr GLint64 kMost = 1 << 16;
  const Bake bake = test::makeSyntheticBake({.surfels = 2200, .lightmapCaches = 24, .linksPerCache = 16});
  const auto loader = [](const char* name) -> GlProc {
    const GlProc own = countingLoader(0)(name);
    if (std::string(name) != "glGetInteger64v") return own;
    getInteger64 = reinterpret_cast<PFNGLGETINTEGER64VPROC>(own);
    return reinterpret_cast<GlProc>(+[](GLenum what, GLint64* value) {
      getInteger64(what, value);
      if (what == GL_MAX_SHADER_STORAGE_BLOCK_SIZE) *value = kMost;
    });
  };
  Result<Relighter> made = Relighter::create(bake, optionsOf(loader));
  ASSERT_TRUE(made) << made.error().message;
  const std::vector<float> before = light(*made);
  const auto refused = [&](const LightSetup& setup, const char* what) {
    for (const Status& status : {made->check(setup), made->relight(setup)}) {
      ASSERT_FALSE(status) << what;
      EXPECT_EQ(status.error().code, ErrorCode::unsupported);
      EXPECT_NE(status.error().message.find(what), std::string::npos) << status.error().message;
    }
    EXPECT_EQ(made->cacheCoefficients(), before);
  };
  const std::vector<Light> many(kMost / 48 + 1, Light{.kind = LightKind::directional});
  const std::vector<glm::vec3> colors(bake.surfels.count(), glm::vec3(1.0f));
  LightSetup lights, arrays, one;
  lights.lights = many;
  arrays.surfelIrradiance = arrays.surfelEmission = one.surfelIrradiance = colors;
  refused(lights, "its lights take");
  refused(arrays, "its colours of surfels and sky take");
  EXPECT_TRUE(made->relight(one));
}

// ---- relume.h

class GlFunctionsInC : public GlFunctions {
 protected:
  void SetUp() override {
    GlFunctions::SetUp();
    if (IsSkipped()) return;
    Result<std::vector<std::byte>> bytes = serializeBake(source_);
    ASSERT_TRUE(bytes) << bytes.error().message;
    bytes_ = std::move(*bytes);
    relume_context_desc desc{};
    desc.struct_size = sizeof desc;
    desc.api_version = RELUME_API_VERSION;
    ASSERT_EQ(relume_context_create(&desc, &host_), RELUME_OK);
    ASSERT_EQ(relume_bake_from_memory(host_, bytes_.data(), bytes_.size(), nullptr, nullptr, &bake_), RELUME_OK);
    desc_.struct_size = sizeof desc_;
    desc_.backend = RELUME_BACKEND_GL;
    desc_.get_proc_address = [](void* user, const char* name) -> relume_gl_proc {
      const auto& absent = *static_cast<const std::string*>(user);
      return name == absent ? nullptr : countingLoader(0)(name);
    };
    desc_.get_proc_address_user = &absent_;
  }
  void TearDown() override {
    relume_relighter_destroy(relighter_);
    relume_bake_destroy(bake_);
    relume_context_destroy(host_);
    GlFunctions::TearDown();
  }

  Bake source_ = smallBake();
  std::vector<std::byte> bytes_;
  std::string absent_ = "glNothing";
  relume_context* host_ = nullptr;
  relume_bake* bake_ = nullptr;
  relume_relighter* relighter_ = nullptr;
  relume_relighter_desc desc_{};
};

TEST_F(GlFunctionsInC, light) {
  ASSERT_EQ(relume_relighter_create(bake_, &desc_, &relighter_), RELUME_OK) << relume_bake_error(bake_);
  const relume_light sun = {RELUME_DIRECTIONAL, {3, 2, 1}, {}, {0.6f, -0.8f, 0.0f}, 0, 0, 0};
  relume_light_setup setup;
  relume_light_setup_default(&setup, sizeof setup);
  setup.lights = &sun;
  setup.light_count = 1;
  forgetCalls(0);
  for (int frame = 0; frame < 2; ++frame) ASSERT_EQ(relume_relight(relighter_, &setup), RELUME_OK);
  EXPECT_GT(calls(0, "glDispatchCompute"), 0);
  EXPECT_EQ(relume_gl_bind_resolve(relighter_), RELUME_OK);
  std::vector<float> found(relume_coefficients_per_cache(relighter_) * source_.caches.count());
  ASSERT_EQ(relume_cache_coefficients(relighter_, found.data(), found.size() * sizeof(float)), RELUME_OK);
  Result<Relighter> expected = Relighter::create(source_, optionsOf(EglContext::getProcAddress));
  ASSERT_TRUE(expected) << expected.error().message;
  EXPECT_EQ(found, light(*expected));
}

TEST_F(GlFunctionsInC, missingOnesAreNamed) {
  absent_ = "glDispatchCompute";
  EXPECT_EQ(relume_relighter_create(bake_, &desc_, &relighter_), RELUME_ERROR_UNSUPPORTED);
  EXPECT_EQ(relighter_, nullptr);
  EXPECT_NE(std::string(relume_bake_error(bake_)).find("needs glDispatchCompute,"), std::string::npos)
      << relume_bake_error(bake_);
  EXPECT_EQ(objectsMade(0), 0);
}

TEST_F(GlFunctionsInC, missingLoadersAreUsageErrors) {
  const auto refused = [&] {
    EXPECT_EQ(relume_relighter_create(bake_, &desc_, &relighter_), RELUME_ERROR_USAGE);
    EXPECT_EQ(relighter_, nullptr);
    EXPECT_NE(std::string(relume_bake_error(bake_)).find("get_proc_address"), std::string::npos)
        << relume_bake_error(bake_);
  };
  // A host whose header ends before the field is taken as one that leaves it out.
  desc_.struct_size = offsetof(relume_relighter_desc, get_proc_address);
  refused();
  desc_.struct_size = sizeof desc_;
  desc_.get_proc_address = nullptr;
  refused();
  desc_.backend = RELUME_BACKEND_CPU;
  EXPECT_EQ(relume_relighter_create(bake_, &desc_, &relighter_), RELUME_OK);
}

}  // namespace
}  // namespace relume
