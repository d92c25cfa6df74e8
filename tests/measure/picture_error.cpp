// SPDX-License-Identifier: MIT
// How different pictures look from a reference, a row of a table each: RMSE in CIE Lab, mean and 95th percentile of
// FLIP, and the pixels that an observer can tell apart [%].
//   bench_picture_error EXPOSURE REFERENCE.exr PICTURE.exr...        EXPOSURE [stops]
#include "tools/images/image_io.h"
#include "tools/images/perceptual.h"
#include "tools/images/visible_difference.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numeric>

namespace {

using namespace relume;

int run(int argc, char** argv) {
  const float exposure = std::exp2(std::strtof(argv[1], nullptr));
  const auto read = [&](const char* path, ChannelImage& image, std::vector<glm::vec3>& pixels) {
    Result<ChannelImage> file = readExr(path);
    if (!file) {
      std::fprintf(stderr, "%s\n", file.error().message.c_str());
      return false;
    }
    image = std::move(*file);
    pixels = image.layer("");
    for (glm::vec3& pixel : pixels) pixel *= exposure;
    return !pixels.empty();
  };
  ChannelImage reference, picture;
  std::vector<glm::vec3> expected, found;
  if (!read(argv[2], reference, expected)) return 2;
  for (int i = 3; i < argc; ++i) {
    if (!read(argv[i], picture, found)) return 2;
    if (picture.width != reference.width || picture.height != reference.height) {
      std::fprintf(stderr, "%s: another size than %s\n", argv[i], argv[2]);
      return 1;
    }
    std::vector<float> error = flip(reference.width, reference.height, expected, found);
    const double mean = std::accumulate(error.begin(), error.end(), 0.0) / static_cast<double>(error.size());
    const auto p95 = error.begin() + static_cast<std::ptrdiff_t>(error.size() * 95 / 100);
    std::nth_element(error.begin(), p95, error.end());
    const std::vector<std::uint8_t> seen = visiblyDifferent(reference.width, reference.height, expected, found);
    std::printf("| %s | %.2f | %.4f | %.4f | %.2f |\n", std::filesystem::path(argv[i]).stem().c_str(),
                labRmse(expected, found), mean, static_cast<double>(*p95),
                100.0 * std::accumulate(seen.begin(), seen.end(), 0.0) / static_cast<double>(seen.size()));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: bench_picture_error EXPOSURE REFERENCE.exr PICTURE.exr...\n");
    return 1;
  }
  return run(argc, argv);
}
