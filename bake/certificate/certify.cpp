// SPDX-License-Identifier: MIT
// See certify.h.
#include "bake/certificate/certify.h"

#include "bake/base/parallel.h"
#include "formats/pack.h"
#include "relume/relighter.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <span>
#include <utility>
#include <vector>

namespace relume {
namespace {

// What the runtime reads at the receivers under one light, after one bounce.
class Reader {
 public:
  static Result<Reader> create(const Bake& bake, Context& context) {
    RelightOptions options;
    options.simd = Simd::baseline;
    options.parallelFor = [&context](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
      parallelChunks(context, "", tasks, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) body(static_cast<std::uint32_t>(i));
      });
    };
    Result<Relighter> relighter = Relighter::create(bake, options);
    if (!relighter) return relighter.error();
    return Reader(bake, std::move(*relighter));
  }

  Status read(const TestLight& light, const TestReceivers& receivers, std::span<glm::vec3> irradiance) {
    for (std::size_t s = 0; s < direct_.size(); ++s)
      direct_[s] = glm::vec3(light.surfelIrradiance.empty() ? 0.0f : light.surfelIrradiance[s]);
    LightSetup setup;
    setup.surfelIrradiance = direct_;
    setup.emissionScale = glm::vec3(0.0f);
    setup.skyRadiance = glm::vec3(light.kind == TestLightKind::sky ? 1.0f : 0.0f);
    setup.bounceScale = 0.0f;
    if (const Status status = relighter_.relight(setup); !status) return status;
    for (std::size_t i = 0; i < receivers.count(); ++i) {
      const std::uint32_t at = receivers.at[i];
      irradiance[i] = at == kGridReceiver ? relighter_.irradianceInGrid(receivers.positionWorld[i], receivers.normal[i])
                                          : relighter_.irradianceOnLightmap(unpackUnorm16x2(at), receivers.normal[i],
                                                                            receivers.geometricNormal[i]);
    }
    return done();
  }

 private:
  Reader(const Bake& bake, Relighter relighter) : relighter_(std::move(relighter)), direct_(bake.surfels.count()) {}

  Relighter relighter_;
  std::vector<glm::vec3> direct_;  // [Size n_S]
};

}  // namespace

Result<Certificate> certify(const Bake& bake, const TestRays& rays, Context& context) {
  const TestReceivers& places = rays.receivers;
  const std::size_t count = places.count(), lights = rays.lights.size();
  if (count == 0 || lights == 0) return Certificate{};
  Result<Reader> reader = Reader::create(bake, context);
  if (!reader) return reader.error();

  std::vector<std::uint32_t> kind, receivers(bake.instances.size(), 0);
  std::vector<float> squared, deviation;
  std::vector<double> part(bake.instances.size(), 0.0);
  for (const std::uint32_t instance : places.instance) ++receivers[instance];
  std::vector<glm::vec3> read(count);
  std::vector<double> error(count);
  for (std::size_t l = 0; l < lights; ++l) {
    if (!context.progress("certificate", static_cast<double>(l) / static_cast<double>(lights))) return cancelledError();
    const double mean = static_cast<double>(rays.meanLight[l]);
    if (!(mean > 0.0)) continue;
    if (const Status status = reader->read(rays.lights[l], places, read); !status) return status.error();
    const double each = 1.0 / (3.0 * static_cast<double>(count) * mean * mean);
    double sum = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const glm::dvec3 t(read[i]), r1(rays.irradiance[0][i * lights + l]), r2(rays.irradiance[1][i * lights + l]);
      error[i] = each * glm::dot(r1 - t, r2 - t);
      sum += error[i];
      squares += error[i] * error[i];
    }
    kind.push_back(static_cast<std::uint32_t>(rays.lights[l].kind));
    squared.push_back(static_cast<float>(sum));
    deviation.push_back(static_cast<float>(std::sqrt(std::max(0.0, squares - sum * sum / static_cast<double>(count)))));
    for (std::size_t i = 0; i < count; ++i) part[places.instance[i]] += error[i];
  }
  if (context.cancelled()) return cancelledError();
  if (kind.empty()) return Certificate{};
  std::vector<float> partError;
  for (const double sum : part) partError.push_back(static_cast<float>(sum / static_cast<double>(kind.size())));
  return Certificate{std::move(kind), std::move(squared), std::move(deviation), std::move(receivers),
                     std::move(partError)};
}

}  // namespace relume
