// SPDX-License-Identifier: MIT
// A path tracer for Lambertian surfaces: paths from the camera by cosine-weighted directions; at every vertex the
// punctual lights and a point on the emitters, the latter weighed against hitting them by chance (balance heuristic,
// Veach 1995). Russian roulette after kRouletteAfter reflections.
//
// Radiance of a Lambertian surface is albedo / pi * E. The layers hold E / pi, so a camera path carries no albedo of
// its first surface; the pixel's mean is then weighted by that albedo.
#include "bake/reference/path_tracer.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/reference/emitters.h"
#include "formats/frame_about.h"
#include "relume/glossy.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace relume {
namespace {

constexpr float kPi = 3.14159265358979f;
constexpr std::uint32_t kStage = 0x70617468;  // the random streams' stage
constexpr std::uint32_t kRouletteAfter = 4;   // reflections before roulette
constexpr std::size_t kPixelsPerChunk = 32;
constexpr int kMaxTries = 64;  // directions drawn from a lobe until one is above the surface

// A point of a path, seen from the side its normals point to.
struct Vertex {
  glm::vec3 position{0.0f};                  // [m]
  glm::vec3 geometric{0.0f}, shading{0.0f};  // unit, toward the viewer
  glm::vec3 albedo{0.0f};
  glm::vec3 emission{0.0f};  // [W/m²/sr] toward the viewer
};

struct Renderer {
  const RayTracer& tracer;
  const RayTracer& drawn;  // for camera rays and the shadows of punctual lights
  const Camera& camera;
  std::span<const SceneLight> lights;
  const ReferenceOptions& options;
  const EmittingTriangles* emitters;  // null = emitting surfaces are off
  const Context& context;             // asked at every vertex of a path: a pixel may take a million of them

