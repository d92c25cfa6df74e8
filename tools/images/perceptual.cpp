// SPDX-License-Identifier: MIT
// See perceptual.h. Sections and equations are those of the FLIP paper.
#include "tools/images/perceptual.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relume {
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

// One channel of an image.
struct Plane {
  int width = 0, height = 0;
  std::vector<double> value;
  const double* row(int y) const {
    return value.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
};

// A filter of odd length along one axis.
struct Kernel {
  int radius = 0;
  std::vector<double> weight;
};

template <class F>
Kernel makeKernel(int radius, const F& value) {
  Kernel kernel{radius, {}};
  for (int i = -radius; i <= radius; ++i) kernel.weight.push_back(value(i));
  return kernel;
}

Kernel normalised(Kernel kernel) {
  double sum = 0.0;
  for (const double w : kernel.weight) sum += w;
  for (double& w : kernel.weight) w /= sum;
  return kernel;
}

// Filter along one axis, the image going on beyond its edges as it is there. Every filter here is a product of one
// along x and one along y. The loops over x are plain sums of rows: they run in vector registers.
Plane along(const Plane& plane, const Kernel& kernel, bool vertical) {
  const int width = plane.width, radius = kernel.radius;
  Plane result{width, plane.height, std::vector<double>(plane.value.size(), 0.0)};
  std::vector<double> line(static_cast<std::size_t>(width + 2 * radius));
  for (int y = 0; y < plane.height; ++y) {
    double* to = result.value.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
    if (!vertical) {
      for (int x = -radius; x < width + radius; ++x)
        line[static_cast<std::size_t>(x + radius)] = plane.row(y)[std::clamp(x, 0, width - 1)];
    }
    for (int i = -radius; i <= radius; ++i) {
      const double w = kernel.weight[static_cast<std::size_t>(i + radius)];
      const double* from = vertical ? plane.row(std::clamp(y + i, 0, plane.height - 1)) : line.data() + i + radius;
      for (int x = 0; x < width; ++x) to[x] += w * from[x];
    }
  }
  return result;
}

Plane filtered(const Plane& plane, const Kernel& x, const Kernel& y) { return along(along(plane, x, false), y, true); }

constexpr double kWidestB = 0.04;        // largest b of the three channels of 4.1.1
constexpr double kFeatureWidth = 0.082;  // [degree] 4.2
constexpr int kTile = 512;               // [pixels] a side

int eyeRadius(double pixelsPerDegree) {
  return static_cast<int>(std::ceil(3.0 * std::sqrt(kWidestB / (2.0 * kPi * kPi)) * pixelsPerDegree));
}
int featureRadius(double pixelsPerDegree) { return static_cast<int>(std::ceil(1.5 * kFeatureWidth * pixelsPerDegree)); }

// One of the Gaussians of 4.1.1, a sqrt(pi / b) exp(-pi² d² / b), d [degree].
struct Gaussian {
  double a, b;
};

// 4.1.1: contrast sensitivity as a sum of two Gaussians, scaled to sum 1.
Plane seenThrough(const Plane& plane, const Gaussian& first, const Gaussian& second, double pixelsPerDegree) {
  const int radius = eyeRadius(pixelsPerDegree);
  const auto kernelOf = [&](const Gaussian& g) {
    return makeKernel(radius,
                      [&](int i) { return std::exp(-kPi * kPi * i * i / (pixelsPerDegree * pixelsPerDegree * g.b)); });
  };
  // What each Gaussian sums to in the plane says its share of the whole.
  const auto volumeOf = [&](const Gaussian& g) {
    double sum = 0.0;
    for (const double w : kernelOf(g).weight) sum += w;
    return g.a * std::sqrt(kPi / g.b) * sum * sum;
  };
  const double one = volumeOf(first), two = second.a > 0.0 ? volumeOf(second) : 0.0;
  const Kernel kernel = normalised(kernelOf(first));
  Plane result = filtered(plane, kernel, kernel);
  if (!(two > 0.0)) return result;
  const Kernel other = normalised(kernelOf(second));
  const Plane more = filtered(plane, other, other);
  for (std::size_t i = 0; i < result.value.size(); ++i)
    result.value[i] = (one * result.value[i] + two * more.value[i]) / (one + two);
  return result;
}

// 4.2: first or second derivative of a Gaussian along x; positive weights sum to 1, negative ones to -1. The factor
// along y has one sign, so that it is enough to do so along x.
struct Feature {
  Kernel derivative, smooth;
};
Feature feature(bool points, double pixelsPerDegree) {
  const double sigma = 0.5 * kFeatureWidth * pixelsPerDegree;
  const int radius = featureRadius(pixelsPerDegree);
  const auto gauss = [&](int i) { return std::exp(-i * i / (2.0 * sigma * sigma)); };
  Kernel derivative =
      makeKernel(radius, [&](int i) { return (points ? i * i / (sigma * sigma) - 1.0 : -i) * gauss(i); });
  double positive = 0.0, negative = 0.0;
  for (const double w : derivative.weight) (w > 0.0 ? positive : negative) += w;
  for (double& w : derivative.weight) w /= w > 0.0 ? positive : -negative;
  return {derivative, normalised(makeKernel(radius, gauss))};
}

// Length of the feature's gradient at every pixel.
Plane gradient(const Plane& plane, const Feature& feature) {
  Plane result = filtered(plane, feature.derivative, feature.smooth);
  const Plane other = filtered(plane, feature.smooth, feature.derivative);
  for (std::size_t i = 0; i < result.value.size(); ++i) result.value[i] = std::hypot(result.value[i], other.value[i]);
  return result;
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
  static const double max = std::pow(hyab(huntLab({0, 1, 0}), huntLab({0, 0, 1})), kPower);
  const double d = std::pow(distance, kPower), knee = kKnee * max;
  return d < knee ? kAtKnee * d / knee : kAtKnee + (1.0 - kAtKnee) * (d - knee) / (max - knee);
}

// FLIP of a crop of two pictures.
std::vector<float> flipOfCrop(int w, int h, std::span<const glm::vec3> a, std::span<const glm::vec3> b,
                              double pixelsPerDegree) {
  const Gaussian kFirst[3] = {{1.0, 0.0047}, {1.0, 0.0053}, {34.1, 0.04}};
  const Gaussian kSecond[3] = {{0.0, 1e-5}, {0.0, 1e-5}, {13.5, 0.025}};
  const Feature edge = feature(false, pixelsPerDegree), point = feature(true, pixelsPerDegree);

  // Per picture: what is left behind the eye's filters, and its edges and points
  struct Seen {
    Opponent color;
    Plane edges, points;
  };
  const auto see = [&](std::span<const glm::vec3> picture) {
    const Opponent opponent = opponentOf(w, h, picture);
    Seen seen;
    for (int k = 0; k < 3; ++k)
      seen.color.channel[k] = seenThrough(opponent.channel[k], kFirst[k], kSecond[k], pixelsPerDegree);
    Plane light = opponent.channel[0];
    for (double& v : light.value) v = (v + 16.0) / 116.0;
    seen.edges = gradient(light, edge);
    seen.points = gradient(light, point);
    return seen;
  };
  const Seen first = see(a), second = see(b);

  std::vector<float> error;
  error.reserve(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto labAt = [&](const Seen& seen) {
      const glm::dvec3 c(seen.color.channel[0].value[i], seen.color.channel[1].value[i],
                         seen.color.channel[2].value[i]);
      return huntLab(clampUnit(fromOpponent(c)));
    };
    const double color = redistribute(hyab(labAt(first), labAt(second)));
    // Edges and points that only one has make it worse
    const double edges = std::abs(first.edges.value[i] - second.edges.value[i]);
    const double points = std::abs(first.points.value[i] - second.points.value[i]);
    const double features = std::sqrt(std::max(edges, points) / std::numbers::sqrt2);
    error.push_back(static_cast<float>(std::pow(color, 1.0 - features)));
  }
  return error;
}

// The part of a picture from `left`, `top`, made brighter by `exposure`.
std::vector<glm::vec3> crop(std::span<const glm::vec3> picture, int width, int left, int top, int w, int h,
                            float exposure) {
  std::vector<glm::vec3> part;
  part.reserve(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  for (int y = top; y < top + h; ++y) {
    const auto row = picture.subspan(static_cast<std::size_t>(y) * static_cast<std::size_t>(width));
    for (int x = left; x < left + w; ++x) part.push_back(exposure * row[static_cast<std::size_t>(x)]);
  }
  return part;
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
                        std::span<const glm::vec3> b, float exposure, double pixelsPerDegree) {
  // Tiles with a margin as wide as the widest filter: the memory for all planes stays small, the result is the same
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  const int margin = std::max(eyeRadius(pixelsPerDegree), featureRadius(pixelsPerDegree));
  std::vector<float> error(a.size());
  for (int top = 0; top < h; top += kTile) {
    for (int left = 0; left < w; left += kTile) {
      const int x0 = std::max(left - margin, 0), x1 = std::min(left + kTile + margin, w);
      const int y0 = std::max(top - margin, 0), y1 = std::min(top + kTile + margin, h);
      const std::vector<float> part = flipOfCrop(x1 - x0, y1 - y0, crop(a, w, x0, y0, x1 - x0, y1 - y0, exposure),
                                                 crop(b, w, x0, y0, x1 - x0, y1 - y0, exposure), pixelsPerDegree);
      for (int y = top; y < std::min(top + kTile, h); ++y) {
        const auto from = part.begin() + (y - y0) * (x1 - x0) + left - x0;
        std::copy_n(from, std::min(kTile, w - left), error.begin() + static_cast<std::ptrdiff_t>(y) * w + left);
      }
    }
  }
  return error;
}

}  // namespace relume
