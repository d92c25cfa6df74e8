// SPDX-License-Identifier: MIT
// See surface_sampler.h.
#include "bake/surfels/surface_sampler.h"

#include "bake/base/ladder.h"
#include "bake/base/parallel.h"
#include "bake/base/place_number.h"
#include "bake/base/random.h"
#include "bake/visibility/surface_parts.h"
#include "formats/halton.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <unordered_map>

namespace relume {
namespace {

constexpr std::uint32_t kStage = 0x53555246;  // the random streams' stage
constexpr double kMaxEmitterShare = 0.125;    // largest share of all points that small emitters may get in addition
constexpr double kMaxFarShare = 0.125;        // largest share of all points on sides that are seen from far away only
constexpr std::size_t kSampledPerChunk = 2048, kManySides = 1u << 16;
constexpr std::size_t kPointsPerChunk = 8192, kTrianglesPerChunk = 8192;
constexpr double kMaxTries = 1e8, kMaxNeedleTries = 1e6;  // on a side
constexpr double kMaxTriesPerPoint = 64.0;  // on a side that is seen as a whole; more if only a part is seen
constexpr double kRareShare = 0.25;         // sides of which a smaller share is seen are searched for their seen parts
constexpr std::uint32_t kMaxPartsAlong = 1024;  // with more parts, the tree of the play space finds the seen ones
constexpr std::uint64_t kTriesPerCheck = 1024;  // tries between two checks for cancellation
constexpr double kSteps = 8.0;                  // in an octave, of the ladder of steps and densities
constexpr std::uint32_t kTrianglesPerLine = 64;

// Map the unit square uniformly to a triangle, by folding its far half over.
glm::vec2 foldToTriangle(double u, double v) {
  if (u + v > 1.0) {
    u = 1.0 - u;
    v = 1.0 - v;
  }
  return {static_cast<float>(u), static_cast<float>(v)};
}

double fraction(double x) { return x - std::floor(x); }

// The seen parts of a side, as squares of a grid over the barycentric square. They are searched only if drawing random
// points until one is seen would take longer; empty otherwise.
struct SeenParts {
  std::uint32_t along = 0;
  std::vector<std::uint64_t> part;  // row * along + column

