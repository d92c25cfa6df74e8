// SPDX-License-Identifier: MIT
// See gather.h.
#include "bake/preview/gather.h"

#include "formats/color.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace relume {
namespace {

constexpr std::uint32_t kGatherStage = 0x72637300;  // "rcs": the random streams' stage
constexpr std::uint32_t kSubRays = 8;               // of a cell that is looked at again
constexpr std::uint32_t kMostUneven = 16;           // one in so many cells is, at most
constexpr float kEven = 0.001f;                     // of E: what a cell may differ from its neighbours
constexpr float kDeviations = 2.0f;                 // of a gradient by noise
constexpr std::uint64_t kAgain = 1ull << 40;        // makes items of second looks
constexpr float kInfinity = std::numeric_limits<float>::infinity();

bool isFinite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// The columns are vectors of R, G, B: add L times v.
void addOuter(glm::mat3& columns, const glm::vec3& radiance, const glm::vec3& v) {
  columns[0] += radiance.x * v;
  columns[1] += radiance.y * v;
  columns[2] += radiance.z * v;
}

glm::mat3 frameOf(const glm::vec3& normal) {
  const glm::vec3 helper = std::abs(normal.x) < 0.5f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  const glm::vec3 t = glm::normalize(glm::cross(helper, normal));
  return {t, glm::cross(normal, t), normal};
}

}  // namespace

RecordLight sumCells(const HemisphereCells& cells, std::span<const glm::vec3> radiance, std::span<const float> distance,
                     const glm::mat3& frame) {
  glm::mat3 vector(0.0f), gradient(0.0f);
  const auto border = [&](std::uint32_t a, std::uint32_t b, const glm::vec2& arc) {
    if (radiance[a] == radiance[b] || distance[a] < 0.0f || distance[b] < 0.0f) return;
    const float r = std::min(distance[a], distance[b]);
    if (r == kInfinity) return;
    addOuter(gradient, (radiance[b] - radiance[a]) / std::max(r, 1e-12f), glm::vec3(arc, 0.0f));
  };
  for (std::uint32_t j = 0, cell = 0; j < cells.rows; ++j) {
    for (std::uint32_t i = 0; i < cells.columns; ++i, ++cell) {
      addOuter(vector, radiance[cell], cells.integral[cell]);
      if (i + 1 < cells.columns) border(cell, cell + 1, cells.toNextColumn[cell]);
      if (j + 1 < cells.rows) border(cell, cell + cells.columns, cells.toNextRow[cell]);
    }
  }
  return {frame * vector, frame * gradient};
}

double varianceOf(const HemisphereCells& cells, std::span<const glm::vec3> radiance,
                  std::span<const std::uint8_t> fine) {
  double variance = 0.0;
  for (std::uint32_t cell = 0; cell + 1 < cells.count(); cell += 2) {
    if (fine[cell] != 0 || fine[cell + 1] != 0) continue;
    const double apart = luminance(radiance[cell]) - luminance(radiance[cell + 1]),
                 share = 0.5f * (cells.integral[cell].z + cells.integral[cell + 1].z);
    variance += apart * apart * share * share;
  }
  return variance;
}

void limitBySlope(Record& record) {
  const glm::mat3 vector = record.reflected.vector + record.sky.vector;
  const glm::mat3 byAxis = glm::transpose(record.reflected.gradient + record.sky.gradient);
  const float slope = glm::length(glm::vec3(luminance(byAxis[0]), luminance(byAxis[1]), luminance(byAxis[2])));
  if (!(slope > 0.0f)) return;
  const float certain = slope - kDeviations * record.noise / record.distance, share = std::max(0.0f, certain / slope);
  record.reflected.gradient *= share;
  if (share > 0.0f) record.distance = std::min(record.distance, luminance(record.normal * vector) / certain);
  limitChannels(record);
}

