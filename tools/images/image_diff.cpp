// SPDX-License-Identifier: MIT
// See image_diff.h.
#include "tools/images/image_diff.h"

#include "formats/color.h"
#include "tools/images/diverging.h"
#include "tools/images/perceptual.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace relume {
namespace {

constexpr double kFloor = 0.05;  // of the reference's mean luminance
constexpr double kShown = 0.9;   // share of the pixels whose error fits the scale

std::string sizeOf(const Picture& p) { return std::to_string(p.width) + " x " + std::to_string(p.height); }

Status checkFinite(const Picture& picture, const std::string& name) {
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    const glm::vec3& p = picture.pixels[i];
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) continue;
    return Error{ErrorCode::invalidFile, "\"" + name + "\": pixel " + std::to_string(i % picture.width) + "," +
                                             std::to_string(i / picture.width) +
                                             " is not finite; nothing can be said of such an image"};
  }
  return done();
}

// a / b, where nothing against nothing is 1.
double ratio(double a, double b, double both) {
  if (b != 0.0) return a / b;
  return a == 0.0 ? both : std::numeric_limits<double>::infinity();
}

}  // namespace

Result<PictureDifference> comparePictures(const Picture& image, const Picture& reference, float exposure,
                                          const std::string& imageName, const std::string& referenceName) {
  if (image.width != reference.width || image.height != reference.height) {
    return Error{ErrorCode::invalidFile, "sizes differ: \"" + imageName + "\" has " + sizeOf(image) + " pixels, \"" +
                                             referenceName + "\" " + sizeOf(reference)};
  }
  if (Status ok = checkFinite(image, imageName); !ok) return ok.error();
  if (Status ok = checkFinite(reference, referenceName); !ok) return ok.error();

  PictureDifference d;
  double square = 0.0, sumA = 0.0, sumB = 0.0, sizeB = 0.0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double a = image.pixels[i][c], b = reference.pixels[i][c], off = std::abs(a - b);
      square += off * off;
      sumA += a;
      sumB += b;
      sizeB += std::abs(b);
      if (off <= d.worst) continue;
      d.worst = off;
      d.worstX = static_cast<std::uint32_t>(i % image.width);
      d.worstY = static_cast<std::uint32_t>(i / image.width);
    }
  }
  const double values = 3.0 * static_cast<double>(image.pixels.size());
  d.mean = sizeB / values;
  d.rmse = std::sqrt(square / values);
  d.relativeRmse = ratio(d.rmse, d.mean, 0.0);
  d.energy = ratio(sumA, sumB, 1.0);
  const std::vector<float> seen = flip(image.width, image.height, reference.pixels, image.pixels, exposure);
  d.flip = std::accumulate(seen.begin(), seen.end(), 0.0) / static_cast<double>(seen.size());
  return d;
}

ErrorPicture drawError(const Picture& image, const Picture& reference) {
  double sum = 0.0;
  for (const glm::vec3& pixel : reference.pixels) sum += std::abs(static_cast<double>(luminance(pixel)));
  const double floor = kFloor * sum / static_cast<double>(reference.pixels.size());
  std::vector<float> error(image.pixels.size());
  for (std::size_t i = 0; i < error.size(); ++i) {
    const double b = luminance(reference.pixels[i]), off = luminance(image.pixels[i]) - b;
    error[i] = static_cast<float>(off == 0.0 ? 0.0 : off / std::max(std::abs(b) + floor, 1e-30));
  }

  // The finest scale that most of the errors fit
  std::vector<float> sizes;
  for (const float e : error) sizes.push_back(std::abs(e));
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(kShown * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), at, sizes.end());
  ErrorPicture picture;
  picture.scale = 1.0;
  for (const double scale : {0.25, 0.05, 0.01}) {
    if (static_cast<double>(*at) <= scale) picture.scale = scale;
  }
  for (const float e : error) {
    const glm::vec3 color = diverging(static_cast<float>(e / picture.scale));
    for (int c = 0; c < 3; ++c) picture.rgb.push_back(static_cast<std::uint8_t>(std::lround(255.0f * color[c])));
  }
  return picture;
}

}  // namespace relume
