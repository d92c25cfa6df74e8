// SPDX-License-Identifier: MIT
// See perceptual.h. Sections and equations are those of the FLIP paper.
#include "tests/accuracy/perceptual.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relume::test {
namespace {

constexpr double kPi = std::numbers::pi;

// Linear sRGB to XYZ, a column a primary (IEC 61966-2-1).
const glm::dmat3 kToXyz(0.4124564, 0.2126729, 0.0193339, 0.3575761, 0.7151522, 0.1191920, 0.1804375, 0.0721750,
                        0.9503041);
const glm::dvec3 kWhite = kToXyz * glm::dvec3(1.0);

glm::dvec3 clampUnit(const glm::dvec3& c) { return glm::clamp(c, glm::dvec3(0.0), glm::dvec3(1.0)); }

// YyCxCz, the linear cousin of Lab, and back to linear sRGB.
glm::dvec3 toOpponent(const glm::dvec3& linear) {
  const glm::dvec3 t = kToXyz * linear / kWhite;
  return {116.0 * t.y - 16.0, 500.0 * (t.x - t.y), 200.0 * (t.y - t.z)};
}
glm::dvec3 fromOpponent(const glm::dvec3& c) {
  static const glm::dmat3 fromXyz = glm::inverse(kToXyz);
  const double y = (c.x + 16.0) / 116.0;
  return fromXyz * (glm::dvec3(y + c.y / 500.0, y, y - c.z / 200.0) * kWhite);
}

// A square filter of odd side.
struct Kernel {
  int radius = 0;
  std::vector<double> weight;
  double at(int x, int y) const {
    const int side = 2 * radius + 1;
    return weight[static_cast<std::size_t>((y + radius) * side + x + radius)];
  }
};

template <class F>
Kernel makeKernel(int radius, const F& value) {
  Kernel kernel{radius, {}};
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) kernel.weight.push_back(value(x, y));
  }
  return kernel;
}

// 4.1.1: contrast sensitivity as a sum of two Gaussians, sum 1: a sqrt(pi / b) exp(-pi² d² / b), d [degree].
Kernel sensitivity(double a1, double b1, double a2, double b2, double pixelsPerDegree) {
  constexpr double kWidest = 0.04;  // largest b of the three channels
  const int radius = static_cast<int>(std::ceil(3.0 * std::sqrt(kWidest / (2.0 * kPi * kPi)) * pixelsPerDegree));
  Kernel kernel = makeKernel(radius, [&](int x, int y) {
    const double d2 = (x * x + y * y) / (pixelsPerDegree * pixelsPerDegree);
    return a1 * std::sqrt(kPi / b1) * std::exp(-kPi * kPi * d2 / b1) +
           a2 * std::sqrt(kPi / b2) * std::exp(-kPi * kPi * d2 / b2);
  });
  double sum = 0.0;
  for (const double w : kernel.weight) sum += w;
  for (double& w : kernel.weight) w /= sum;
  return kernel;
}

// 4.2: first or second derivative of a Gaussian along x; positive weights sum to 1, negative ones to -1.
Kernel feature(bool points, double pixelsPerDegree) {
  constexpr double kWidth = 0.082;  // [degree]
  const double sigma = 0.5 * kWidth * pixelsPerDegree;
  Kernel kernel = makeKernel(static_cast<int>(std::ceil(3.0 * sigma)), [&](int x, int y) {
    const double g = std::exp(-(x * x + y * y) / (2.0 * sigma * sigma));
    return (points ? x * x / (sigma * sigma) - 1.0 : -x) * g;
  });
  double positive = 0.0, negative = 0.0;
  for (const double w : kernel.weight) (w > 0.0 ? positive : negative) += w;
  for (double& w : kernel.weight) w /= w > 0.0 ? positive : -negative;
  return kernel;
}

// One channel of an image, clamped at its edges.
struct Plane {
  int width = 0, height = 0;
  std::vector<double> value;
  double at(int x, int y) const {
    return value[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * static_cast<std::size_t>(width) +
                 static_cast<std::size_t>(std::clamp(x, 0, width - 1))];
  }
};