void limitChannels(Record& record) {
  const glm::vec3 e = record.normal * (record.reflected.vector + record.sky.vector);
  const float most = std::max({e.x, e.y, e.z, 0.0f});
  for (int c = 0; c < 3; ++c) {
    const float change = record.distance * glm::length(record.reflected.gradient[c]);
    if (change > most) record.reflected.gradient[c] *= most / change;
  }
}

RecordGatherer::RecordGatherer(const RayTracer& tracer, const HitRadiance& reflected, const Sky& sky,
                               const Options& options)
    : tracer_(tracer),
      reflected_(reflected),
      sky_(sky),
      seed_(options.seed),
      secondLook_(options.secondLook),
      reach_(options.reach),
      cells_(options.hemisphere == Hemisphere::fan
                 ? fanCells(options.rays)
                 : planeCells(options.planeSide, options.planeFovRad, options.hemisphere)),
      strata_(options.rays, 0.0f),
      spread_(std::sqrt(std::numbers::pi_v<float> / static_cast<float>(cells_.count()))) {}

// Fill the directions, cell by cell; returns the frame that they stand in.
glm::mat3 RecordGatherer::aim(const PixelReceiver& receiver, std::uint64_t item, Scratch& scratch) const {
  scratch.directions.resize(cells_.count());
  if (!cells_.strata) {
    const glm::mat3 frame = frameOf(receiver.normal);
    for (std::uint32_t i = 0; i < cells_.count(); ++i) scratch.directions[i] = frame * cells_.direction[i];
    return frame;
  }
  DirectionStrata::Sequence sequence(strata_, receiver.normal, RandomStream(seed_, kGatherStage, item));
  scratch.samples.resize(DirectionStrata::kBlock);
  const std::span block = std::span(scratch.samples).first<DirectionStrata::kBlock>();
  for (std::uint32_t row = 0; row < cells_.rows; row += 4) {
    for (std::uint32_t column = 0; column < cells_.columns; column += 4) {
      sequence.next(block);
      for (std::uint32_t i = 0; i < DirectionStrata::kBlock; ++i)
        scratch.directions[(row + i / 4) * cells_.columns + column + i % 4] = block[i].direction;
    }
  }
  return {sequence.tangent(), sequence.bitangent(), receiver.normal};
}

glm::vec3 RecordGatherer::startOf(const PixelReceiver& receiver) const {
  return receiver.positionWorld + receiver.geometricNormal * tracer_.epsilonAt(receiver.positionWorld);
}

// Trace the directions and fill the light and distance of each cell.
void RecordGatherer::look(const PixelReceiver& receiver, std::uint64_t item, Scratch& s) const {
  const std::uint32_t count = cells_.count();
  const glm::vec3 origin = startOf(receiver);
  s.hits.resize(count);
  s.bundle.trace(tracer_, origin, receiver.normal, s.directions, s.hits);
  s.rays.resize(count);
  s.distance.resize(count);
  s.reflected.assign(count, glm::vec3(0.0f));
  for (std::uint32_t i = 0; i < count; ++i) {
    s.rays[i] = {origin, 0.0f, s.directions[i]};
    // An interpolated normal's hemisphere reaches below the surface, where no light comes from.
    const bool below = glm::dot(s.directions[i], receiver.geometricNormal) <= 0.0f;
    if (below) s.hits[i] = Hit{};
    s.distance[i] = below ? -1.0f : s.hits[i].distance;
  }
  reflected_(item, spread_, s.rays, s.hits, s.reflected);
  for (std::uint32_t i = 0; i < count; ++i) keepFinite(s.hits[i], s.reflected[i]);
  addSky(s);
  rays_ += count;
}

void RecordGatherer::addSky(Scratch& s) const {
  s.sky.assign(cells_.count(), glm::vec3(0.0f));
  if (sky_.isDark()) return;
  for (std::uint32_t i = 0; i < cells_.count(); ++i) {
    if (s.distance[i] == kInfinity) s.sky[i] = sky_.along(s.directions[i]);
  }
}

