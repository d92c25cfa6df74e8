// SPDX-License-Identifier: MIT
// See splat_view.h.
#include "tests/gl_splat/splat_view.h"

#include "bake/base/random.h"
#include "tests/rays/make_scene.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume::test {
namespace {

const glm::vec3 kLow(-4, -1.5f, -4), kHigh(4, 3.5f, 4), kBall(0.5f, 0, -1);
constexpr float kRadius = 1.0f;

glm::vec3 within(RandomStream& random, float halfWidth) {
  const glm::vec2 xy = random.uniform2();
  return halfWidth * (2.0f * glm::vec3(xy, random.uniform()) - 1.0f);
}

RecordLight lightBy(RandomStream& random) {
  RecordLight light;
  for (int c = 0; c < 3; ++c) {
    light.vector[c] = within(random, 10.0f);
    light.gradient[c] = within(random, 10.0f);
  }
  return light;
}

PixelReceiver seen(const CameraRays& rays, const glm::vec3& origin, const glm::vec3& direction) {
  PixelReceiver r;
  // The box from within, then the ball.
  float nearest = 1e9f;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0f) continue;
    const bool high = direction[axis] > 0.0f;
    const float t = ((high ? kHigh : kLow)[axis] - origin[axis]) / direction[axis];
    if (t <= 0.0f || t >= nearest) continue;
    nearest = t;
    r.normal = glm::vec3(0.0f);
    r.normal[axis] = high ? -1.0f : 1.0f;
  }
  const glm::vec3 d = glm::normalize(direction), toBall = origin - kBall;
  const float b = glm::dot(toBall, d), c = glm::dot(toBall, toBall) - kRadius * kRadius, root = b * b - c;
  const float t = (-b - std::sqrt(std::max(root, 0.0f))) / glm::length(direction);
  const bool isBall = root > 0.0f && t > 0.0f && t < nearest;
  r.positionWorld = origin + (isBall ? t : nearest) * direction;
  if (isBall) r.normal = glm::normalize(r.positionWorld - kBall);
  if (r.normal.y == -1.0f && std::abs(r.positionWorld.x) < 1.0f) return {};
  r.geometricNormal = r.normal;
  const float depth = rays.orthographic ? 1.0f : glm::dot(r.positionWorld - rays.origin, rays.forward);
  r.footprint = 2.0f * glm::length(rays.up) / rays.height * depth;
  // Something in front of what lies near a wall.
  const float aside = kHigh.x - std::abs(r.positionWorld.x);
  if (aside > 0.0f && aside < 0.5f) r.occluder = aside;
  return r;
}

Camera cameraOf(bool orthographic) {
  Camera camera = lookAt({-2, 1, 3}, {1, 0, -2}, 1.0f);
  camera.orthographic = orthographic;
  camera.yMag = 1.5f;
  return camera;
}

}  // namespace

SplatView::SplatView(std::uint32_t width, std::uint32_t height, bool orthographic)
    : camera(cameraOf(orthographic)), rays(camera, width, height) {
  for (std::uint32_t i = 0; i < width * height; ++i) {
    glm::vec3 origin, direction;
    rays.at(static_cast<float>(i % width) + 0.5f, static_cast<float>(i / width) + 0.5f, origin, direction);
    receivers.push_back(seen(rays, origin, direction));
  }
}

std::vector<Record> strewn(const SplatView& view, std::size_t count, std::uint64_t seed) {
  RandomStream random(seed, 11, 12);
  std::vector<Record> records;
  while (records.size() < count) {
    const PixelReceiver& r = view.receivers[random.below(static_cast<std::uint32_t>(view.receivers.size()))];
    if (r.normal == glm::vec3(0.0f)) continue;
    Record record;
    record.positionWorld = r.positionWorld;
    record.normal = glm::normalize(r.normal + within(random, 0.1f));
    record.distance = 0.2f + 4.0f * random.uniform();
    record.nearest = record.distance * random.uniform();
    record.footprint = r.footprint;
    if (random.uniform() < 0.1f) record.limit = 0.3f;
    if (records.size() % 4 == 3) {
      // On a wall behind the camera, around its eye, or anywhere.
      const float kind = random.uniform();
      if (kind < 0.3f) {
        record.positionWorld = {within(random, 4.0f).x, 1.0f, kHigh.z};
      } else if (kind < 0.6f) {
        record.positionWorld = view.rays.origin + within(random, 0.2f);
        record.footprint = 0.05f;
        record.distance = 100.0f;
      } else {
        record.positionWorld = within(random, 4.0f);
      }
    }
    records.push_back(record);
  }
  // What sees nothing but sky reaches as far as the view allows.
  for (std::size_t k = 0; k < records.size(); k += 50) records[k].distance = records[k].nearest = INFINITY;
  shine(records, seed);
  return records;
}

void shine(std::span<Record> records, std::uint64_t seed) {
  RandomStream random(seed, 13, 14);
  for (Record& record : records) {
    record.reflected = lightBy(random);
    record.sky = lightBy(random);
  }
}

std::vector<Splat> splatByCpu(const SplatView& view, std::span<const Record> records, const Interpolation& options) {
  const RecordTiles tiles(view.rays, records, options);
  std::vector<Splat> picture(view.receivers.size());
  const auto width = static_cast<std::uint32_t>(view.rays.width);
  for (std::uint32_t i = 0; i < picture.size(); ++i) {
    if (view.receivers[i].normal != glm::vec3(0.0f)) picture[i] = tiles.splat(i % width, i / width, view.receivers[i]);
  }
  return picture;
}

SplatDifference compareSplats(std::span<const Splat> cpu, std::span<const Splat> gl, const Interpolation& options) {
  SplatDifference d;
  double error = 0.0, square = 0.0, weights = 0.0;
  const float tie = (options.weight == RecordWeight::ward ? 1.0001f : 1e-4f) / options.accuracy;
  for (std::size_t i = 0; i < cpu.size(); ++i) {
    const Splat &a = cpu[i], &b = gl[i];
    if ((a.weight > 0.0f) != (b.weight > 0.0f)) {
      ++(std::max(a.weight, b.weight) < tie ? d.ties : d.apart);
      continue;
    }
    if (!(a.weight > 0.0f)) continue;
    d.lit += 1;
    const glm::dvec3 reflected = glm::dvec3(a.reflected) - glm::dvec3(b.reflected),
                     sky = glm::dvec3(a.sky) - glm::dvec3(b.sky);
    const double e = glm::dot(reflected, reflected) + glm::dot(sky, sky);
    error += e;
    d.largest = std::max(d.largest, e);
    square += glm::dot(a.reflected, a.reflected) + glm::dot(a.sky, a.sky);
    d.weight = std::max(d.weight, std::abs(static_cast<double>(a.weight) - b.weight));
    weights += static_cast<double>(a.weight) * a.weight;
  }
  if (d.lit == 0) return d;
  const auto count = static_cast<double>(d.lit);
  d.rms = std::sqrt(error / square);
  d.largest = std::sqrt(d.largest / (square / count));
  d.weight /= std::sqrt(weights / count);
  return d;
}

}  // namespace relume::test
