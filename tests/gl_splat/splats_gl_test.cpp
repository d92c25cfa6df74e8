// SPDX-License-Identifier: MIT
// Splats that OpenGL draws are those of the CPU's tiles, pixel by pixel.
#include "tools/gl_splat/splats_gl.h"

#include "tests/gl_splat/splat_view.h"
#include "tests/runtime/gl_test_support.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/packing.hpp>

#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

using test::compareSplats, test::SplatDifference, test::splatByCpu, test::SplatView, test::strewn;

class SplatsOfGl : public test::GlTest {
 protected:
  static std::unique_ptr<SplatsGl> make(bool packed = false) {
    auto made = SplatsGl::create({EglContext::getProcAddress, packed});
    EXPECT_TRUE(made) << made.error().message;
    return std::move(*made);
  }
};

std::vector<Splat> pictureOf(SplatsGl& gl, std::size_t pixels) {
  std::vector<Splat> picture(pixels);
  const Status ok = gl.read(picture);
  EXPECT_TRUE(ok) << ok.error().message;
  return picture;
}

std::vector<Splat> drawn(SplatsGl& gl, const SplatView& view, std::span<const Record> records,
                         const Interpolation& options) {
  for (const Status& ok : {gl.look(view.rays, view.receivers), gl.draw(records, options)})
    EXPECT_TRUE(ok) << ok.error().message;
  return pictureOf(gl, view.receivers.size());
}

bool isSame(std::span<const Splat> a, std::span<const Splat> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Splat& x, const Splat& y) {
    return x.reflected == y.reflected && x.sky == y.sky && x.weight == y.weight;
  });
}

void expectAlike(const SplatDifference& d, const std::string& what) {
  EXPECT_LE(d.rms, 1e-5) << what;
  EXPECT_LE(d.largest, 1e-4) << what;
  EXPECT_LE(d.weight, 1e-4) << what;
  EXPECT_EQ(d.apart, 0u) << what;
  EXPECT_LE(d.ties, 1 + d.lit / 1000) << what;
}

TEST_F(SplatsOfGl, areTheCpusAtEverySizeAndCount) {
  const auto gl = make();
  const Interpolation options;
  std::size_t lit = 0;
  for (const auto& [width, height] : {std::pair{64u, 36u}, {1u, 1u}, {333u, 187u}, {17u, 400u}, {8u, 8u}}) {
    const SplatView view(width, height);
    for (const std::size_t count : {0u, 1u, 37u, 1500u}) {
      const std::vector<Record> records = strewn(view, count);
      const SplatDifference d =
          compareSplats(splatByCpu(view, records, options), drawn(*gl, view, records, options), options);
      expectAlike(d, std::to_string(width) + " x " + std::to_string(height) + ", " + std::to_string(count));
      lit += d.lit;
    }
  }
  EXPECT_GT(lit, 50000u);
}

TEST_F(SplatsOfGl, areTheCpusByEveryKindOfWeightReachAndGradient) {
  const auto gl = make();
  for (const bool orthographic : {false, true}) {
    const SplatView view(96, 54, orthographic);
    const std::vector<Record> records = strewn(view, 400);
    for (const RecordWeight weight : {RecordWeight::smooth, RecordWeight::ward, RecordWeight::tabellion}) {
      for (const RecordReach reach : {RecordReach::guarded, RecordReach::printed}) {
        for (const float accuracy : {0.05f, 0.15f, 0.5f, 2.0f}) {
          Interpolation options;
          options.weight = weight;
          options.reach = reach;
          options.accuracy = accuracy;
          options.gradients = accuracy != 0.15f || reach == RecordReach::printed;
          options.limits = accuracy < 1.0f;
          const SplatDifference d =
              compareSplats(splatByCpu(view, records, options), drawn(*gl, view, records, options), options);
          expectAlike(d, std::to_string(static_cast<int>(weight)) + " " + std::to_string(static_cast<int>(reach)) +
                             " " + std::to_string(accuracy));
          EXPECT_GT(d.lit, 500u);
        }
      }
    }
  }
}