// The cells whose neighbours differ most from each other: where a patch of light begins or ends. A cell's own light has
// no say, for a choice that depends on it would be a bias: bright cells replaced, and dark ones kept.
void RecordGatherer::findUneven(Scratch& s) const {
  const std::uint32_t count = cells_.count();
  float total = 0.0f;
  for (std::uint32_t i = 0; i < count; ++i) total += luminance(s.reflected[i]) * cells_.integral[i].z;
  std::vector<float>& contrast = s.contrast;
  contrast.assign(count, 0.0f);
  for (std::uint32_t j = 0, cell = 0; j < cells_.rows; ++j) {
    for (std::uint32_t i = 0; i < cells_.columns; ++i, ++cell) {
      float least = kInfinity, most = 0.0f;
      for (std::uint32_t v = j > 0 ? j - 1 : 0; v <= std::min(j + 1, cells_.rows - 1); ++v) {
        for (std::uint32_t u = i > 0 ? i - 1 : 0; u <= std::min(i + 1, cells_.columns - 1); ++u) {
          const std::uint32_t other = v * cells_.columns + u;
          if (other == cell || s.distance[other] < 0.0f) continue;
          least = std::min(least, luminance(s.reflected[other]));
          most = std::max(most, luminance(s.reflected[other]));
        }
      }
      if (s.distance[cell] >= 0.0f && most > least) contrast[cell] = (most - least) * cells_.integral[cell].z;
    }
  }
  s.uneven.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    if (contrast[i] > kEven * total) s.uneven.emplace_back(contrast[i], i);
  }
  const std::size_t most = count / kMostUneven;
  if (s.uneven.size() > most) {
    // Ties by number: the same on any machine.
    const auto larger = [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    };
    std::nth_element(s.uneven.begin(), s.uneven.begin() + static_cast<std::ptrdiff_t>(most), s.uneven.end(), larger);
    s.uneven.resize(most);
  }
}

// Give uneven cells the mean of several rays in place of the one that chose them; returns the variance of E that is
// left in them.
double RecordGatherer::lookAgain(const PixelReceiver& receiver, std::uint64_t item, const glm::mat3& frame,
                                 Scratch& s) const {
  s.fine.assign(cells_.count(), 0);
  if (!cells_.strata || !secondLook_) return 0.0;
  findUneven(s);
  RandomStream random(seed_, kGatherStage + 1, item);
  const glm::vec3 origin = startOf(receiver);
  const auto columns = static_cast<float>(cells_.columns), rows = static_cast<float>(cells_.rows);
  s.fineDirections.clear();
  for (const auto& [contrast, cell] : s.uneven) {
    const glm::vec2 corner(cell % cells_.columns, cell / cells_.columns);
    for (std::uint32_t k = 0; k < kSubRays; ++k) {
      // A jittered grid of 2 x 4.
      const glm::vec2 jitter = random.uniform2();
      const glm::vec2 p = corner + (glm::vec2(k % 2, k / 2) + jitter) * glm::vec2(0.5f, 2.0f / kSubRays);
      s.fineDirections.push_back(frame * hemisphereDirection(p.x / columns, p.y / rows, 0.0f));
    }
  }
  const std::size_t count = s.fineDirections.size();
  s.fineHits.assign(count, Hit{});
  s.fineRays.resize(count);
  s.fineReflected.assign(count, glm::vec3(0.0f));
  for (std::size_t i = 0; i < count; ++i) s.fineRays[i] = {origin, 0.0f, s.fineDirections[i]};
  tracer_.trace(s.fineRays, s.fineHits, RayOrder::coherent);
  for (std::size_t i = 0; i < count; ++i) {
    if (glm::dot(s.fineDirections[i], receiver.geometricNormal) <= 0.0f) s.fineHits[i] = Hit{};
  }
  reflected_(item + kAgain, spread_ * std::sqrt(1.0f / kSubRays), s.fineRays, s.fineHits, s.fineReflected);
  rays_ += count;

  double variance = 0.0;
  for (std::size_t u = 0; u < s.uneven.size(); ++u) {
    const std::uint32_t cell = s.uneven[u].second;
    glm::vec3 mean(0.0f);
    double squares = 0.0;
    for (std::size_t i = u * kSubRays; i < (u + 1) * kSubRays; ++i) {
      keepFinite(s.fineHits[i], s.fineReflected[i]);
      mean += s.fineReflected[i] * (1.0f / kSubRays);
      squares += std::pow(static_cast<double>(luminance(s.fineReflected[i])), 2.0);
    }
    s.reflected[cell] = mean;
    s.fine[cell] = 1;
    const double level = luminance(mean), share = cells_.integral[cell].z;
    variance += share * share * std::max(0.0, squares / kSubRays - level * level) / (kSubRays - 1);
  }
  return variance;
}

