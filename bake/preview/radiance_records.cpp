// SPDX-License-Identifier: MIT
// See radiance_records.h.
#include "bake/preview/radiance_records.h"

#include "formats/frame_about.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr float kSlopeShare =
    0.5f;  // of |light| / |gradient|: a lobe reads a part of the light, and parts change faster
constexpr float kUntilted = 1e-4f;    // sine of an angle between normals that counts as none
constexpr float kLeastShare = 0.25f;  // of a lobe that must be seen: less is not made up for

// Norm of a record's light or of its gradient as a lobe sees it: three channels of coefficients times their shares.
float normOf(std::span<const float> values, std::span<const float> shares) {
  double sum = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double value = values[i] * shares[i % shares.size()];
    sum += value * value;
  }
  return static_cast<float>(std::sqrt(sum));
}

// What lobes along the normal have of each band, as root mean square of its functions.
std::vector<float> sharesOf(const LobeTable& lobes, float exponent) {
  const auto order = static_cast<std::size_t>(lobes.order());
  std::vector<float> c(order * order), shares(order * order);
  lobes.evaluate(exponent, {0, 0, 1}, c);
  for (std::size_t l = 0; l < order; ++l) {
    const float share = std::abs(c[l * l + l]) / std::sqrt(static_cast<float>(2 * l + 1));
    for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i) shares[i] = share;
  }
  return shares;
}

// The largest angle between normals at which weightOf() is more than 0.
int maxTiltOf(float accuracy) {
  return static_cast<int>(std::ceil(glm::degrees(std::acos(std::max(0.0f, 1.0f - accuracy * accuracy)))));
}

}  // namespace

// What an order leaves of a mean lobe up to 30 degrees from the normal is at most 3 % of it (docs/notes/preview.md): 5
// carries an exponent of 1, 6 of 3.4, 8 of 8, 9 of 15 and 10 of 20.
int hshOrderOf(float exponent) {
  const float n = std::clamp(exponent, 1.0f, kMaxRecordExponent);
  return std::min(kMaxHshOrder, static_cast<int>(std::ceil(2.4f + 1.7f * std::sqrt(n))));
}

RadianceRecords::RadianceRecords(const HemisphereCells& cells, const LobeTable& lobes, float accuracy,
                                 RecordReach reach)
    : cells_(cells),
      tables_(hshCells(cells, lobes.order())),
      tilt_(lobes.order(), maxTiltOf(accuracy)),
      lobes_(lobes),
      reach_(reach) {}

RecordKeeper RadianceRecords::keeper(std::span<const float> exponents) {
  return {
      [this](std::size_t records) {
        frames_.resize(records);
        coefficients_.resize(records * hshRecordSize(order()));
      },
      [this, exponents](std::size_t index, std::size_t pixel, Record& record, const RecordGatherer::Scratch& scratch) {
        std::vector<glm::vec3> radiance(cells_.count());
        for (std::size_t i = 0; i < radiance.size(); ++i) radiance[i] = scratch.reflected[i] + scratch.sky[i];
        const std::size_t each = hshRecordSize(order());
        const std::span<float> sums = std::span(coefficients_).subspan(index * each, each);
        sumHshCells(cells_, tables_, radiance, scratch.distance, sums);
        frames_[index] = scratch.frame;
        if (reach_ == RecordReach::printed) return;
        // What is mirrored may change faster than all that arrives together.
        const std::vector<float> shares = sharesOf(lobes_, exponents[pixel]);
        const float slope = normOf(sums.subspan(3 * size()), shares);
        if (slope > 0.0f)
          record.distance = std::min(record.distance, kSlopeShare * normOf(sums.first(3 * size()), shares) / slope);
      }};
}

void RadianceRecords::splat(const RecordTiles& tiles, std::span<const Record> records, std::uint32_t x, std::uint32_t y,
                            const PixelReceiver& receiver, RadianceSplat& sums) const {
  sums.weight = 0.0f;
  sums.frame = frameAbout(receiver.normal);
  sums.light.assign(3 * size(), 0.0f);
  sums.uniform.assign(size(), 0.0f);
  sums.turned.resize(size());
  sums.tilted.resize(size());
  tiles.weigh(x, y, receiver, sums.records);
  for (const RecordTiles::Weighed& weighed : sums.records) add(records[weighed.record], weighed, sums);
  if (!(sums.weight > 0.0f)) return;
  for (float& value : sums.light) value /= sums.weight;
  for (float& value : sums.uniform) value /= sums.weight;
}

void RadianceRecords::add(const Record& record, const RecordTiles::Weighed& weighed, RadianceSplat& sums) const {
  const std::size_t n = size(), each = hshRecordSize(order());
  const float* c = &coefficients_[weighed.record * each];
  const glm::mat3& from = frames_[weighed.record];
  const glm::vec2 offset(glm::dot(weighed.offset, from[0]), glm::dot(weighed.offset, from[1]));

  // Toward where the receiver's normal leans: +X of both frames, between which there is then a tilt about +Y alone.
  const float cosine = std::clamp(glm::dot(record.normal, sums.frame[2]), -1.0f, 1.0f);
  const glm::vec3 across = sums.frame[2] - cosine * record.normal;
  const float sine = glm::length(across);
  const bool tilts = sine > kUntilted;
  const glm::vec3 lean =
      tilts ? across / sine : glm::normalize(sums.frame[0] - record.normal * glm::dot(sums.frame[0], record.normal));
  const glm::vec3 leanHere = tilts ? cosine * lean - sine * record.normal : sums.frame[0];
  const glm::vec2 turn(glm::dot(lean, from[0]), glm::dot(lean, from[1]));
  const glm::vec2 back(glm::dot(leanHere, sums.frame[0]), glm::dot(leanHere, sums.frame[1]));
  const float angle = std::atan2(sine, cosine);

  const auto addTurned = [&](std::span<float> turned, std::span<float> sum) {
    if (tilts) {
      tilt_.apply(angle, turned, sums.tilted);
      turned = sums.tilted;
    }
    turnHsh(order(), back.x, -back.y, turned);
    for (std::size_t i = 0; i < n; ++i) sum[i] += weighed.weight * turned[i];
  };
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const float *value = c + channel * n, *t = value + 3 * n, *b = value + 6 * n;
    for (std::size_t i = 0; i < n; ++i) sums.turned[i] = value[i] + offset.x * t[i] + offset.y * b[i];
    turnHsh(order(), turn.x, turn.y, sums.turned);
    addTurned(sums.turned, std::span(sums.light).subspan(channel * n, n));
  }
  // Of a uniform world, a record in its own frame has nothing but the first function: 1 over its value, times 2 pi of
  // its square's integral.
  std::fill(sums.turned.begin(), sums.turned.end(), 0.0f);
  sums.turned[0] = std::sqrt(2.0f * std::numbers::pi_v<float>);
  addTurned(sums.turned, sums.uniform);
  sums.weight += weighed.weight;
}

glm::vec3 mirroredLight(const RadianceSplat& splat, const LobeTable& lobes, float exponent, const glm::vec3& axis) {
  std::array<float, kMaxHshCoefficients> c{};
  lobes.evaluate(exponent, axis * splat.frame, c);
  const std::size_t n = splat.uniform.size();
  float uniform = 0.0f;
  glm::vec3 light(0.0f);
  for (std::size_t i = 0; i < n; ++i) {
    uniform += c[i] * splat.uniform[i];
    light += c[i] * glm::vec3(splat.light[i], splat.light[n + i], splat.light[2 * n + i]);
  }
  return glm::max(light / std::max(uniform, kLeastShare), glm::vec3(0.0f));
}

}  // namespace relume
