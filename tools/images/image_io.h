// SPDX-License-Identifier: MIT
// Images in and out: OpenEXR with named float channels, PNG for looking at. Files are put together in memory and
// written as writeFileAtomically() does, so that a failure leaves no half file.
#pragma once

#include "relume/result.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace relume {

struct ChannelImage {
  std::uint32_t width = 0, height = 0;
  std::map<std::string, std::vector<float>> channels;  // [Size width height] row 0 on top; "R", "DiffInd.G", ...

  // Store three channels "<layer>.R/G/B" (or the given suffixes; layer "" = no dot). [Size pixels == width height]
  void setLayer(const std::string& layer, std::span<const glm::vec3> pixels, const char* suffixes = "RGB");
  // Read them back; empty when one of the three is missing.
  std::vector<glm::vec3> layer(const std::string& layer, const char* suffixes = "RGB") const;
};

// Asked before so many bytes are allocated for something; its error ends the reading. Empty = there is memory enough.
using MemoryCheck = std::function<Status(double bytes, const std::string& what)>;

// Whether a file with this beginning is an OpenEXR.
bool isExr(std::span<const std::byte> beginning);

// Read a scan-line or tiled OpenEXR; half channels are widened to float. The image is what its display window shows, 0
// where no pixels are stored. A channel that several parts have is named by its part, "left.R". io: not readable;
// invalidFile: not an OpenEXR, broken, deep, subsampled, a window larger than 16384 x 16384 pixels, more than 1024
// channels, or more pixels than a file of its size can hold; errors of `fits`.
Result<ChannelImage> readExr(const std::filesystem::path& path, const MemoryCheck& fits = {});

// Write 32-bit float channels, ZIP compressed; with `half`, 16-bit ones, except Depth and Position. usage: a channel
// whose size is not width x height; io: not writable.
Status writeExr(const std::filesystem::path& path, const ChannelImage& image, bool half = false);

// Write linear radiance as 8-bit sRGB after multiplying by exposure; above 1 clips. [Size pixels == width height]
// usage: sizes disagree; io: not writable.
Status writePng(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height,
                std::span<const glm::vec3> pixels, float exposure = 1.0f);

// 8-bit sRGB of linear values after multiplying by exposure; above 1 clips, NaN becomes black. [Size 3 * pixels]
std::vector<std::uint8_t> encodeSrgb(std::span<const glm::vec3> pixels, float exposure = 1.0f);

// Write 8-bit values as they are. [Size rgb == 3 width height] Errors as above; failed: rows of 1 GiB in all, or more.
Status writePng(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height,
                std::span<const std::uint8_t> rgb);

// The bytes of a PNG of 8-bit sRGB values, for embedding. [Size rgb == 3 width height] Empty when sizes disagree, and
// where writePng() fails.
std::vector<std::byte> encodePng(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb);

// By the name's extension: .exr with channels R, G, B, or .png. usage for any other extension.
Status writeImage(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height,
                  std::span<const glm::vec3> pixels, float exposure = 1.0f);

}  // namespace relume