void RecordGatherer::keepFinite(const Hit& hit, glm::vec3& radiance) const {
  if (isFinite(radiance)) return;
  radiance = glm::vec3(0.0f);
  notFinite_ += 1;
  std::uint32_t least = instance_;
  while (hit.instance < least && !instance_.compare_exchange_weak(least, hit.instance)) {
  }
}

Record RecordGatherer::gather(const PixelReceiver& receiver, std::uint64_t item, Scratch& s) const {
  s.frame = aim(receiver, item, s);
  look(receiver, item, s);
  return sum(receiver, lookAgain(receiver, item, s.frame, s), s);
}

glm::mat4 RecordGatherer::poseOf(const PixelReceiver& receiver) const {
  glm::mat4 pose(frameOf(receiver.normal));
  pose[3] = glm::vec4(startOf(receiver), 1.0f);
  return pose;
}

Record RecordGatherer::gatherDrawn(const PixelReceiver& receiver, std::span<const glm::vec3> radiance,
                                   std::span<const float> distance, Scratch& s) const {
  s.frame = aim(receiver, 0, s);
  s.reflected.assign(radiance.begin(), radiance.end());
  s.distance.assign(distance.begin(), distance.end());
  for (std::uint32_t i = 0; i < cells_.count(); ++i) {
    keepFinite(Hit{}, s.reflected[i]);
    // What lies below the surface itself is none of its light, as for rays.
    if (glm::dot(s.directions[i], receiver.geometricNormal) > 0.0f) continue;
    s.reflected[i] = glm::vec3(0.0f);
    s.distance[i] = -1.0f;
  }
  addSky(s);
  s.fine.assign(cells_.count(), 0);
  rays_ += cells_.count();
  return sum(receiver, 0.0, s);
}

// The record of what the cells have found.
Record RecordGatherer::sum(const PixelReceiver& receiver, double unevenVariance, Scratch& s) const {
  Record record;
  record.positionWorld = receiver.positionWorld;
  record.normal = receiver.normal;
  record.footprint = receiver.footprint;
  record.reflected = sumCells(cells_, s.reflected, s.distance, s.frame);
  if (!sky_.isDark()) record.sky = sumCells(cells_, s.sky, s.distance, s.frame);
  record.noise = static_cast<float>(std::sqrt(unevenVariance + varianceOf(cells_, s.reflected, s.fine)));

  // R_k, as harmonic mean over equal shares of E.
  double inverse = 0.0, weight = 0.0;
  record.nearest = kInfinity;
  for (std::uint32_t i = 0; i < cells_.count(); ++i) {
    if (s.distance[i] < 0.0f) continue;
    inverse += cells_.integral[i].z / std::max(s.distance[i], 1e-12f);
    weight += cells_.integral[i].z;
    record.nearest = std::min(record.nearest, s.distance[i]);
  }
  record.distance = inverse > 0.0 ? static_cast<float>(weight / inverse) : kInfinity;
  if (reach_ == RecordReach::guarded) record.distance = std::min(record.distance, kNear * receiver.occluder);
  s.seenDistance = record.distance;
  if (reach_ == RecordReach::guarded) limitBySlope(record);
  return record;
}

}  // namespace relume
