// SPDX-License-Identifier: MIT
// See shade.h.
#include "bake/preview/shade.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/preview/receivers.h"
#include "bake/reference/path_tracer.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace relume {
namespace {

constexpr std::uint32_t kShadeStage = 0x72637370;  // the random streams' stage
constexpr float kInvPi = std::numbers::inv_pi_v<float>;
constexpr std::uint32_t kRaysAtOnce = 1024;  // of a row, in each thread; at least one pixel's
constexpr float kSameNormal = 0.98f;         // cosine within which a sub-pixel shows what its pixel's centre shows
constexpr float kSamePlane = 1.0f;           // [pixel] off the centre's plane, likewise

std::uint32_t reversedBits(std::uint32_t i) {
  std::uint32_t reversed = 0;
  for (int bit = 0; bit < 32; ++bit, i >>= 1) reversed = reversed << 1 | (i & 1u);
  return reversed;
}

// The second dimension of Sobol's sequence, of which reversedBits() is the first.
std::uint32_t sobol(std::uint32_t i) {
  std::uint32_t point = 0;
  for (std::uint32_t v = 1u << 31; i != 0; i >>= 1, v ^= v >> 1) {
    if ((i & 1u) != 0) point ^= v;
  }
  return point;
}

float toUnit(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

class Shader {
 public:
  // What a sub-pixel shows.
  struct Sample {
    std::size_t ray;
    PixelReceiver receiver;
    glm::vec3 albedo;
    MirrorSurface mirror;
  };
  // What emitters send a pixel, by the points that are drawn on them.
  struct EmitterSums {
    glm::vec3 arriving{0.0f}, open{0.0f};  // [W/m²] summed: with what is in the way, and without, and without textures
    glm::vec3 reflected{0.0f};             // [W/m²/sr] of `arriving`, by the pixel's box filter
    glm::vec3 noise{0.0f};                 // [W/m²/sr] likewise of `open`, less what that is in closed form
  };
  // Memory of one thread.
  struct Scratch {
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    std::vector<Sample> samples;
    std::vector<glm::vec3> position, normal, direct;  // [Size samples] the last: irradiance by punctual lights
    std::vector<float> chances;
    std::vector<EmitterSums> emitters;  // [Size pixels of a span]
    MirrorShader::Scratch mirror;
  };

  Shader(const ShadeInput& input, PreviewFrame& frame) : in_(input), frame_(frame), make_(input.camera) {
    if (in_.mirrors != nullptr) mirrors_.emplace(*in_.mirrors);
  }

  // One row of pixels.
  void row(std::uint32_t y, Scratch& scratch, const Context& context) const {
    const std::uint32_t samples = in_.options.samples, width = kRaysAtOnce / (samples * samples);
    for (std::uint32_t x = 0; x < frame_.width && !context.cancelled(); x += width)
      span(y, x, std::min(x + width, frame_.width), scratch, context);
  }

 private:
  void span(std::uint32_t y, std::uint32_t begin, std::uint32_t end, Scratch& scratch, const Context& context) const {
    const std::uint32_t samples = in_.options.samples, count = samples * samples;
    const float step = 1.0f / static_cast<float>(samples);
    std::vector<Ray>& rays = scratch.rays;
    std::vector<Hit>& hits = scratch.hits;
    rays.clear();
    for (std::uint32_t x = begin; x < end; ++x) {
      for (std::uint32_t s = 0; s < count; ++s) {
        Ray& ray = rays.emplace_back();
        in_.camera.at(static_cast<float>(x) + (static_cast<float>(s % samples) + 0.5f) * step,
                      static_cast<float>(y) + (static_cast<float>(s / samples) + 0.5f) * step, ray.origin,
                      ray.direction);
      }
    }
    hits.resize(rays.size());
    in_.scene.drawn.trace(rays, hits, RayOrder::coherent);
    findSamples(std::size_t{y} * frame_.width + begin, scratch);
    scratch.direct.resize(scratch.samples.size());
    directIrradiance(in_.scene.drawn, in_.scene.lights, scratch.position, scratch.normal, scratch.direct);
    scratch.emitters.assign(end - begin, {});
    for (std::size_t i = 0; i < scratch.samples.size() && !context.cancelled(); ++i) {
      const auto ray = static_cast<std::uint32_t>(scratch.samples[i].ray);
      addSample(begin + ray / count, y, ray % count, scratch.samples[i], scratch.direct[i],
                scratch.emitters[ray / count], scratch);
    }
    for (std::uint32_t x = begin; x < end; ++x)
      frame_.straight[std::size_t{y} * frame_.width + x] += withoutNoise(scratch.emitters[x - begin]);
  }

  // What the rays end on, but for the sky, which is added to the pixels from `first` on.
  void findSamples(std::size_t first, Scratch& scratch) const {
    const Scene& scene = in_.scene.drawn.scene();
    const std::uint32_t count = in_.options.samples * in_.options.samples;
    scratch.samples.clear();
    scratch.position.clear();
    scratch.normal.clear();
    for (std::size_t i = 0; i < scratch.rays.size(); ++i) {
      const Ray& ray = scratch.rays[i];
      if (!scratch.hits[i]) {
        frame_.emission[first + i / count] += 1.0f / static_cast<float>(count) * in_.scene.sky.along(ray.direction);
        continue;
      }
      const SeenSurface seen = seenAt(scene, ray, scratch.hits[i]);
      Sample& sample = scratch.samples.emplace_back(Sample{i, make_.at(seen), glm::vec3(0.0f), {}});
      if (mirrors_) {
        sample.mirror = mirrorAt(scene, ray, seen);
        sample.albedo = sample.mirror.diffuse;
        if (sample.mirror.normal != sample.receiver.normal) sample.receiver.bent = sample.mirror.normal;
      } else {
        sample.albedo = albedoAt(scene, seen.point);
      }
      scratch.position.push_back(sample.receiver.positionWorld);
      scratch.normal.push_back(sample.receiver.litNormal());
    }
  }

  // direct: irradiance by punctual lights.
  void addSample(std::uint32_t x, std::uint32_t y, std::uint32_t sample, const Sample& shown, const glm::vec3& direct,
                 EmitterSums& sums, Scratch& scratch) const {
    const std::size_t pixel = std::size_t{y} * frame_.width + x;
    const float weight = 1.0f / static_cast<float>(in_.options.samples * in_.options.samples);
    const Scene& scene = in_.scene.drawn.scene();
    const PixelReceiver& receiver = shown.receiver;
    const glm::vec3& albedo = shown.albedo;
    const MirrorSurface& mirror = shown.mirror;
    const Hit& hit = scratch.hits[shown.ray];
    const glm::vec3 reflected = weight * kInvPi * albedo;
    const Splat light = mirrors_ && albedo == glm::vec3(0.0f) ? Splat{} : indirectAt(x, y, receiver);
    const EmitterLight emitted = fromEmitters(pixel, sample, receiver, mirror, scratch.chances);
    sums.arriving += emitted.irradiance;
    sums.open += emitted.open;
    sums.reflected += reflected * emitted.irradiance;
    sums.noise += reflected * (emitted.open - emitted.inClosedForm);
    frame_.albedo[pixel] += weight * albedo;
    frame_.bounced[pixel] += reflected * light.reflected;
    frame_.straight[pixel] += reflected * light.sky;
    frame_.direct[pixel] += reflected * direct;
    if (mirrors_) addMirrored(x, y, sample, receiver, mirror, emitted.mirrored, scratch.mirror);
    if (in_.emitters != nullptr && (!hit.back || scene.bothSides(scene.instances[hit.instance], hit.triangle)))
      frame_.emission[pixel] += weight * emissionAt(scene, hit.point());
  }

  // Add what the surface mirrors. emitted: of emitters, where records have the rest.
  void addMirrored(std::uint32_t x, std::uint32_t y, std::uint32_t sample, const PixelReceiver& receiver,
                   const MirrorSurface& mirror, const glm::vec3& emitted, MirrorShader::Scratch& scratch) const {
    const std::size_t pixel = std::size_t{y} * frame_.width + x;
    const std::uint32_t samples = in_.options.samples * in_.options.samples;
    const PixelReceiver& center = in_.receivers[pixel];
    const MirroredLight light = mirrors_->light(x, y, pixel, std::uint64_t{pixel} * samples + sample, receiver,
                                                isSame(center, receiver) ? &center : nullptr, mirror, scratch);
    const glm::vec3 share = mirror.specular / static_cast<float>(samples);
    frame_.mirrored[pixel] += share * light.radiance;
    frame_.highlights[pixel] += share * directHighlights(in_.scene.drawn, in_.scene.lights, receiver.positionWorld,
                                                         receiver.geometricNormal, mirror.axis, mirror.exponent);
    if (!light.alongRay) frame_.highlights[pixel] += share * emitted;
  }

  // Whether a sub-pixel shows the surface that its pixel's centre shows.
  static bool isSame(const PixelReceiver& center, const PixelReceiver& r) {
    return glm::dot(center.normal, r.normal) > kSameNormal &&
           std::abs(glm::dot(r.positionWorld - center.positionWorld, center.normal)) < kSamePlane * center.footprint;
  }

  // Whether the centre of a pixel has diffuse light: metals have none.
  bool scatters(std::size_t pixel) const { return !mirrors_ || in_.centers[pixel].weight > 0.0f; }

  Splat indirectAt(std::uint32_t x, std::uint32_t y, const PixelReceiver& r) const {
    const std::size_t pixel = std::size_t{y} * frame_.width + x;
    const PixelReceiver& center = in_.receivers[pixel];
    if (isSame(center, r) && r.bent == glm::vec3(0.0f) && scatters(pixel)) return in_.centers[pixel];
    const Splat own = in_.tiles.splat(x, y, r);
    if (own.weight > 0.0f) return own;
    // Too thin for a pixel's centre to have shown it: as whichever neighbour is most alike.
    return mostAlike(x, y, r);
  }

  Splat mostAlike(std::uint32_t x, std::uint32_t y, const PixelReceiver& r) const {
    Splat best;
    float bestError = 0.0f;
    for (std::uint32_t v = y > 2 ? y - 2 : 0; v <= std::min(y + 2, frame_.height - 1); ++v) {
      for (std::uint32_t u = x > 2 ? x - 2 : 0; u <= std::min(x + 2, frame_.width - 1); ++u) {
        const std::size_t pixel = std::size_t{v} * frame_.width + u;
        const PixelReceiver& other = in_.receivers[pixel];
        if (other.normal == glm::vec3(0.0f) || !scatters(pixel)) continue;
        const float error = 1.0f - glm::dot(r.normal, other.normal) +
                            glm::distance(r.positionWorld, other.positionWorld) / (16.0f * r.footprint);
        if (best.weight > 0.0f && error >= bestError) continue;
        best = in_.centers[pixel];
        best.weight = 1.0f;
        bestError = error;
      }
    }
    return best;
  }

  struct EmitterLight {
    glm::vec3 irradiance{0.0f};    // [W/m²]
    glm::vec3 open{0.0f};          // [W/m²] by the same points, if nothing were in the way
    glm::vec3 inClosedForm{0.0f};  // [W/m²] what `open` is an estimate of
    glm::vec3 mirrored{0.0f};      // [W/m²/sr] mean radiance in a lobe that records carry
  };

  // The light of emitters less the noise that it has without anything in the way, in proportion to what arrives. Where
  // all arrives the closed form is left (Heitz, Hill, McGuire, "Combining Analytic Direct Illumination and Stochastic
  // Shadows", I3D 2018); where none does, nothing changes.
  static glm::vec3 withoutNoise(const EmitterSums& sums) {
    glm::vec3 light = sums.reflected;
    for (int c = 0; c < 3; ++c) {
      if (sums.open[c] > 0.0f) light[c] = std::max(0.0f, light[c] - sums.arriving[c] / sums.open[c] * sums.noise[c]);
    }
    return light;
  }

  // Light by points on emitters, stratified over the pixel's samples. Runs of consecutive points, which share a
  // triangle, are spread over it as a (0, 2) sequence; a random bit mask for each pixel keeps its pattern from showing.
  EmitterLight fromEmitters(std::size_t pixel, std::uint32_t sample, const PixelReceiver& r,
                            const MirrorSurface& mirror, std::vector<float>& chances) const {
    EmitterLight light;
    if (in_.emitters == nullptr || in_.emitters->empty()) return light;
    const std::uint32_t samples = in_.options.samples * in_.options.samples;
    const std::uint32_t each = std::max(1u, (in_.options.emitterRays + samples - 1) / samples), count = each * samples;
    RandomStream random(in_.options.seed, kShadeStage, pixel);
    const std::uint32_t first = random.below(count), maskX = random.bits(), maskY = random.bits();
    const float jitter = random.uniform();
    const glm::vec3 origin = r.positionWorld + r.geometricNormal * in_.scene.transport.epsilonAt(r.positionWorld);
    const float lobe = mirror.byRecords()
                           ? in_.mirrors->lobes.integral(mirror.exponent, glm::dot(mirror.axis, r.geometricNormal))
                           : 0.0f;
    const bool known = in_.emitters->knowsOpenIrradiance();
    in_.emitters->aim(origin, r.litNormal(), chances);
    for (std::uint32_t k = 0; k < each; ++k) {
      const std::uint32_t i = (first + sample + k * samples) % count;
      const double u = (static_cast<double>(i) + jitter) / count;
      const glm::vec2 v(toUnit(reversedBits(i) ^ maskX), toUnit(sobol(i) ^ maskY));
      const EmitterSample point = in_.emitters->sample(chances, u, v);
      const EmitterConnection seen =
          connectEmitter(in_.scene.transport, point, origin, r.litNormal(), r.geometricNormal);
      const glm::vec3 irradiance = seen.irradiance();
      light.irradiance += irradiance;
      if (known) light.open += seen.openIrradiance();
      if (lobe <= 0.0f || irradiance == glm::vec3(0.0f)) continue;
      const float toward = glm::dot(glm::normalize(point.position - origin), mirror.axis);
      if (toward > 0.0f) light.mirrored += irradiance * (std::pow(toward, mirror.exponent) / (lobe * seen.cosine));
    }
    light.irradiance /= static_cast<float>(each);
    light.open /= static_cast<float>(each);
    if (known) light.inClosedForm = in_.emitters->openIrradiance(origin, r.litNormal(), r.geometricNormal);
    light.mirrored /= static_cast<float>(each);
    return light;
  }

  const ShadeInput& in_;
  PreviewFrame& frame_;
  ReceiverMaker make_;
  std::optional<MirrorShader> mirrors_;
};

}  // namespace

void shadeFrame(const ShadeInput& input, PreviewFrame& frame, Context& context) {
  const Shader shader(input, frame);
  parallelChunks(context, "draw", frame.height, 1, [&](std::size_t begin, std::size_t end) {
    Shader::Scratch scratch;
    for (std::size_t y = begin; y < end; ++y) shader.row(static_cast<std::uint32_t>(y), scratch, context);
  });
}

}  // namespace relume