  const Scene& scene() const { return tracer.scene(); }
};

// The vertex at a hit, its normals turned to the side the ray came from.
Vertex vertexAt(const Renderer& r, const Hit& hit) {
  const SurfacePoint p = hit.point();
  const Instance& instance = r.scene().instances[p.instance];
  const auto c = r.scene().corners(instance, p.triangle);
  Vertex v;
  v.position = c[0] + (c[1] - c[0]) * p.barycentric.x + (c[2] - c[0]) * p.barycentric.y;
  const float side = hit.back ? -1.0f : 1.0f;
  v.geometric = side * geometricNormal(r.scene(), p);
  v.shading = side * shadingNormal(r.scene(), p);
  v.albedo = albedoAt(r.scene(), p);
  if (r.emitters != nullptr && (!hit.back || r.scene().bothSides(instance, p.triangle))) {
    v.emission = emissionAt(r.scene(), p);
  }
  return v;
}

glm::vec3 startOf(const Renderer& r, const Vertex& v) {
  return v.position + v.geometric * r.tracer.epsilonAt(v.position);
}

// Irradiance / pi at a vertex by the punctual lights.
glm::vec3 fromPunctual(const Renderer& r, const Vertex& v) {
  const glm::vec3 origin = startOf(r, v);
  glm::vec3 sum(0.0f);
  for (const SceneLight& light : r.lights) {
    glm::vec3 toLight;
    float distance = 0.0f;
    const glm::vec3 irradiance = lightIrradiance(light, origin, v.shading, toLight, distance);
    if (irradiance == glm::vec3(0.0f) || glm::dot(toLight, v.geometric) <= 0.0f) continue;
    if (!r.drawn.occluded({origin, 0.0f, toLight, distance})) sum += irradiance;
  }
  return sum / kPi;
}

// Share of the two ways to find a point of an emitter: by area (density per area) or by a cosine-weighted ray. Both as
// density per area: the ray's is cos/pi * cosEmitter/d².
float areaWeight(float areaDensity, float cosine, float cosEmitter, float distance) {
  return areaDensity / (areaDensity + cosine * cosEmitter / (kPi * distance * distance));
}

// Irradiance / pi at a vertex by a point drawn on the emitters, weighed against fromDirection().
glm::vec3 fromEmitters(const Renderer& r, const Vertex& v, RandomStream& random) {
  if (r.emitters == nullptr || r.emitters->empty()) return glm::vec3(0.0f);
  const EmitterConnection c =
      connectEmitter(r.tracer, r.emitters->sample(random), startOf(r, v), v.shading, v.geometric);
  if (c.radiance == glm::vec3(0.0f)) return glm::vec3(0.0f);
  return areaWeight(c.density, c.cosine, c.cosEmitter, c.distance) / kPi * c.irradiance();
}

// The direction at a cosine and an angle about n.
glm::vec3 directionAbout(const glm::vec3& n, float cosine, float angle) {
  const float radius = std::sqrt(std::max(0.0f, 1.0f - cosine * cosine));
  const float x = radius * std::cos(angle), y = radius * std::sin(angle);
  const glm::mat3 frame = frameAbout(n);
  return glm::normalize(frame[0] * x + frame[1] * y + n * cosine);
}

// A cosine-weighted direction about n (Malley).
glm::vec3 cosineDirection(const glm::vec3& n, const glm::vec2& u) {
  return directionAbout(n, std::sqrt(std::max(0.0f, 1.0f - u.x)), 2.0f * kPi * u.y);
}

struct Arriving {
  glm::vec3 direct{0.0f}, indirect{0.0f};  // irradiance / pi
};

// One estimate of the light that arrives at a vertex, reflected so many times before at most.
Arriving arrivingLight(const Renderer& r, Vertex v, std::uint32_t maxBounces, RandomStream& random) {
  Arriving light;
  light.direct = fromPunctual(r, v) + fromEmitters(r, v, random);

  // Follow the light backwards: after k reflections, emission and sky found by the next ray were reflected k times.
  glm::vec3 throughput(1.0f);
  for (std::uint32_t k = 0;; ++k) {
    if (r.context.cancelled()) return light;
    glm::vec3& layer = k == 0 ? light.direct : light.indirect;
    const bool last = k == maxBounces;
    if (last && r.emitters == nullptr && r.options.sky.isDark()) return light;
    const glm::vec3 origin = startOf(r, v), direction = cosineDirection(v.shading, random.uniform2());
    if (glm::dot(direction, v.geometric) <= 0.0f) return light;
    const Hit hit = r.tracer.trace({origin, 0.0f, direction});
    if (!hit) {
      layer += throughput * r.options.sky.along(direction);
      return light;
    }

    const Vertex next = vertexAt(r, hit);
    if (next.emission != glm::vec3(0.0f)) {
      const float cosine = glm::dot(v.shading, direction), cosEmitter = -glm::dot(next.geometric, direction);
      const float density = r.emitters->density(hit.point());
      const float byArea = cosine > 0.0f && cosEmitter > 0.0f && density > 0.0f
                               ? areaWeight(density, cosine, cosEmitter, std::max(hit.distance, 1e-20f))
                               : 0.0f;
      layer += throughput * next.emission * (1.0f - byArea);
    }
    if (last) return light;

    // Reflect.
    v = next;
    throughput *= v.albedo;
    if (throughput == glm::vec3(0.0f)) return light;
    if (k >= kRouletteAfter) {
      const float survival = std::min(0.95f, std::max({throughput.x, throughput.y, throughput.z}));
      if (random.uniform() >= survival) return light;
      throughput /= survival;
    }
    light.indirect += throughput * (fromPunctual(r, v) + fromEmitters(r, v, random));
  }
}

// One estimate of the light that a lobe about the reflected direction sees above the surface.
Arriving glossyLight(const Renderer& r, const Vertex& v, const glm::vec3& toward, float exponent,
                     RandomStream& random) {
  const glm::vec3 reflected = glm::reflect(toward, v.shading);
  Arriving light;
  if (r.options.gloss) light.direct = directHighlights(r.drawn, r.lights, v.position, v.geometric, reflected, exponent);
  const glm::vec3 direction = lobeDirectionAbove(reflected, exponent, v.geometric, random);
  if (direction == glm::vec3(0.0f)) return light;
  const Hit hit = r.tracer.trace({startOf(r, v), 0.0f, direction});
  if (!hit) {
    light.direct += r.options.sky.along(direction);
    return light;
  }
  const Vertex next = vertexAt(r, hit);
  light.direct += next.emission;
  if (next.albedo == glm::vec3(0.0f) || r.options.maxBounces == 0) return light;
  const Arriving there = arrivingLight(r, next, r.options.maxBounces - 1, random);
  light.indirect = next.albedo * (there.direct + there.indirect);
  return light;
}

// One estimate of how far what is around hides a vertex.
float occlusionOf(const Renderer& r, const Vertex& v, float falloff, RandomStream& random) {
  const glm::vec3 direction = cosineDirection(v.shading, random.uniform2());
  if (glm::dot(direction, v.geometric) <= 0.0f) return 1.0f;
  const Hit hit = r.tracer.trace({startOf(r, v), 0.0f, direction});
  return hit ? 1.0f / (1.0f + falloff * hit.distance) : 0.0f;
}

// The camera's ray through a point of the image, in pixels from its top left corner.
Ray cameraRay(const Renderer& r, const glm::vec2& pixel) {
  const float width = static_cast<float>(r.options.width), height = static_cast<float>(r.options.height);
  const glm::vec2 screen((2.0f * pixel.x - width) / height, 1.0f - 2.0f * pixel.y / height);
  const glm::mat4& m = r.camera.toWorld;
  const glm::vec3 right = glm::normalize(glm::vec3(m[0])), up = glm::normalize(glm::vec3(m[1]));
  const glm::vec3 forward = -glm::normalize(glm::vec3(m[2])), eye(m[3]);
  if (r.camera.orthographic) return {eye + r.camera.yMag * (screen.x * right + screen.y * up), 0.0f, forward};
  const float half = std::tan(0.5f * r.camera.yfovRad);
  return {eye, 0.0f, glm::normalize(forward + half * (screen.x * right + screen.y * up))};
}

// How a vertex mirrors: the share of light, and the lobe.
struct GlossyPart {
  glm::vec3 specular{1.0f};
  float exponent = 0.0f;
};

// The normal map, and what the material mirrors, of a vertex that the camera sees along `toward`; its albedo becomes
// what it scatters.
GlossyPart makeGlossy(const Renderer& r, const Hit& hit, const glm::vec3& toward, Vertex& v) {
  if (!r.options.gloss) return {glm::vec3(1.0f), r.options.exponent.value_or(0.0f)};
  const SurfacePoint p = hit.point();
  v.shading = (hit.back ? -1.0f : 1.0f) * mappedNormal(r.scene(), p);
  const SurfaceGloss gloss = glossAt(r.scene(), p);
  const ReflectanceSplit split =
      splitReflectance(v.albedo, gloss.metalness, gloss.roughness, -glm::dot(toward, v.shading));
  v.albedo = split.diffuse;
  return {split.specular, glossyExponent(gloss.roughness)};
}

bool isGlossy(const ReferenceOptions& options) { return options.exponent || options.gloss; }

// Sums over one half of a pixel's samples.
struct Sums {
  glm::vec3 direct{0.0f}, indirect{0.0f}, albedo{0.0f}, emission{0.0f};  // radiance and albedo
  glm::vec3 glossyDirect{0.0f}, glossyIndirect{0.0f};
  float occlusion = 0.0f;
};

glm::vec3 divideOut(const glm::vec3& radiance, const glm::vec3& albedo) {
  glm::vec3 result(0.0f);
  for (int c = 0; c < 3; ++c) {
    if (albedo[c] > 0.0f) result[c] = radiance[c] / albedo[c];
  }
  return result;
}

// One camera path through a uniformly drawn point of a pixel.
void samplePixel(const Renderer& r, std::uint32_t x, std::uint32_t y, std::uint64_t item, Sums& sums) {
  RandomStream random(r.options.seed, kStage, item);
  const glm::vec2 pixel = glm::vec2(x, y) + random.uniform2();
  const Ray ray = cameraRay(r, pixel);
  const Hit hit = r.drawn.trace(ray);
  if (!hit) {
    sums.emission += r.options.sky.along(ray.direction);
    return;
  }
  Vertex v = vertexAt(r, hit);
  const GlossyPart glossyPart = makeGlossy(r, hit, ray.direction, v);
  sums.emission += v.emission;
  sums.albedo += v.albedo;
  if (v.albedo != glm::vec3(0.0f)) {
    const Arriving light = arrivingLight(r, v, r.options.maxBounces, random);
    sums.direct += v.albedo * light.direct;
    sums.indirect += v.albedo * light.indirect;
  }
  if (r.options.occlusionFalloff) sums.occlusion += occlusionOf(r, v, *r.options.occlusionFalloff, random);
  if (!isGlossy(r.options)) return;
  const Arriving glossy = glossyLight(r, v, ray.direction, glossyPart.exponent, random);
  sums.glossyDirect += glossyPart.specular * glossy.direct;
  sums.glossyIndirect += glossyPart.specular * glossy.indirect;
}

void renderPixel(const Renderer& r, std::size_t index, ReferenceImage& image) {
  const auto x = static_cast<std::uint32_t>(index % image.width), y = static_cast<std::uint32_t>(index / image.width);
  const std::uint32_t samples = r.options.samplesPerPixel;
  std::array<Sums, 2> half;
  for (std::uint32_t s = 0; s < samples && !r.context.cancelled(); ++s) {
    samplePixel(r, x, y, std::uint64_t{index} * samples + s, half[s % 2]);
  }
  const glm::vec3 albedo = half[0].albedo + half[1].albedo;
  image.direct[index] = divideOut(half[0].direct + half[1].direct, albedo);
  image.indirect[index] = divideOut(half[0].indirect + half[1].indirect, albedo);
  image.albedo[index] = albedo / static_cast<float>(samples);
  image.emission[index] = (half[0].emission + half[1].emission) / static_cast<float>(samples);
  if (r.options.occlusionFalloff)
    image.open[index] = 1.0f - (half[0].occlusion + half[1].occlusion) / static_cast<float>(samples);
  if (samples > 1) {
    const auto error = [&](glm::vec3 Sums::*layer) {
      return 0.5f * (divideOut(half[0].*layer, half[0].albedo) - divideOut(half[1].*layer, half[1].albedo));
    };
    image.directError[index] = error(&Sums::direct);
    image.indirectError[index] = error(&Sums::indirect);
  }
  if (isGlossy(r.options)) {
    const float each = 1.0f / static_cast<float>(samples);
    image.glossyDirect[index] = each * (half[0].glossyDirect + half[1].glossyDirect);
    image.glossyIndirect[index] = each * (half[0].glossyIndirect + half[1].glossyIndirect);
    if (samples > 1) {
      image.glossyDirectError[index] = each * (half[0].glossyDirect - half[1].glossyDirect);
      image.glossyIndirectError[index] = each * (half[0].glossyIndirect - half[1].glossyIndirect);
    }
  }

  // Geometry at the pixel's centre.
  const Hit hit = r.drawn.trace(cameraRay(r, glm::vec2(x, y) + 0.5f));
  if (!hit) return;
  Vertex v = vertexAt(r, hit);
  makeGlossy(r, hit, cameraRay(r, glm::vec2(x, y) + 0.5f).direction, v);
  const glm::vec3 forward = -glm::normalize(glm::vec3(r.camera.toWorld[2]));
  image.position[index] = v.position;
  image.normal[index] = v.shading;
  image.depth[index] = glm::dot(v.position - glm::vec3(r.camera.toWorld[3]), forward);
}

Status checkReferenceOptions(const ReferenceOptions& o) {
  const auto outside = [](const char* name, std::uint64_t value, std::uint64_t min, std::uint64_t max) {
    return Error{ErrorCode::usage, std::string("reference: ") + name + " must be " + std::to_string(min) + ".." +
                                       std::to_string(max) + ", found " + std::to_string(value)};
  };
  if (o.width < 1 || o.width > 16384) return outside("width", o.width, 1, 16384);
  if (o.height < 1 || o.height > 16384) return outside("height", o.height, 1, 16384);
  if (o.samplesPerPixel < 1 || o.samplesPerPixel > 1000000) return outside("samples", o.samplesPerPixel, 1, 1000000);
  if (o.maxBounces > 1024) return outside("bounces", o.maxBounces, 0, 1024);
  if (o.exponent && !(*o.exponent >= 0.0f && *o.exponent <= kMaxExponent))
    return Error{ErrorCode::usage, "reference: exponent must be 0..10000"};
  if (o.occlusionFalloff && !(*o.occlusionFalloff >= 0.0f && *o.occlusionFalloff <= 1e6f))
    return Error{ErrorCode::usage, "reference: the falloff of occlusion must be 0..1e6"};
  if (o.exponent && o.gloss)
    return Error{ErrorCode::usage, "reference: exponent and gloss: one of them expected, both found"};
  return done();
}

}  // namespace