  // Point i of `count`: spread evenly over the parts; (u, v) places it within its part.
  glm::vec2 at(std::int64_t i, std::int64_t count, double u, double v) const {
    const auto index = static_cast<std::size_t>((static_cast<double>(i) + 0.5) / static_cast<double>(count) *
                                                static_cast<double>(part.size()));
    const std::uint64_t p = part[std::min(index, part.size() - 1)];
    const auto column = static_cast<double>(p % along), row = static_cast<double>(p / along);
    const bool diagonal = column + row + 1.0 == along;
    const glm::dvec2 inner = diagonal ? glm::dvec2(foldToTriangle(u, v)) : glm::dvec2(u, v);
    return {static_cast<float>((column + inner.x) / along), static_cast<float>((row + inner.y) / along)};
  }
};

SeenParts findSeenParts(const PlaySpace& playSpace, const std::array<glm::vec3, 3>& corner, std::uint32_t side,
                        double area, double tries) {
  SeenParts parts;
  const double seenShare = playSpace.seenArea[side] / area;
  if (seenShare > kRareShare || playSpace.scene == nullptr || !(playSpace.voxelSize > 0.0f)) return parts;
  const double along = std::ceil(2.0 * std::sqrt(area) / playSpace.voxelSize);
  parts.along = static_cast<std::uint32_t>(std::clamp(along, 1.0, TriangleParts::kMax));
  if (isNeedle(corner, static_cast<float>(area))) parts.along = std::min(parts.along, kMaxPartsAlong);
  const bool large = parts.along > kMaxPartsAlong;
  if (!large && tries < 2.0 * parts.along * parts.along) return parts;
  const auto visit = [&](const PartBlock& block) {
    const std::uint32_t end = std::min(block.row + block.width, parts.along);
    for (std::uint32_t row = block.row; row < end; ++row) {
      for (std::uint32_t column = block.column; column < block.column + block.width && column + row < parts.along;
           ++column) {
        // A square on the diagonal lies partly outside the triangle: test the middle of its inner part.
        const float middle = column + row + 1 < parts.along ? 0.5f : 0.33f;
        glm::vec2 at((static_cast<float>(column) + middle) / static_cast<float>(parts.along),
                     (static_cast<float>(row) + middle) / static_cast<float>(parts.along));
        if (large) at = {(column + 0.5) / parts.along, (row + 0.5) / parts.along};
        if (playSpace.seenAt(side, at)) parts.part.push_back(std::uint64_t{row} * parts.along + column);
      }
    }
  };
  forEachBlock(
      corner, parts.along,
      [&](const glm::vec3& low, const glm::vec3& high) { return playSpace.mayBeSeenIn(side, low, high); }, visit);
  std::sort(parts.part.begin(), parts.part.end());
  return parts;
}

}  // namespace

std::uint32_t emitterOf(const Scene& scene, std::uint32_t instance, std::uint32_t side) {
  const Instance& owner = scene.instances[instance];
  const glm::vec3& e = scene.material(owner).emission;
  const bool emits = (e.x > 0.0f || e.y > 0.0f || e.z > 0.0f || scene.material(owner).drivable) &&
                     (side % 2 == 0 || scene.bothSides(owner, side / 2 - owner.firstTriangle));
  return emits ? instance : kReflector;
}

SurfaceSample sampleAt(const Scene& scene, std::uint32_t instance, std::uint32_t side, const glm::vec2& barycentric) {
  SurfaceSample sample;
  const Instance& owner = scene.instances[instance];
  sample.point = {instance, side / 2 - owner.firstTriangle, barycentric};
  sample.side = side;
  const std::array<glm::vec3, 3> corner = scene.corners(owner, sample.point.triangle);
  sample.positionWorld = corner[0] + barycentric.x * (corner[1] - corner[0]) + barycentric.y * (corner[2] - corner[0]);
  const glm::vec3 front = geometricNormal(scene, sample.point);
  sample.normal = side % 2 == 0 ? front : -front;
  sample.emitter = emitterOf(scene, instance, side);
  return sample;
}

SurfaceSampler::SurfaceSampler(const RayTracer& tracer, const PlaySpace& playSpace, std::uint32_t pointCount,
                               std::uint32_t emitterPoints, Context& context)
    : scene_(&tracer.scene()), playSpace_(&playSpace) {
  // Collect the sides that are seen. A triangle whose normal is lost to rounding has no side to stand on.
  std::vector<std::uint8_t> isFlat(scene_->triangleCount(), 0);
  parallelChunks(context, "", isFlat.size(), kTrianglesPerChunk, [&](std::size_t begin, std::size_t end) {
    InstanceFinder instances(*scene_);
    for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
      if (!(playSpace.seenArea[2 * t] > 0.0f) && !(playSpace.seenArea[2 * t + 1] > 0.0f)) continue;
      const std::uint32_t i = instances.of(t);
      isFlat[t] = geometricNormal(*scene_, {i, t - scene_->instances[i].firstTriangle, {}}) == glm::vec3(0.0f);
    }
  });
  const auto instanceCount = static_cast<std::uint32_t>(scene_->instances.size());
  std::vector<double> emitterArea(instanceCount, 0.0);
  double farShare = 0.0;
  for (std::uint32_t i = 0; i < instanceCount && !context.cancelled(); ++i) {
    const Instance& instance = scene_->instances[i];
    if (!instance.baked()) continue;
    const auto triangles = static_cast<std::uint32_t>(scene_->meshes[instance.mesh].triangle.size());
    for (std::uint32_t t = 0; t < triangles; ++t) {
      for (std::uint32_t back = 0; back < 2; ++back) {
        const std::uint32_t side = 2 * (instance.firstTriangle + t) + back;
        const float area = playSpace.seenArea[side];
        if (!(area > 0.0f) || isFlat[side / 2] != 0) continue;
        side_.push_back(side);
        if (playSpace.isFar(side)) {
          farShare += playSpace.farShare[side];
          continue;
        }
        seenArea_ += area;
        if (emitterOf(*scene_, i, side) != kReflector) emitterArea[i] += area;
      }
    }
  }
  side_.shrink_to_fit();

  // Raise the density of small emitters.
  const auto emitters = std::count_if(emitterArea.begin(), emitterArea.end(), [](double a) { return a > 0.0; });
  const double max = emitters > 0 ? kMaxEmitterShare * pointCount / static_cast<double>(emitters) : 0.0;
  const double wanted = std::min<double>(emitterPoints, max);
  emitterDensity_.assign(instanceCount, 1.0f);
  for (std::uint32_t i = 0; i < instanceCount; ++i) {
    if (!(emitterArea[i] > 0.0)) continue;
    const double expected = pointCount * emitterArea[i] / seenArea_;
    emitterDensity_[i] = static_cast<float>(std::max(1.0, onLadder(wanted / expected, kSteps)));
  }

  // Thin out far sides: by their share of what is seen.
  if (!playSpace.farShare.empty()) {
    double measure = 0.0;
    forEachSide(0, side_.size(), [&](const Side& s) {
      if (!playSpace.isFar(s.side))
        measure += static_cast<double>(playSpace.seenArea[s.side]) * densityOf(s.side, s.instance);
    });
    farMeasure_ = measure * std::min(1.0, kMaxFarShare / std::max(farShare, 1e-30));
    forEachSide(0, side_.size(), [&](const Side& s) {
      if (playSpace.isFar(s.side))
        seenArea_ += static_cast<double>(playSpace.seenArea[s.side]) * densityOf(s.side, s.instance);
    });
  }
  numberInstances();
  markMeasures();
}