// One record at a time, where its sphere leaves the picture, lies behind the eye or has the eye in it.
TEST_F(SplatsOfGl, ofSpheresBesideBehindAndAroundTheEyeAreTheCpus) {
  const auto gl = make();
  const SplatView view(96, 54);
  const CameraRays& rays = view.rays;
  const glm::vec3 &eye = rays.origin, ahead = rays.forward, right = glm::normalize(rays.right);
  struct Place {
    glm::vec3 position;
    float distance;
    bool isSeen;
  };
  const Place places[] = {{eye + 0.02f * ahead, 1000.0f, true},  // around the eye
                          {eye - 0.5f * ahead, 1000.0f, true},   // around it, its middle behind
                          {eye - 0.5f * ahead, 0.5f, false},     // behind it
                          {eye + 3.0f * ahead, 0.0f, false},     // too small for its pixel's centre
                          {view.receivers[0].positionWorld, 8.0f, true},
                          {view.receivers[95].positionWorld, 8.0f, true},
                          {view.receivers.back().positionWorld, 8.0f, true},
                          {view.receivers[53 * 96].positionWorld - 0.1f * right, 8.0f, true}};
  Interpolation options;
  options.reach = RecordReach::printed;
  options.minPixels = 0.0f;
  for (const Place& place : places) {
    Record record = strewn(view, 1).front();
    record.positionWorld = place.position;
    record.distance = record.nearest = place.distance;
    record.footprint = 0.01f;
    std::size_t lit = 0;
    for (const glm::vec3& normal : {glm::vec3(0, 1, 0), glm::vec3(1, 0, 0), glm::vec3(-1, 0, 0), glm::vec3(0, 0, 1)}) {
      record.normal = normal;
      const SplatDifference d =
          compareSplats(splatByCpu(view, {&record, 1}, options), drawn(*gl, view, {&record, 1}, options), options);
      expectAlike(d, std::to_string(&place - places));
      lit += d.lit;
    }
    EXPECT_EQ(lit > 0, place.isSeen) << &place - places;
  }
}

TEST_F(SplatsOfGl, readLightForBentNormals) {
  const auto gl = make();
  SplatView view(80, 45);
  for (std::size_t i = 0; i < view.receivers.size(); i += 2) {
    PixelReceiver& r = view.receivers[i];
    if (r.normal != glm::vec3(0.0f)) r.bent = glm::normalize(r.normal + glm::vec3(0.3f, -0.2f, 0.25f));
  }
  const std::vector<Record> records = strewn(view, 400);
  const std::vector<Splat> bent = splatByCpu(view, records, {});
  expectAlike(compareSplats(bent, drawn(*gl, view, records, {}), {}), "bent");
  const SplatView straight(80, 45);
  EXPECT_GT(compareSplats(bent, splatByCpu(straight, records, {}), {}).rms, 0.01);
  // And no more where none is.
  expectAlike(compareSplats(splatByCpu(straight, records, {}), drawn(*gl, straight, records, {}), {}), "straight");
}

// What is no number, no place and no size lights what it lights on the CPU, and nothing hangs.
TEST_F(SplatsOfGl, ofHostileRecordsAreTheCpus) {
  const auto gl = make();
  const SplatView view(64, 36);
  std::vector<Record> records = strewn(view, 300);
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  records[1].positionWorld.x = kNaN;
  records[2].positionWorld = glm::vec3(kInf);
  records[5].normal = glm::vec3(kNaN);
  records[6].distance = kNaN;
  records[9].distance = 0.0f;
  records[10].footprint = 0.0f;
  records[13].footprint = kNaN;
  records[14].reflected.vector[1].y = kNaN;
  records[17].sky.gradient[2].x = kNaN;
  records[18].positionWorld = glm::vec3(3e38f);
  records[21].normal = glm::vec3(0.0f);
  const SplatDifference d = compareSplats(splatByCpu(view, records, {}), drawn(*gl, view, records, {}), {});
  expectAlike(d, "hostile");
  EXPECT_GT(d.lit, 1000u);
}

TEST_F(SplatsOfGl, thatAreAddedAreAsDrawnAtOnce) {
  const auto gl = make();
  const SplatView view(120, 70);
  const std::vector<Record> records = strewn(view, 5000);
  const std::span<const Record> all = records;
  const std::vector<Splat> atOnce = drawn(*gl, view, all, {});
  ASSERT_TRUE(gl->draw(all.first(10), {}));
  std::size_t sent = 0;
  for (const auto& [first, count] : {std::pair{10u, 1u}, {11u, 989u}, {1000u, 100u}, {1100u, 3900u}}) {
    ASSERT_TRUE(gl->add(all.subspan(first, count)));
    sent = gl->sentBytes();
  }
  EXPECT_GE(sent, 3900u * sizeof(float) * 36);
  EXPECT_TRUE(isSame(atOnce, pictureOf(*gl, view.receivers.size())));
}

