// SPDX-License-Identifier: MIT
// What OpenGL's splats of radiance records mirror is what the CPU's coefficients do, pixel by pixel.
#include "tools/gl_splat/mirror_splats_gl.h"

#include "bake/preview/place_records.h"
#include "bake/preview/receivers.h"
#include "relume/bake/context.h"
#include "tests/preview/known_light.h"
#include "tests/rays/make_scene.h"
#include "tests/runtime/gl_test_support.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

namespace relume {
namespace {

// A room with a sphere in it, all of which mirrors, in colours that change from place to place.
struct MirrorRoom {
  static constexpr std::uint32_t kColumns = 72, kRows = 48;
  Context context;
  Scene scene;
  std::optional<RayTracer> tracer;
  CameraRays camera;
  std::vector<PixelReceiver> receivers;
  std::vector<MirrorSurface> surfaces;
  std::vector<float> exponents;

  MirrorRoom() : camera(test::lookAt({1.5f, 1.8f, 1.6f}, {-0.5f, 0.6f, -0.6f}, 1.2f), kColumns, kRows) {
    test::addInstance(scene, test::box({-2, 0, -2}, {2, 3, 2}, true));
    test::addInstance(scene, test::box({-1.2f, 0, -1}, {0, 1.1f, 0.2f}, false));
    test::finish(scene);
    tracer.emplace(test::tracerOf(scene));
    receivers = findReceivers(*tracer, camera, context);
    for (std::size_t i = 0; i < receivers.size(); ++i) {
      PixelReceiver& r = receivers[i];
      // Normals that turn, as those of curved surfaces do, so that records are tilted against pixels.
      r.normal = glm::normalize(
          r.normal + 0.12f * glm::vec3(std::sin(3.0f * r.positionWorld.y), std::sin(4.0f * r.positionWorld.z), 0.0f));
      MirrorSurface& s = surfaces.emplace_back();
      s.axis = glm::reflect(glm::normalize(r.positionWorld - camera.origin), r.normal);
      s.normal = r.normal;
      s.exponent = 1.0f + 19.0f * static_cast<float>(i % 97) / 96.0f;
      exponents.push_back(s.exponent);
      if (i % 13 == 0) r.normal = glm::vec3(0.0f);
    }
  }
  static glm::vec3 light(const glm::vec3& p) {
    return glm::vec3(1.0f + std::sin(2.0f * p.x), 1.2f + std::cos(3.0f * p.y), p.z > 0.0f ? 2.0f : 0.1f);
  }
};

struct MirrorDifference {
  double rms = 0.0;
  std::size_t lit = 0, apart = 0, tilted = 0;
};

class MirrorSplats : public test::GlTest {
 protected:
  // By either, of records of an order.
  static MirrorDifference compare(const MirrorRoom& room, MirrorSplatsGl& gl, int order, Interpolation options) {
    Context context;
    const HitRadiance light = test::lightAt(MirrorRoom::light);
    const Sky sky;
    RecordGatherer::Options gathering;
    gathering.rays = 256;
    const RecordGatherer gatherer(*room.tracer, light, sky, gathering);
    const LobeTable lobes(order, LobeKind::mean, context);
    RadianceRecords radiance(gatherer.cells(), lobes, options.accuracy, options.reach);
    const RecordKeeper keeper = radiance.keeper(room.exponents);
    PlacementOptions placement;
    placement.interpolation = options;
    placement.keeper = &keeper;
    std::vector<Record> records;
    placeRecords(gatherer, room.camera, room.receivers, placement, records, context);
    std::vector<MirrorSplat> picture(room.receivers.size());
    const Status ok = gl.draw(room.camera, room.receivers, room.surfaces, records, radiance, options, picture);
    EXPECT_TRUE(ok) << (ok ? "" : ok.error().message);

    const RecordTiles tiles(room.camera, records, options);
    RadianceSplat splat;
    MirrorDifference d;
    double error = 0.0, square = 0.0;
    for (std::uint32_t i = 0; i < picture.size(); ++i) {
      if (room.receivers[i].normal == glm::vec3(0.0f)) {
        EXPECT_EQ(picture[i].weight, 0.0f);
        continue;
      }
      radiance.splat(tiles, records, i % MirrorRoom::kColumns, i / MirrorRoom::kColumns, room.receivers[i], splat);
      if ((splat.weight > 0.0f) != (picture[i].weight > 0.0f)) {
        d.apart += std::max(splat.weight, picture[i].weight) < 1e-4f / options.accuracy ? 0 : 1;
        continue;
      }
      if (!(splat.weight > 0.0f)) continue;
      d.lit += 1;
      for (const RecordTiles::Weighed& w : splat.records) {
        if (glm::dot(records[w.record].normal, room.receivers[i].normal) < 0.9999f) d.tilted += 1;
      }
      // Near the rim a weight is the difference of two numbers of about 1 / accuracy.
      EXPECT_NEAR(splat.weight, picture[i].weight, 1e-4f * splat.weight + 2e-7f / options.accuracy);
      const glm::dvec3 truth = mirroredLight(splat, lobes, room.surfaces[i].exponent, room.surfaces[i].axis);
      const glm::dvec3 difference = glm::dvec3(picture[i].radiance) - truth;
      error += glm::dot(difference, difference);
      square += glm::dot(truth, truth);
    }
    d.rms = std::sqrt(error / square);
    return d;
  }
};

TEST_F(MirrorSplats, areTheCpusAtEveryOrder) {
  const MirrorRoom room;
  for (const int order : {1, 2, 5, 10}) {  // which errs by 1e-7 to 2e-5 on llvmpipe
    auto gl = MirrorSplatsGl::create(EglContext::getProcAddress, order);
    ASSERT_TRUE(gl) << gl.error().message;
    for (const float accuracy : {0.25f, 0.4f}) {
      Interpolation options;
      options.accuracy = accuracy;
      options.gradients = accuracy < 0.3f;
      const MirrorDifference d = compare(room, **gl, order, options);
      EXPECT_LE(d.rms, 1e-3) << order;
      EXPECT_EQ(d.apart, 0u) << order;
      EXPECT_GT(d.lit, 2800u) << order;
      EXPECT_GT(d.tilted, 500u) << order;
      RecordProperty("rms" + std::to_string(order), std::to_string(d.rms));
    }
  }
}

TEST_F(MirrorSplats, sizesAndOrdersThatDoNotFitAreNamed) {
  Context context;
  const auto expectRefusal = [](const Status& status, ErrorCode code, const std::string& part) {
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, code);
    EXPECT_NE(status.error().message.find(part), std::string::npos) << status.error().message;
  };
  for (const int order : {0, 11}) {
    const auto refused = MirrorSplatsGl::create(EglContext::getProcAddress, order);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
  }
  // An OpenGL whose storage buffers hold no more than a record of order 3, and one that has none in fragment shaders.
  const auto small = [](const char* name) -> GlProc {
    if (std::strcmp(name, "glGetInteger64v") != 0) return EglContext::getProcAddress(name);
    return reinterpret_cast<GlProc>(+[](GLenum what, GLint64* value) {
      glGetInteger64v(what, value);
      if (what == GL_MAX_SHADER_STORAGE_BLOCK_SIZE) *value = 500;
    });
  };
  const auto without = [](const char* name) -> GlProc {
    if (std::strcmp(name, "glGetIntegerv") != 0) return EglContext::getProcAddress(name);
    return reinterpret_cast<GlProc>(+[](GLenum what, GLint* value) {
      glGetIntegerv(what, value);
      if (what == GL_MAX_FRAGMENT_SHADER_STORAGE_BLOCKS) *value = 0;
    });
  };
  const auto none = MirrorSplatsGl::create(without, 3);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::unsupported);
  const auto gl = MirrorSplatsGl::create(small, 3);
  ASSERT_TRUE(gl) << gl.error().message;

