// SPDX-License-Identifier: MIT
// See relax.h. PIC 4.2 says only that surfels are repelled from their nearest neighbours, along the tangent plane. Here
// every neighbour nearer than the densest spacing pushes by its lack of distance. A moved surfel is put back onto the
// surface by a short ray against its normal; where that meets nothing, another instance, another kind of surface or a
// part that is not seen, the surfel stays where it was. All surfels move at once, so the result does not depend on
// their order.
#include "bake/surfels/relax.h"

#include "bake/base/parallel.h"
#include "bake/surfels/neighbours.h"

#include <flann/flann.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <exception>
#include <span>
#include <string>

namespace relume {
namespace {

constexpr std::size_t kNeighbours = 13;  // itself included
constexpr std::size_t kRelaxedAtOnce = 4096;
constexpr float kStep = 0.35f;         // factor on the sum of all missing distances
constexpr float kMaxStep = 0.3f;       // of the spacing, in one round
constexpr float kProbeHeight = 0.35f;  // of the spacing, from which the surface is looked for
constexpr float kMinCosine = 0.7f;     // between the normals before and after

// Where its neighbours push a surfel, on its tangent plane.
glm::vec3 pushed(const std::vector<SurfaceSample>& samples, std::size_t i, std::span<const std::size_t> neighbours,
                 float spacing) {
  const SurfaceSample& self = samples[i];
  const float reach = spacing / std::sqrt(self.density);
  glm::vec3 push(0.0f);
  for (const std::size_t j : neighbours) {
    if (j == i) continue;
    const SurfaceSample& other = samples[j];
    const glm::vec3 apart = self.positionWorld - other.positionWorld;
    const float distance = glm::length(apart);
    if (!(distance > 1e-6f * reach) || distance >= reach) continue;
    if (!areNeighbours({self.positionWorld, self.normal, self.emitter},
                       {other.positionWorld, other.normal, other.emitter}, apart, distance * distance)) {
      continue;
    }
    push += (kStep * (reach - distance) / distance) * apart;
  }
  push -= glm::dot(push, self.normal) * self.normal;
  const float length = glm::length(push), longest = kMaxStep * reach;
  return self.positionWorld + (length > longest ? push * (longest / length) : push);
}

// Find the surface under a moved surfel. Returns the unmoved surfel if there is none that it may move to.
SurfaceSample putBack(const RayTracer& tracer, const PlaySpace& playSpace, const SurfaceSample& old,
                      const glm::vec3& moved, float spacing) {
  const float height = kProbeHeight * spacing / std::sqrt(old.density);
  const Hit hit = tracer.trace({moved + height * old.normal, 0.0f, -old.normal, 2.0f * height});
  if (!hit || hit.instance != old.point.instance) return old;
  const std::uint32_t side =
      2 * (tracer.scene().instances[hit.instance].firstTriangle + hit.triangle) + (hit.back ? 1u : 0u);
  if (!playSpace.seenAt(side, hit.barycentric)) return old;
  SurfaceSample sample = sampleAt(tracer.scene(), hit.instance, side, hit.barycentric);
  if (sample.emitter != old.emitter || glm::dot(sample.normal, old.normal) < kMinCosine) return old;
  sample.density = old.density;
  return sample;
}

void relaxOnce(const RayTracer& tracer, const PlaySpace& playSpace, float spacing, std::vector<SurfaceSample>& samples,
               Context& context) {
  std::vector<float> coordinates(3 * samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (int k = 0; k < 3; ++k) coordinates[3 * i + static_cast<std::size_t>(k)] = samples[i].positionWorld[k];
  }
  const flann::Matrix<float> points(coordinates.data(), samples.size(), 3);
  flann::KDTreeSingleIndex<flann::L2_Simple<float>> index(points, flann::KDTreeSingleIndexParams(16));
  index.buildIndex();

  std::vector<SurfaceSample> moved(samples.size());
  parallelChunks(context, "", samples.size(), kRelaxedAtOnce, [&](std::size_t begin, std::size_t end) {
    // Do not ask FLANN for more neighbours than there are points: it would leave them undefined.
    const std::size_t count = end - begin, wanted = std::min(kNeighbours, samples.size());
    std::vector<std::size_t> neighbour(count * wanted);
    std::vector<float> distance(count * wanted);
    flann::Matrix<std::size_t> indices(neighbour.data(), count, wanted);
    flann::Matrix<float> distances(distance.data(), count, wanted);
    flann::SearchParams search(flann::FLANN_CHECKS_UNLIMITED);
    search.cores = 1;
    index.knnSearch(flann::Matrix<float>(coordinates.data() + 3 * begin, count, 3), indices, distances, wanted, search);
    for (std::size_t i = begin; i < end; ++i) {
      const std::span near(&neighbour[(i - begin) * wanted], wanted);
      const glm::vec3 to = pushed(samples, i, near, spacing);
      moved[i] = putBack(tracer, playSpace, samples[i], to, spacing);
    }
  });
  if (!context.cancelled()) samples.swap(moved);
}

}  // namespace

Status relaxSamples(const RayTracer& tracer, const PlaySpace& playSpace, std::uint32_t rounds, float spacing,
                    std::vector<SurfaceSample>& samples, Context& context) {
  if (samples.size() < 2) return done();
  try {
    for (std::uint32_t round = 0; round < rounds; ++round) {
      relaxOnce(tracer, playSpace, spacing, samples, context);
      if (!context.progress("surfels", 0.2 + 0.6 * (round + 1) / rounds)) return cancelledError();
    }
  } catch (const std::exception& e) {
    return Error{ErrorCode::failed, std::string("relaxing surfels: FLANN: ") + e.what()};
  }
  return done();
}

}  // namespace relume