glm::vec3 lobeDirection(const glm::vec3& axis, float exponent, const glm::vec2& u) {
  return directionAbout(axis, std::pow(1.0f - u.x, 1.0f / (exponent + 1.0f)), 2.0f * kPi * u.y);
}

glm::vec3 lobeDirectionAbove(const glm::vec3& axis, float exponent, const glm::vec3& geometric, RandomStream& random) {
  for (int tries = 0; tries < kMaxTries; ++tries) {
    const glm::vec3 direction = lobeDirection(axis, exponent, random.uniform2());
    if (glm::dot(direction, geometric) > 0.0f) return direction;
  }
  return glm::vec3(0.0f);
}

Result<ReferenceImage> renderReference(const RayTracer& tracer, const Camera& camera,
                                       std::span<const SceneLight> lights, const ReferenceOptions& options,
                                       Context& context, const RayTracer* drawn) {
  if (Status ok = checkReferenceOptions(options); !ok) return ok.error();
  const Context::Stage stage(context, "reference");
  const EmittingTriangles emitters(tracer.scene(), tracer.geometry());
  const Renderer renderer{
      tracer, drawn ? *drawn : tracer, camera, lights, options, options.emissive ? &emitters : nullptr, context};

  ReferenceImage image;
  image.width = options.width;
  image.height = options.height;
  const std::size_t pixels = std::size_t{options.width} * options.height;
  for (auto* layer : {&image.direct, &image.indirect, &image.directError, &image.indirectError, &image.albedo,
                      &image.emission, &image.position, &image.normal}) {
    layer->assign(pixels, glm::vec3(0.0f));
  }
  image.depth.assign(pixels, 0.0f);
  image.mirrors = options.gloss;
  if (options.occlusionFalloff) image.open.assign(pixels, 1.0f);
  if (isGlossy(options)) {
    for (auto* layer :
         {&image.glossyDirect, &image.glossyIndirect, &image.glossyDirectError, &image.glossyIndirectError})
      layer->assign(pixels, glm::vec3(0.0f));
  }

  parallelChunks(context, "reference", pixels, kPixelsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) renderPixel(renderer, i, image);
  });
  if (context.cancelled()) return cancelledError();
  return image;
}

}  // namespace relume