// Number the instances by where they stand, those at the same place by their order, and let small ones share lines,
// whether they are seen or not. Names must not count: a new one changes no bake.
void SurfaceSampler::numberInstances() {
  std::unordered_map<std::uint64_t, std::uint64_t> same;
  number_.reserve(scene_->instances.size());
  for (const Instance& instance : scene_->instances) {
    const std::uint64_t place =
        hashCombine(placeNumber(instance.toWorld), scene_->meshes[instance.mesh].triangle.size());
    number_.push_back(hashCombine(place, same[place]++));
  }
  std::size_t chained = kTrianglesPerLine;  // triangles of the chain that is open
  for (std::uint32_t i = 0; i < scene_->instances.size(); ++i) {
    const std::size_t triangles = scene_->meshes[scene_->instances[i].mesh].triangle.size();
    const bool goesOn = chained + triangles <= kTrianglesPerLine;
    chain_.push_back(goesOn ? chain_.back() : i);
    chained = goesOn ? chained + triangles : triangles;
  }
}

// How much denser than elsewhere points are on a side; below 1 on far ones.
float SurfaceSampler::densityOf(std::uint32_t side, std::uint32_t instance) const {
  if (playSpace_->isFar(side)) {
    const double wantedMeasure = farMeasure_ * playSpace_->farShare[side];
    return static_cast<float>(std::min(1.0, wantedMeasure / playSpace_->seenArea[side]));
  }
  const float density = emitterDensity_[instance];
  return density != 1.0f && emitterOf(*scene_, instance, side) != kReflector ? density : 1.0f;
}

// The length of a side on its line. [m²]
double SurfaceSampler::measureOf(std::size_t index, std::uint32_t instance) const {
  if (!onLine_.empty()) return onLine_[index];
  const std::uint32_t side = side_[index];
  return static_cast<double>(playSpace_->seenArea[side]) * densityOf(side, instance);
}

void SurfaceSampler::markMeasures() {
  sidesPerMark_ = side_.size() < kManySides ? 1 : 64;
  mark_.reserve(side_.size() / sidesPerMark_ + 1);
  InstanceFinder instances(*scene_);
  measure_ = 0.0;
  std::pair<std::uint32_t, std::uint32_t> last(kNone, 0);
  for (std::size_t i = 0; i < side_.size(); ++i) {
    const std::uint32_t triangle = side_[i] / 2, instance = instances.of(triangle), first = chain_[instance];
    const std::pair at(first, (triangle - scene_->instances[first].firstTriangle) / kTrianglesPerLine);
    if (at != last) line_.push_back({i, measure_, hashCombine(number_[first], at.second)});
    last = at;
    if (i % sidesPerMark_ == 0) mark_.push_back(measure_);
    measure_ += measureOf(i, instance);
  }
}

// Visit sides [first, last) in their order; first is a multiple of sidesPerMark_. visit(side)
template <class Visit>
void SurfaceSampler::forEachSide(std::size_t first, std::size_t last, const Visit& visit) const {
  InstanceFinder instances(*scene_);
  Side side;
  side.end = first / sidesPerMark_ < mark_.size() ? mark_[first / sidesPerMark_] : 0.0;
  const auto beginsAfter = [](std::size_t index, const Line& line) { return index < line.firstSide; };
  auto next = std::upper_bound(line_.begin(), line_.end(), first, beginsAfter);
  for (std::size_t i = first; i < last; ++i) {
    side.side = side_[i];
    side.instance = instances.of(side.side / 2);
    while (next != line_.end() && next->firstSide <= i) ++next;
    if (next != line_.begin()) side.line = static_cast<std::size_t>(next - line_.begin()) - 1;
    side.begin = side.end;
    side.end += measureOf(i, side.instance);
    visit(side);
  }
}

SurfaceSampler SurfaceSampler::emittersOnly() const {
  SurfaceSampler only;
  only.scene_ = scene_;
  only.playSpace_ = playSpace_;
  only.emitterDensity_ = emitterDensity_;
  only.farMeasure_ = farMeasure_;
  only.number_ = number_;
  only.chain_ = chain_;
  forEachSide(0, side_.size(), [&](const Side& s) {
    if (emitterOf(*scene_, s.instance, s.side) == kReflector) return;
    only.side_.push_back(s.side);
    only.onLine_.push_back(s.end - s.begin);
  });
  only.markMeasures();
  return only;
}

