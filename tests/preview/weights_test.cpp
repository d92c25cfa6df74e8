// SPDX-License-Identifier: MIT
#include "bake/preview/weights.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <cmath>

namespace relume {
namespace {

Record recordAt(const glm::vec3& position, float distance) {
  Record record;
  record.positionWorld = position;
  record.normal = {0, 0, 1};
  record.distance = distance;
  record.nearest = 0.5f * distance;
  record.footprint = 1e-4f;
  return record;
}

Interpolation with(RecordWeight weight, float accuracy = 0.2f) {
  Interpolation options;
  options.weight = weight;
  options.accuracy = accuracy;
  options.maxPixels = 1e6f;
  return options;
}

// RCS Eqs. (2) and (3): the printed weight where it is at least 1 / a, nothing where it is not.
TEST(RecordWeight, wardIsThePapers) {
  const Record record = recordAt({1, 2, 3}, 2.0f);
  const Interpolation options = with(RecordWeight::ward);
  const float reach = reachOf(record, options);
  EXPECT_FLOAT_EQ(reach, 0.4f);
  for (const float away : {0.05f, 0.2f, 0.35f, 0.45f}) {
    for (const float angle : {0.0f, 0.1f, 0.3f}) {
      const glm::vec3 n(std::sin(angle), 0, std::cos(angle));
      const float printed = 1.0f / (away / 2.0f + std::sqrt(1.0f - std::cos(angle)));
      const float expected = printed >= 1.0f / options.accuracy ? printed : 0.0f;
      EXPECT_NEAR(weightOf(record, reach, {{1, 2 + away, 3}, n, n, 1e-4f}, options), expected, 2e-3f * printed)
          << away << ' ' << angle;
    }
  }
  // At the record itself it is that of a tenth of the way.
  const glm::vec3 up(0, 0, 1);
  EXPECT_NEAR(weightOf(record, reach, {{1, 2, 3}, up, up, 1e-4f}, options), 50.0f, 0.1f);
}

TEST(RecordWeight, smoothAndTabellionEndInZero) {
  const glm::vec3 up(0, 0, 1);
  for (const RecordWeight weight : {RecordWeight::smooth, RecordWeight::tabellion}) {
    const Record record = recordAt({0, 0, 0}, 2.0f);
    const Interpolation options = with(weight);
    const float reach = reachOf(record, options);
    float last = INFINITY;
    for (int i = 1; i <= 100; ++i) {
      const float w = weightOf(record, reach, {{reach * 0.01f * static_cast<float>(i), 0, 0}, up, up, 1e-4f}, options);
      if (i > 10 || weight == RecordWeight::tabellion)
        EXPECT_LT(w, last);
      else
        EXPECT_LE(w, last);
      last = w;
    }
    EXPECT_NEAR(last, 0.0f, 1e-4f);
    EXPECT_EQ(weightOf(record, reach, {{reach * 1.001f, 0, 0}, up, up, 1e-4f}, options), 0.0f);
  }
}

TEST(RecordWeight, whatLiesBehindOrFacesAwayReadsNothing) {
  const Record record = recordAt({0, 0, 0}, 2.0f);
  const glm::vec3 up(0, 0, 1);
  for (const RecordWeight weight : {RecordWeight::smooth, RecordWeight::ward, RecordWeight::tabellion}) {
    const Interpolation options = with(weight);
    const float reach = reachOf(record, options);
    EXPECT_GT(weightOf(record, reach, {{0.1f, 0, 0.05f}, up, up, 1e-4f}, options), 0.0f);
    EXPECT_EQ(weightOf(record, reach, {{0.1f, 0, -0.2f}, up, up, 1e-4f}, options), 0.0f);
    EXPECT_EQ(weightOf(record, reach, {{0.01f, 0, 0}, -up, -up, 1e-4f}, options), 0.0f);
  }
}

// A record that sees far does not know of what is close to a receiver.
TEST(RecordWeight, aReceiverInACornerReadsRecordsOfTheCornerOnly) {
  const glm::vec3 up(0, 0, 1);
  const Interpolation options = with(RecordWeight::smooth);
  const Record far = recordAt({0, 0, 0}, 2.0f), near = recordAt({0, 0, 0}, 0.3f);
  PixelReceiver receiver{{0.04f, 0, 0}, up, up, 1e-4f};
  EXPECT_GT(weightOf(far, reachOf(far, options), receiver, options), 0.0f);
  receiver.occluder = 0.1f;
  EXPECT_EQ(weightOf(far, reachOf(far, options), receiver, options), 0.0f);
  EXPECT_GT(weightOf(near, reachOf(near, options), receiver, options), 0.0f);
}

// RCS Eqs. (2) to (4) know neither what lies behind a record nor what is close to a receiver, nor a largest splat.
TEST(RecordWeight, aPrintedReachIsEquationFourAlone) {
  const glm::vec3 up(0, 0, 1);
  Interpolation options;
  options.weight = RecordWeight::ward;
  options.reach = RecordReach::printed;
  Record record = recordAt({0, 0, 0}, 2.0f);
  const float reach = reachOf(record, options);
  EXPECT_FLOAT_EQ(reach, 0.3f) << "3000 pixels";
  const PixelReceiver behind{{0.1f, 0, -0.15f}, up, up, 1e-4f, 0.01f};
  EXPECT_NEAR(weightOf(record, reach, behind, options), 2.0f / std::hypot(0.1f, 0.15f), 1e-3f);
  options.reach = RecordReach::guarded;
  EXPECT_FLOAT_EQ(reachOf(record, options), 0.0064f);
  EXPECT_EQ(weightOf(record, reach, behind, options), 0.0f);
  // Far from everything a record reaches all, near to something as many pixels as are asked for.
  options.reach = RecordReach::printed;
  record.distance = INFINITY;
  EXPECT_FLOAT_EQ(reachOf(record, options), 100.0f);
  EXPECT_EQ(gradientShare(record, reachOf(record, options), options), 1.0f);
  record.distance = 1e-4f;
  options.minPixels = 10.0f;
  EXPECT_FLOAT_EQ(reachOf(record, options), 1e-3f);
}

TEST(RecordWeight, reachIsBetweenPixelsAndLimits) {
  Interpolation options;
  Record record = recordAt({0, 0, 0}, 1.0f);
  record.footprint = 0.01f;
  EXPECT_FLOAT_EQ(reachOf(record, options), 0.15f);
  record.limit = 0.1f;
  EXPECT_FLOAT_EQ(reachOf(record, options), 0.1f);
  options.limits = false;
  EXPECT_FLOAT_EQ(reachOf(record, options), 0.15f);
  record.distance = 1e-9f;
  EXPECT_FLOAT_EQ(reachOf(record, options), 0.015f);
  EXPECT_LT(gradientShare(record, reachOf(record, options), options), 1e-6f);
  record.distance = INFINITY;
  EXPECT_FLOAT_EQ(reachOf(record, options), 0.64f);
  EXPECT_EQ(gradientShare(record, reachOf(record, options), options), 1.0f);
}

}  // namespace
}  // namespace relume
