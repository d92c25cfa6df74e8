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

namespace relume {
namespace {

// Of the light that one bounce adds, what the next adds is at most this.
constexpr double kMostKept = 0.95;

// What the runtime reads at the receivers under one light, after one bounce and after all.
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

  Status read(const TestLight& light, std::span<const std::uint32_t> receiver, std::span<glm::vec3> once,
              std::span<glm::vec3> all) {
    for (std::size_t s = 0; s < direct_.size(); ++s)
      direct_[s] = glm::vec3(light.surfelIrradiance.empty() ? 0.0f : light.surfelIrradiance[s]);
    LightSetup setup;
    setup.surfelIrradiance = direct_;
    setup.emissionScale = glm::vec3(0.0f);
    setup.skyRadiance = glm::vec3(light.kind == TestLightKind::sky ? 1.0f : 0.0f);
    setup.bounceScale = 0.0f;
    if (const Status status = relighter_.relight(setup); !status) return status;
    readAt(receiver, once);
    // Two more bounces, and the others as if each of them kept as much of the one before as these do.
    setup.bounceScale = 1.0f;
    if (const Status status = relighter_.relight(setup); !status) return status;
    std::vector<glm::vec3> second(receiver.size());
    readAt(receiver, second);
    if (const Status status = relighter_.relight(setup); !status) return status;
    readAt(receiver, all);
    double added = 0.0, kept = 0.0;
    for (std::size_t i = 0; i < receiver.size(); ++i) {
      added += static_cast<double>(glm::dot(second[i] - once[i], glm::vec3(1.0f)));
      kept += static_cast<double>(glm::dot(all[i] - second[i], glm::vec3(1.0f)));
    }
    const double ratio = added > 0.0 ? std::clamp(kept / added, 0.0, kMostKept) : 0.0;
    for (std::size_t i = 0; i < receiver.size(); ++i)
      all[i] += (all[i] - second[i]) * static_cast<float>(ratio / (1.0 - ratio));
    return done();
  }

 private:
  Reader(const Bake& bake, Relighter relighter)
      : bake_(&bake), relighter_(std::move(relighter)), direct_(bake.surfels.count()) {}

  void readAt(std::span<const std::uint32_t> receiver, std::span<glm::vec3> irradiance) const {
    const Surfels& surfels = bake_->surfels;
    for (std::size_t i = 0; i < receiver.size(); ++i) {
      const std::uint32_t s = receiver[i], at = surfels.receiver[s];
      irradiance[i] = at == kGridReceiver ? relighter_.irradianceInGrid(surfels.positionWorld[s], surfels.normal[s])
                                          : relighter_.irradianceOnLightmap(unpackUnorm16x2(at), surfels.normal[s]);
    }
  }

  const Bake* bake_;
  Relighter relighter_;
  std::vector<glm::vec3> direct_;  // [Size n_S]
};

}  // namespace

Result<Certificate> certify(const Bake& bake, const TestRays& rays, Context& context) {
  const std::size_t count = rays.receiver.size(), lights = rays.lights.size();
  if (count == 0 || lights == 0) return Certificate{};
  Result<Reader> reader = Reader::create(bake, context);
  if (!reader) return reader.error();

  std::vector<std::uint32_t> kind, receivers(bake.instances.size(), 0);
  std::vector<float> squared, deviation;
  std::vector<double> part(bake.instances.size(), 0.0);
  for (const std::uint32_t s : rays.receiver) ++receivers[bake.surfels.instance[s]];
  std::vector<glm::vec3> once(count), all(count);
  std::vector<double> error(count);
  for (std::size_t l = 0; l < lights; ++l) {
    if (!context.progress("certificate", static_cast<double>(l) / static_cast<double>(lights))) return cancelledError();
    if (const Status status = reader->read(rays.lights[l], rays.receiver, once, all); !status) return status.error();
    double sum = 0.0, squares = 0.0, light = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const glm::dvec3 t(once[i]), r1(rays.irradiance[0][i * lights + l]), r2(rays.irradiance[1][i * lights + l]);
      error[i] = glm::dot(r1 - t, r2 - t);
      sum += error[i];
      squares += error[i] * error[i];
      light += glm::dot(glm::dvec3(all[i]), glm::dvec3(all[i]));
    }
    if (!(light > 0.0)) continue;
    kind.push_back(static_cast<std::uint32_t>(rays.lights[l].kind));
    squared.push_back(static_cast<float>(sum / light));
    deviation.push_back(
        static_cast<float>(std::sqrt(std::max(0.0, squares - sum * sum / static_cast<double>(count))) / light));
    for (std::size_t i = 0; i < count; ++i) part[bake.surfels.instance[rays.receiver[i]]] += error[i] / light;
  }
  if (context.cancelled()) return cancelledError();
  if (kind.empty()) return Certificate{};
  std::vector<float> partError;
  for (const double sum : part) partError.push_back(static_cast<float>(sum / static_cast<double>(kind.size())));
  return Certificate{std::move(kind), std::move(squared), std::move(deviation), std::move(receivers),
                     std::move(partError)};
}

}  // namespace relume
