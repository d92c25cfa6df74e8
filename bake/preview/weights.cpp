// SPDX-License-Identifier: MIT
// See weights.h. With a R_k clamped to the reach r, RCS Eq. (2) is 1 / w = a |p - p_k| / r + sqrt(1 - n . n_k).
#include "bake/preview/weights.h"

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

constexpr float kLeastError = 0.1f;            // of a: at the record itself others that reach there count as well
constexpr float kFarPixels = 1e6f;             // a record of nothing but sky reaches all of the picture
constexpr float kBehind = 0.05f;               // of R_k: a point so far behind a record sees something else
constexpr float kTabellionAccuracy = 0.15f;    // a at which Tabellion's factor kappa is 1
constexpr float kTabellionCosine = 0.984808f;  // of 10 degrees

// [m] How far a record may be read by its own light, whatever the view.
float ownReach(const Record& record, const Interpolation& options) {
  if (options.weight != RecordWeight::tabellion) return options.accuracy * record.distance;
  return 0.5f * record.nearest * options.accuracy / kTabellionAccuracy;
}

}  // namespace

float reachOf(const Record& record, const Interpolation& options) {
  const float own = ownReach(record, options), min = options.minPixels * record.footprint,
              max = (options.reach == RecordReach::printed ? kFarPixels : options.maxPixels) * record.footprint;
  return std::max(std::min(options.limits ? std::min(own, record.limit) : own, max), min);
}

float gradientShare(const Record& record, float reach, const Interpolation& options) {
  return options.gradients && reach > 0.0f ? std::min(1.0f, ownReach(record, options) / reach) : 0.0f;
}

float weightOf(const Record& record, float reach, const PixelReceiver& receiver, const Interpolation& options) {
  const glm::vec3 &normal = receiver.normal, offset = receiver.positionWorld - record.positionWorld;
  const float squared = glm::dot(offset, offset);
  if (!(squared <= reach * reach)) return 0.0f;
  const float a = options.accuracy;
  const float turn = std::max(0.0f, 1.0f - glm::dot(normal, record.normal));
  if (turn > a * a && options.weight != RecordWeight::tabellion) return 0.0f;
  // WRC88's test: whether the point lies behind the record, where another surface may be what it sees.
  const bool guarded = options.reach == RecordReach::guarded;
  if (guarded && 0.5f * glm::dot(offset, normal + record.normal) < -kBehind * reach / a) return 0.0f;

  const float distance = std::sqrt(squared);
  // Neighbour clamping (Krivanek et al. 2006): R changes no faster than places do. A record that sees far does not know
  // of what is close to the receiver. What its reach is for the view's sake alone does not count.
  const bool byItsLight = reach > options.minPixels * record.footprint;
  if (guarded && byItsLight && record.distance > kNear * (distance + receiver.occluder)) return 0.0f;
  if (options.weight == RecordWeight::tabellion) {
    const float angle = std::sqrt(turn / (1.0f - kTabellionCosine)) * kTabellionAccuracy / a;
    return std::max(0.0f, 1.0f - std::max(distance / reach, angle));
  }
  const float error = std::max(a * distance / reach + std::sqrt(turn), kLeastError * a);
  if (error > a) return 0.0f;
  return options.weight == RecordWeight::ward ? 1.0f / error : 1.0f / error - 1.0f / a;
}

}  // namespace relume