std::size_t SurfaceSampler::drawSide(const Side& s, double step, std::uint64_t seed, std::uint32_t salt,
                                     std::vector<SurfaceSample>& out, Context& context) const {
  // Count the steps of the line that begin on this side.
  const Line& line = line_[s.line];
  const double offset = RandomStream(seed, kStage + salt, ~line.number).uniform();
  const auto first = static_cast<std::int64_t>(std::ceil((s.begin - line.begin) / step - offset));
  const auto last = static_cast<std::int64_t>(std::ceil((s.end - line.begin) / step - offset));
  if (first >= last) return 0;
  const Instance& instance = scene_->instances[s.instance];
  const std::uint32_t triangle = s.side / 2 - instance.firstTriangle;
  const std::array<glm::vec3, 3> corner = scene_->corners(instance, triangle);
  const double area = 0.5 * glm::length(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
  const bool masked = scene_->material(instance).alphaMode == AlphaMode::mask;

  // Draw points of a rotated Halton sequence. A point that is not seen is replaced by the next one; a point that an
  // alpha mask cuts out is not.
  RandomStream random(seed, kStage + salt, hashCombine(number_[s.instance], s.side - 2 * instance.firstTriangle));
  const double shiftU = random.uniform(), shiftV = random.uniform();
  const double seen = std::max<double>(playSpace_->seenArea[s.side], 1e-6 * area);
  const double tries = static_cast<double>(last - first) * std::max(1.0, area / seen);
  const SeenParts parts = findSeenParts(*playSpace_, corner, s.side, area, tries);
  const double maxTries = isNeedle(corner, static_cast<float>(area)) ? kMaxNeedleTries : kMaxTries;
  auto triesLeft = static_cast<std::int64_t>(std::min(maxTries, kMaxTriesPerPoint * (1.0 + tries)));
  std::uint64_t halton = 0;
  SurfaceSample sample = sampleAt(*scene_, s.instance, s.side, glm::vec2(0.0f));
  sample.density = densityOf(s.side, s.instance);
  for (std::int64_t i = first; i < last; ++i) {
    glm::vec2 at(0.0f);
    if (context.cancelled()) return 0;
    do {
      ++halton;
      const double u = fraction(radicalInverse(2, halton) + shiftU), v = fraction(radicalInverse(3, halton) + shiftV);
      at = parts.part.empty() ? foldToTriangle(u, v) : parts.at(i - first, last - first, u, v);
    } while (--triesLeft > 0 && !playSpace_->seenAt(s.side, at) &&
             !(halton % kTriesPerCheck == 0 && context.cancelled()));
    if (masked && !opaqueAt(*scene_, {s.instance, triangle, at})) continue;
    sample.point.barycentric = at;
    sample.positionWorld = corner[0] + at.x * (corner[1] - corner[0]) + at.y * (corner[2] - corner[0]);
    out.push_back(sample);
  }
  return static_cast<std::size_t>(last - first);
}

std::vector<SurfaceSample> SurfaceSampler::draw(std::size_t count, std::uint64_t seed, std::uint32_t salt,
                                                Context& context, std::size_t* laid) const {
  if (laid != nullptr) *laid = 0;
  if (side_.empty() || count == 0) return {};
  const double step = onLadderBelow(measure_ / static_cast<double>(count), kSteps);

  // Make chunks by sides and points together: a large triangle with many points is as much work as many small ones.
  std::vector<std::size_t> chunkBegin{0};
  double work = 0.0;
  for (std::size_t mark = 0; mark < mark_.size(); ++mark) {
    const double end = mark + 1 < mark_.size() ? mark_[mark + 1] : measure_;
    work += static_cast<double>(sidesPerMark_) / kSampledPerChunk + (end - mark_[mark]) / step / kPointsPerChunk;
    if (work >= 1.0 || mark + 1 == mark_.size()) {
      chunkBegin.push_back(std::min(side_.size(), (mark + 1) * sidesPerMark_));
      work = 0.0;
    }
  }
  std::vector<std::vector<SurfaceSample>> parts(chunkBegin.size() - 1);
  std::atomic<std::size_t> all = 0;
  parallelChunks(context, "", parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      std::size_t own = 0;
      forEachSide(chunkBegin[c], chunkBegin[c + 1],
                  [&](const Side& side) { own += drawSide(side, step, seed, salt, parts[c], context); });
      all += own;
    }
  });
  if (laid != nullptr) *laid = all;

  std::vector<SurfaceSample> samples;
  std::size_t drawn = 0;
  for (const std::vector<SurfaceSample>& part : parts) drawn += part.size();
  reserveByThreads(context, samples, drawn);
  for (const std::vector<SurfaceSample>& part : parts) samples.insert(samples.end(), part.begin(), part.end());
  return samples;
}

}  // namespace relume