  const MirrorRoom room;
  const HitRadiance light = test::lightAt(MirrorRoom::light);
  const Sky sky;
  const RecordGatherer gatherer(*room.tracer, light, sky, {});
  const LobeTable three(3, LobeKind::mean, context), two(2, LobeKind::mean, context);
  RadianceRecords radiance(gatherer.cells(), three, 0.25f, RecordReach::guarded),
      other(gatherer.cells(), two, 0.25f, RecordReach::guarded);
  std::vector<MirrorSplat> picture(room.receivers.size());
  const auto draw = [&](const RadianceRecords& by, std::size_t records, std::size_t surfaces) {
    const std::vector<Record> list(records);
    return (*gl)->draw(room.camera, room.receivers, std::span(room.surfaces).first(surfaces), list, by, {}, picture);
  };
  const std::size_t all = room.surfaces.size();
  expectRefusal(draw(radiance, 0, 5), ErrorCode::usage, "5 pixels");
  expectRefusal(draw(other, 0, all), ErrorCode::usage, "order 2, expected 3");
  expectRefusal(draw(radiance, 1, all), ErrorCode::usage, "1 records, and radiance of 0");
  picture[7].weight = 1.0f;
  EXPECT_TRUE(draw(radiance, 0, all)) << "no record is none at any pixel";
  EXPECT_EQ(picture[7].weight, 0.0f);
  radiance.keeper(room.exponents).resize(2);
  expectRefusal(draw(radiance, 2, all), ErrorCode::unsupported, "648 bytes; this OpenGL's storage buffers hold 500");
}

}  // namespace
}  // namespace relume