double apply(const Plane& plane, const Kernel& kernel, int x, int y, bool transposed = false) {
  double sum = 0.0;
  for (int j = -kernel.radius; j <= kernel.radius; ++j) {
    for (int i = -kernel.radius; i <= kernel.radius; ++i) {
      sum += plane.at(x + i, y + j) * (transposed ? kernel.at(j, i) : kernel.at(i, j));
    }
  }
  return sum;
}

// Opponent channels of a picture.
struct Opponent {
  Plane channel[3];
};
Opponent opponentOf(int width, int height, std::span<const glm::vec3> picture) {
  Opponent planes;
  for (Plane& plane : planes.channel) plane = {width, height, {}};
  for (const glm::vec3& pixel : picture) {
    const glm::dvec3 c = toOpponent(clampUnit(pixel));
    for (int k = 0; k < 3; ++k) planes.channel[k].value.push_back(c[k]);
  }
  return planes;
}

// Hunt: less light, less colour.
glm::dvec3 huntLab(const glm::dvec3& linear) {
  const glm::dvec3 lab = labOf(linear);
  return {lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z};
}

// 4.1.2: HyAB distance.
double hyab(const glm::dvec3& a, const glm::dvec3& b) { return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z); }

// 4.1.3: compress large distances; the largest there is, green against blue, becomes 1.
double redistribute(double distance) {
  constexpr double kPower = 0.7, kKnee = 0.4, kAtKnee = 0.95;
  static const double most = std::pow(hyab(huntLab({0, 1, 0}), huntLab({0, 0, 1})), kPower);
  const double d = std::pow(distance, kPower), knee = kKnee * most;
  return d < knee ? kAtKnee * d / knee : kAtKnee + (1.0 - kAtKnee) * (d - knee) / (most - knee);
}

double gradient(const Plane& plane, const Kernel& kernel, int x, int y) {
  return std::hypot(apply(plane, kernel, x, y), apply(plane, kernel, x, y, true));
}

}  // namespace

glm::dvec3 labOf(const glm::dvec3& linear) {
  const glm::dvec3 t = kToXyz * linear / kWhite;
  const auto f = [](double v) {
    constexpr double kDelta = 6.0 / 29.0;
    return v > kDelta * kDelta * kDelta ? std::cbrt(v) : v / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
  };
  return {116.0 * f(t.y) - 16.0, 500.0 * (f(t.x) - f(t.y)), 200.0 * (f(t.y) - f(t.z))};
}

double labRmse(std::span<const glm::vec3> a, std::span<const glm::vec3> b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const glm::dvec3 d = labOf(clampUnit(a[i])) - labOf(clampUnit(b[i]));
    sum += glm::dot(d, d);
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(a.size(), 1)));
}

std::vector<float> flip(std::uint32_t width, std::uint32_t height, std::span<const glm::vec3> a,
                        std::span<const glm::vec3> b, double pixelsPerDegree) {
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  const Opponent first = opponentOf(w, h, a), second = opponentOf(w, h, b);
  const Kernel filters[3] = {sensitivity(1.0, 0.0047, 0.0, 1e-5, pixelsPerDegree),
                             sensitivity(1.0, 0.0053, 0.0, 1e-5, pixelsPerDegree),
                             sensitivity(34.1, 0.04, 13.5, 0.025, pixelsPerDegree)};
  const Kernel edge = feature(false, pixelsPerDegree), point = feature(true, pixelsPerDegree);
  Plane light[2] = {first.channel[0], second.channel[0]};
  for (Plane& plane : light) {
    for (double& v : plane.value) v = (v + 16.0) / 116.0;
  }

  std::vector<float> error;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      // Colour: what is left behind the eye's filters
      const auto seen = [&](const Opponent& picture) {
        glm::dvec3 c;
        for (int k = 0; k < 3; ++k) c[k] = apply(picture.channel[k], filters[k], x, y);
        return huntLab(clampUnit(fromOpponent(c)));
      };
      const double color = redistribute(hyab(seen(first), seen(second)));
      // Features: edges and points that only one has make it worse
      const double edges = std::abs(gradient(light[0], edge, x, y) - gradient(light[1], edge, x, y));
      const double points = std::abs(gradient(light[0], point, x, y) - gradient(light[1], point, x, y));
      const double features = std::sqrt(std::max(edges, points) / std::numbers::sqrt2);
      error.push_back(static_cast<float>(std::pow(color, 1.0 - features)));
    }
  }
  return error;
}

}  // namespace relume::test
