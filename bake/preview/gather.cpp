// SPDX-License-Identifier: MIT
// See gather.h.
#include "bake/preview/gather.h"

#include "formats/color.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume {
namespace {

constexpr std::uint32_t kStage = 0x72637300;  // "rcs": the random streams' stage
constexpr std::uint32_t kFiner = 4;           // times as many rays where the light is noise
constexpr float kMaxNoise = 0.03f;            // of E, above which a record is gathered again
constexpr std::uint32_t kMaxRays = 65536;
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

float brightness(const glm::vec3& c) { return luminance(c); }

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

float noiseOf(const HemisphereCells& cells, std::span<const glm::vec3> radiance) {
  double variance = 0.0, total = 0.0;
  for (std::uint32_t cell = 0; cell + 1 < cells.count(); cell += 2) {
    const double a = brightness(radiance[cell]) * cells.integral[cell].z,
                 b = brightness(radiance[cell + 1]) * cells.integral[cell + 1].z;
    variance += (a - b) * (a - b);
    total += a + b;
  }
  return total > 0.0 ? static_cast<float>(std::sqrt(variance) / total) : 0.0f;
}

RecordGatherer::RecordGatherer(const RayTracer& tracer, const HitRadiance& reflected, const Sky& sky,
                               const Options& options)
    : tracer_(tracer),
      reflected_(reflected),
      sky_(sky),
      seed_(options.seed),
      strata_(options.rays, 0.0f),
      fineStrata_(std::min(options.rays * kFiner, kMaxRays), 0.0f) {
  if (options.hemisphere != Hemisphere::fan) {
    cells_ = planeCells(options.planeSide, options.planeFovRad, options.hemisphere);
    return;
  }
  cells_ = fanCells(options.rays);
  if (fineStrata_.count() > strata_.count()) fineCells_ = fanCells(std::min(options.rays * kFiner, kMaxRays));
}

// Fill the directions, cell by cell; returns the frame that they stand in.
glm::mat3 RecordGatherer::aim(const HemisphereCells& cells, const Receiver& receiver, std::uint64_t item,
                              Scratch& scratch) const {
  scratch.directions.resize(cells.count());
  if (!cells.strata) {
    const glm::mat3 frame = frameOf(receiver.normal);
    for (std::uint32_t i = 0; i < cells.count(); ++i) scratch.directions[i] = frame * cells.direction[i];
    return frame;
  }
  const bool fine = &cells == &fineCells_;
  DirectionStrata::Sequence sequence(fine ? fineStrata_ : strata_, receiver.normal,
                                     RandomStream(seed_, kStage + (fine ? 1 : 0), item));
  scratch.samples.resize(DirectionStrata::kBlock);
  const std::span block = std::span(scratch.samples).first<DirectionStrata::kBlock>();
  for (std::uint32_t row = 0; row < cells.rows; row += 4) {
    for (std::uint32_t column = 0; column < cells.columns; column += 4) {
      sequence.next(block);
      for (std::uint32_t i = 0; i < DirectionStrata::kBlock; ++i)
        scratch.directions[(row + i / 4) * cells.columns + column + i % 4] = block[i].direction;
    }
  }
  return {sequence.tangent(), sequence.bitangent(), receiver.normal};
}

// Trace the directions and fill the light and distance of each cell.
void RecordGatherer::look(const HemisphereCells& cells, const Receiver& receiver, std::uint64_t item,
                          Scratch& s) const {
  const std::uint32_t count = cells.count();
  const glm::vec3 origin =
      receiver.positionWorld + receiver.geometricNormal * tracer_.epsilonAt(receiver.positionWorld);
  s.hits.resize(count);
  s.bundle.trace(tracer_, origin, receiver.normal, s.directions, s.hits);
  s.rays.resize(count);
  s.distance.resize(count);
  s.reflected.assign(count, glm::vec3(0.0f));
  s.sky.assign(count, glm::vec3(0.0f));
  for (std::uint32_t i = 0; i < count; ++i) {
    s.rays[i] = {origin, 0.0f, s.directions[i]};
    // An interpolated normal's hemisphere reaches below the surface, where no light comes from.
    const bool below = glm::dot(s.directions[i], receiver.geometricNormal) <= 0.0f;
    if (below) s.hits[i] = Hit{};
    s.distance[i] = below ? -1.0f : s.hits[i].distance;
  }
  reflected_(item, s.rays, s.hits, s.reflected);
  const bool dark = sky_.isDark();
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!dark && s.distance[i] == kInfinity) s.sky[i] = sky_.along(s.directions[i]);
    if (isFinite(s.reflected[i])) continue;
    countNotFinite(s.hits[i]);
    s.reflected[i] = glm::vec3(0.0f);
  }
  rays_ += count;
}

void RecordGatherer::countNotFinite(const Hit& hit) const {
  notFinite_ += 1;
  std::uint32_t least = instance_;
  while (hit.instance < least && !instance_.compare_exchange_weak(least, hit.instance)) {
  }
}

Record RecordGatherer::gatherWith(const HemisphereCells& cells, const Receiver& receiver, std::uint64_t item,
                                  float& noise, Scratch& s) const {
  const glm::mat3 frame = aim(cells, receiver, item, s);
  look(cells, receiver, item, s);
  Record record;
  record.positionWorld = receiver.positionWorld;
  record.normal = receiver.normal;
  record.footprint = receiver.footprint;
  record.reflected = sumCells(cells, s.reflected, s.distance, frame);
  if (!sky_.isDark()) record.sky = sumCells(cells, s.sky, s.distance, frame);
  noise = noiseOf(cells, s.reflected);

  // R_k, as harmonic mean over equal shares of E.
  double inverse = 0.0, weight = 0.0;
  record.nearest = kInfinity;
  for (std::uint32_t i = 0; i < cells.count(); ++i) {
    if (s.distance[i] < 0.0f) continue;
    inverse += cells.integral[i].z / std::max(s.distance[i], 1e-12f);
    weight += cells.integral[i].z;
    record.nearest = std::min(record.nearest, s.distance[i]);
  }
  record.distance = inverse > 0.0 ? static_cast<float>(weight / inverse) : kInfinity;
  // Where the light changes faster than the surroundings' distances tell.
  const RecordLight& l = record.reflected;
  const glm::mat3 vector = l.vector + record.sky.vector, gradient = l.gradient + record.sky.gradient;
  const float e = brightness(receiver.normal * vector);
  const glm::vec3 change(brightness(glm::vec3(gradient[0].x, gradient[1].x, gradient[2].x)),
                         brightness(glm::vec3(gradient[0].y, gradient[1].y, gradient[2].y)),
                         brightness(glm::vec3(gradient[0].z, gradient[1].z, gradient[2].z)));
  const float slope = glm::length(change);
  if (slope > 0.0f) record.distance = std::min(record.distance, e / slope);
  return record;
}

Record RecordGatherer::gather(const Receiver& receiver, std::uint64_t item, Scratch& scratch) const {
  float noise = 0.0f;
  Record record = gatherWith(cells_, receiver, item, noise, scratch);
  if (fineCells_.count() > 0 && noise > kMaxNoise) record = gatherWith(fineCells_, receiver, item, noise, scratch);
  return record;
}

}  // namespace relume
