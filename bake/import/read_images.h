// SPDX-License-Identifier: MIT
// Image files in memory to RGBA with mip levels. PNG and JPEG (and what else stb_image knows).
#pragma once

#include "relume/bake/scene.h"
#include "relume/result.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kMaxImageSide = 16384;         // [texels]
inline constexpr std::uint64_t kMaxImagePixels = 1ull << 27;  // of one image

// [byte, max] of an image's file: four channels of 16 bits for each texel, and what may stand around them.
inline constexpr std::uint64_t kMaxImageBytes = 8 * kMaxImagePixels + (64 << 20);
inline constexpr std::uint64_t kImageBeginning = 12;  // [byte] in which an image's format shows

// Whether a file with this beginning and size is worth reading. invalidFile: neither PNG nor JPEG, or too large.
Status checkImageFile(std::span<const std::uint8_t> beginning, std::uint64_t fileBytes, const std::string& where);

// The size of an image from its header alone. invalidFile: not an image we can read, or its header claims more than the
// limits above or than a compressed file of that many bytes can hold; `where` names the image in messages.
struct ImageSize {
  std::uint32_t width = 0, height = 0;
  bool isDeep = false;  // a PNG of 16 bits a channel
};
Result<ImageSize> peekImage(std::span<const std::uint8_t> bytes, const std::string& where);

// Texels that image data of so many bytes can hold at best.
std::uint64_t maxPixels(std::uint64_t bytes);

// Level 0 only. invalidFile: as peekImage, or broken.
Result<Image> decodeImage(std::span<const std::uint8_t> bytes, const std::string& where);

// The same in 16 bits a channel: red, green, blue, alpha of each texel.
Result<std::vector<std::uint16_t>> decodeDeepImage(std::span<const std::uint8_t> bytes, const std::string& where);

// The same of Radiance HDR images, which no level has: their size from the header alone, and their texels, row 0 on
// top. invalidFile: no such image, one that claims more than it can hold, broken, or cut off.
Result<ImageSize> peekHdr(std::span<const std::uint8_t> bytes, const std::string& where);
Result<std::vector<glm::vec3>> decodeHdr(std::span<const std::uint8_t> bytes, const std::string& where);

// Append levels down to 1 x 1 by box filter: in linear light, or of the numbers that an image has that is no colour.
// weighByAlpha: colours count by their alpha, so that what an alpha mask cuts away does not tint what stays.
void buildMipLevels(Image& image, bool weighByAlpha);

}  // namespace relume