// Coefficients alone go to OpenGL: nine vec4 a record, and nothing of the picture.
TEST_F(SplatsOfGl, thatAreRelitAreAsDrawnInThatLight) {
  const auto gl = make();
  const SplatView view(120, 70);
  std::vector<Record> records = strewn(view, 2000);
  const std::vector<Splat> before = drawn(*gl, view, records, {});
  test::shine(records, 99);
  ASSERT_TRUE(gl->relight(records));
  EXPECT_EQ(gl->sentBytes(), records.size() * 9 * 16);
  const std::vector<Splat> relit = pictureOf(*gl, view.receivers.size());
  EXPECT_GT(compareSplats(before, relit, {}).rms, 0.1);
  EXPECT_TRUE(isSame(relit, drawn(*gl, view, records, {})));
  expectAlike(compareSplats(splatByCpu(view, records, {}), relit, {}), "relit");
  // Into the dark, without a sky, and back.
  std::vector<Record> dark = records;
  for (Record& record : dark) record.reflected = record.sky = {};
  ASSERT_TRUE(gl->relight(dark));
  for (const Splat& splat : pictureOf(*gl, view.receivers.size())) {
    EXPECT_EQ(splat.reflected, glm::vec3(0.0f));
    EXPECT_EQ(splat.sky, glm::vec3(0.0f));
  }
  ASSERT_TRUE(gl->relight(records));
  EXPECT_TRUE(isSame(relit, pictureOf(*gl, view.receivers.size())));
}

TEST_F(SplatsOfGl, pixelsThatLoseTheirRecordsKeepWhatTheyShow) {
  const auto gl = make();
  const SplatView view(64, 36);
  const std::vector<Record> records = strewn(view, 300);
  const std::vector<Splat> before = drawn(*gl, view, records, {});
  const std::span<const Record> few = std::span(records).first(20);
  ASSERT_TRUE(gl->draw(few, {}));
  const std::vector<Splat> after = pictureOf(*gl, view.receivers.size()), alone = splatByCpu(view, few, {});
  std::size_t kept = 0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    if (alone[i].weight > 0.0f || !(before[i].weight > 0.0f)) continue;
    EXPECT_EQ(after[i].reflected, before[i].reflected);
    ++kept;
  }
  EXPECT_GT(kept, 100u);
  ASSERT_TRUE(gl->draw({}, {}));
  EXPECT_TRUE(isSame(after, pictureOf(*gl, view.receivers.size())));
  // Another look is dark.
  ASSERT_TRUE(gl->look(view.rays, view.receivers));
  for (const Splat& splat : pictureOf(*gl, view.receivers.size())) EXPECT_EQ(splat.weight, 0.0f);
}

// Light and normal as one texture, for shaders that read between pixels.
TEST_F(SplatsOfGl, packedHaveTheSumOfLightAndTheNormal) {
  const auto gl = make(true);
  const SplatView view(64, 36);
  const std::vector<Record> records = strewn(view, 300);
  ASSERT_TRUE(gl->look(view.rays, view.receivers));
  ASSERT_TRUE(gl->draw(records, {}));
  const std::vector<Splat> cpu = splatByCpu(view, records, {});
  std::vector<glm::uvec4> light(cpu.size());
  std::vector<glm::vec4> place(cpu.size());
  glBindTexture(GL_TEXTURE_2D, gl->light());
  glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA_INTEGER, GL_UNSIGNED_INT, light.data());
  glBindTexture(GL_TEXTURE_2D, gl->place());
  glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, place.data());
  std::size_t lit = 0;
  for (std::size_t i = 0; i < cpu.size(); ++i) {
    const PixelReceiver& r = view.receivers[i];
    EXPECT_EQ(place[i], glm::vec4(r.positionWorld, r.footprint));
    if (!(cpu[i].weight > 1e-3f)) continue;
    ++lit;
    const glm::vec4 facing = glm::unpackSnorm4x8(light[i].w);
    EXPECT_EQ(facing.w, 1.0f);
    EXPECT_LT(glm::distance(glm::vec3(facing), r.normal), 0.01f);
    const glm::vec3 e = cpu[i].reflected + cpu[i].sky;
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(std::bit_cast<float>(light[i][c]), e[c], 1e-3f * (glm::length(e) + 1e-3f)) << i;
  }
  EXPECT_GT(lit, 1000u);
  EXPECT_GT(gl->sizeBytes(), cpu.size() * 4 * 16);
  std::vector<Splat> picture(cpu.size());
  const Status refused = gl->read(picture);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
}

}  // namespace
}  // namespace relume
