// SPDX-License-Identifier: MIT
// Decoding by stb_image, after the header's claims were checked; mip levels in linear light.
#include "bake/import/read_images.h"

#include "formats/color.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>

namespace {

// Whether stb_image was refused memory since this was last reset: its own reason is not always set, and is then that of
// an earlier image.
thread_local bool refusedMemory = false;

void* noted(void* memory, std::size_t bytes) {
  if (memory == nullptr && bytes > 0) refusedMemory = true;
  return memory;
}

}  // namespace

#define STBI_MALLOC(bytes) noted(std::malloc(bytes), bytes)
#define STBI_REALLOC(memory, bytes) noted(std::realloc(memory, bytes), bytes)
#define STBI_FREE(memory) std::free(memory)
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_NO_STDIO
#define STBI_ONLY_JPEG
#define STBI_ONLY_PNG
#define STBI_ONLY_HDR
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wshadow"
#endif
#include <stb/stb_image.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

namespace relume {
namespace {

// Deflate packs at most 1032:1, and a PNG of one bit a pixel 8 of them into a byte; a JPEG block of 64 pixels takes at
// least one bit.
constexpr std::uint64_t kMaxPixelsPerByte = 8 * 1032;
constexpr std::uint64_t kMaxJpegPixelsPerByte = 512;
constexpr std::uint64_t kMaxHdrPixelsPerByte = 16;  // runs of 127 texels take two bytes in each of four channels
constexpr int kMaxJpegScans = 128;                  // a progressive file decodes every scan over the whole image

std::string sized(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

bool isPng(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 4> kMagic = {0x89, 'P', 'N', 'G'};
  return bytes.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
}

bool isJpeg(std::span<const std::uint8_t> bytes) { return !bytes.empty() && bytes[0] == 0xFF; }

// What of a JPEG stb_image would trip over, or null: a Huffman table of more than 256 symbols (it writes past its own),
// or more scans than any encoder makes. Walks the markers as the decoder does.
const char* jpegProblem(std::span<const std::uint8_t> bytes) {
  const auto at = [&](std::size_t i) { return i < bytes.size() ? static_cast<int>(bytes[i]) : 0; };
  int scans = 0;
  for (std::size_t i = 2; i + 1 < bytes.size();) {
    const int marker = at(i + 1);
    if (at(i) != 0xFF || marker == 0xFF) {
      ++i;
      continue;
    }
    i += 2;
    const bool standsAlone = marker <= 0x01 || (marker >= 0xD0 && marker <= 0xD8);
    if (standsAlone) continue;
    if (marker == 0xD9) break;
    const int length = at(i) * 256 + at(i + 1);
    if (marker == 0xDA && ++scans > kMaxJpegScans) return "too many scans";
    if (marker == 0xC4) {
      std::size_t table = i + 2;
      for (int left = length - 2; left > 0;) {
        int symbols = 0;
        for (std::size_t k = 1; k <= 16; ++k) symbols += at(table + k);
        if (symbols > 256) return "a Huffman table of more than 256 symbols";
        table += 17 + static_cast<std::size_t>(symbols);
        left -= 17 + symbols;
      }
    }
    i += static_cast<std::size_t>(std::max(length, 2));
  }
  return nullptr;
}

// A PNG without its empty IDAT chunks, which stb_image would copy to a null pointer; nothing where it has none.
std::vector<std::uint8_t> withoutEmptyData(std::span<const std::uint8_t> png) {
  constexpr std::size_t kSignature = 8, kFrame = 12;  // length, type, checksum
  std::vector<std::uint8_t> kept;
  std::size_t copied = 0;
  for (std::size_t i = kSignature; i + kFrame <= png.size();) {
    const auto byte = [&](std::size_t k) { return std::size_t{png[i + k]}; };
    const std::size_t length = byte(0) << 24 | byte(1) << 16 | byte(2) << 8 | byte(3);
    if (length == 0 && std::equal(&png[i + 4], &png[i + 8], "IDAT")) {
      kept.insert(kept.end(), png.begin() + static_cast<std::ptrdiff_t>(copied),
                  png.begin() + static_cast<std::ptrdiff_t>(i));
      copied = i + kFrame;
    }
    if (length > png.size() - kFrame - i) break;
    i += kFrame + length;
  }
  if (copied > 0) kept.insert(kept.end(), png.begin() + static_cast<std::ptrdiff_t>(copied), png.end());
  return kept;
}

std::uint32_t bigEndian(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes.subspan(at, 4)) value = value << 8 | byte;
  return value;
}

// What a PNG's header claims; nothing where it does not come first. stb_image does not tell the size of a PNG that it
// takes for too large.
std::optional<ImageSize> pngSize(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kName = 12, kWidth = 16, kHeight = 20, kEnd = 24;
  if (!isPng(bytes) || bytes.size() < kEnd || !std::equal(&bytes[kName], &bytes[kWidth], "IHDR")) return std::nullopt;
  return ImageSize{bigEndian(bytes, kWidth), bigEndian(bytes, kHeight)};
}

Status checkSides(const ImageSize& size, const std::string& where) {
  if (size.width > 0 && size.height > 0 && size.width <= kMaxImageSide && size.height <= kMaxImageSide &&
      std::uint64_t{size.width} * size.height <= kMaxImagePixels)
    return done();
  return Error{ErrorCode::invalidFile, where + ": " + sized(size.width, size.height) + " texels; expected 1 to " +
                                           std::to_string(kMaxImageSide) + " a side and at most " +
                                           std::to_string(kMaxImagePixels) + " in all"};
}

// Forget what stb_image said about an earlier image.
void resetReason() {
  stbi__g_failure_reason = nullptr;
  refusedMemory = false;
}

// Why stb_image has failed, since resetReason().
Error decodingError(const std::string& where, const std::string& what) {
  if (refusedMemory) return {ErrorCode::failed, where + ": out of memory"};
  // A decoder that gives none leaves it empty, or that of the format that was tried before.
  const std::string_view reason = stbi_failure_reason() != nullptr ? stbi_failure_reason() : "";
  const bool tells = !reason.empty() && reason != "bad png sig" && reason != "unknown image type";
  return {ErrorCode::invalidFile, where + ": " + what + (tells ? " (" + std::string(reason) + ")" : "")};
}

// stb_image takes what lies behind the end of an HDR file for zeros: note that it asked.
struct Source {
  std::span<const std::uint8_t> bytes;
  std::size_t at = 0;
  bool ranOut = false;
};

constexpr stbi_io_callbacks kSourceCallbacks = {
    [](void* user, char* data, int size) {
      Source& s = *static_cast<Source*>(user);
      const std::size_t count = std::min(static_cast<std::size_t>(size), s.bytes.size() - s.at);
      if (count == 0) s.ranOut = true;
      std::memcpy(data, s.bytes.data() + s.at, count);
      s.at += count;
      return static_cast<int>(count);
    },
    [](void* user, int count) {
      Source& s = *static_cast<Source*>(user);
      s.at = static_cast<std::size_t>(std::clamp<std::int64_t>(static_cast<std::int64_t>(s.at) + count, 0,
                                                               static_cast<std::int64_t>(s.bytes.size())));
    },
    [](void* user) {
      const Source& s = *static_cast<Source*>(user);
      return s.at == s.bytes.size() ? 1 : 0;
    }};

// Share of each source texel in one destination texel along an axis; at most three where a size is odd.
struct BoxTaps {
  std::uint32_t first = 0, count = 0;
  std::array<float, 3> weight{};
};

std::vector<BoxTaps> boxTaps(std::uint32_t source, std::uint32_t destination) {
  std::vector<BoxTaps> taps(destination);
  const double scale = static_cast<double>(source) / destination;
  for (std::uint32_t i = 0; i < destination; ++i) {
    const double begin = i * scale, end = (i + 1) * scale;
    taps[i].first = static_cast<std::uint32_t>(begin);
    for (std::uint32_t s = taps[i].first; s < source && taps[i].count < 3; ++s) {
      const double share = std::min<double>(end, s + 1.0) - std::max<double>(begin, s);
      if (share <= 1e-9) break;
      taps[i].weight[taps[i].count++] = static_cast<float>(share / scale);
    }
  }
  return taps;
}

struct SrgbTables {
  std::array<float, 256> toLinear{}, plain{};  // plain: a share of 255
  std::array<std::uint8_t, 4096> toSrgb{};     // by round(linear^(1/2) x 4095): even steps where sRGB is steep
};

const SrgbTables& tables() {
  static const SrgbTables kTables = [] {
    SrgbTables t;
    for (std::size_t i = 0; i < t.toLinear.size(); ++i) {
      t.plain[i] = static_cast<float>(i) / 255.0f;
      t.toLinear[i] = srgbToLinear(t.plain[i]);
    }
    for (std::size_t i = 0; i < t.toSrgb.size(); ++i) {
      const float root = static_cast<float>(i) / 4095.0f;
      t.toSrgb[i] = static_cast<std::uint8_t>(std::lround(255.0f * linearToSrgb(root * root)));
    }
    return t;
  }();
  return kTables;
}

std::uint8_t encode(float linear) {
  const float root = std::sqrt(std::clamp(linear, 0.0f, 1.0f));
  return tables().toSrgb[static_cast<std::size_t>(root * 4095.0f + 0.5f)];
}

// Four values a texel of 1 (grey), 2 (grey, alpha), 3 (colour) or 4.
template <class Value>
std::vector<Value> toRgba(const Value* texel, std::size_t count, int channels) {
  if (channels == 4) return {texel, texel + 4 * count};
  std::vector<Value> rgba(4 * count);
  const bool grey = channels < 3;
  for (std::size_t i = 0; i < count; ++i, texel += channels) {
    for (int k = 0; k < 3; ++k) rgba[4 * i + static_cast<std::size_t>(k)] = texel[grey ? 0 : k];
    rgba[4 * i + 3] = channels == 2 ? texel[1] : std::numeric_limits<Value>::max();
  }
  return rgba;
}

// Four values a texel of an image that peekImage() lets pass, by stb_image's function for such values.
template <class Value>
Result<std::vector<Value>> decodeRgba(std::span<const std::uint8_t> bytes, const std::string& where,
                                      Value* (*load)(const stbi_uc*, int, int*, int*, int*, int)) {
  const std::vector<std::uint8_t> kept = isJpeg(bytes) ? std::vector<std::uint8_t>{} : withoutEmptyData(bytes);
  if (!kept.empty()) bytes = kept;

  // A PNG in the channels it has, so that a grey one is not held as colours twice. JPEGs have ways of their own for
  // four.
  int width = 0, height = 0, stored = 0;
  const int wanted = isJpeg(bytes) ? 4 : 0;
  resetReason();
  const std::unique_ptr<Value, void (*)(void*)> decoded(
      load(bytes.data(), static_cast<int>(bytes.size()), &width, &height, &stored, wanted), stbi_image_free);
  if (!decoded || width <= 0 || height <= 0) return decodingError(where, "broken image");
  return toRgba<Value>(decoded.get(), static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                       wanted != 0 ? wanted : stored);
}

Image::Level halve(const Image::Level& source, bool weighByAlpha, bool isColor) {
  Image::Level level{std::max(source.width / 2, 1u), std::max(source.height / 2, 1u), {}};
  level.rgba.resize(4 * static_cast<std::size_t>(level.width) * level.height);
  const std::vector<BoxTaps> columns = boxTaps(source.width, level.width), rows = boxTaps(source.height, level.height);
  const auto& linear = isColor ? tables().toLinear : tables().plain;
  const auto store = [isColor](float v) {
    return isColor ? encode(v) : static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(v, 0.0f, 1.0f)));
  };
  std::uint8_t* out = level.rgba.data();
  for (const BoxTaps& row : rows) {
    for (const BoxTaps& column : columns) {
      glm::vec3 plain(0.0f), weighted(0.0f);
      float alpha = 0.0f;
      for (std::uint32_t y = 0; y < row.count; ++y) {
        for (std::uint32_t x = 0; x < column.count; ++x) {
          const std::size_t at = static_cast<std::size_t>(row.first + y) * source.width + column.first + x;
          const std::uint8_t* rgba = &source.rgba[4 * at];
          const float weight = row.weight[y] * column.weight[x];
          const glm::vec3 color(linear[rgba[0]], linear[rgba[1]], linear[rgba[2]]);
          plain += weight * color;
          weighted += weight * static_cast<float>(rgba[3]) * color;
          alpha += weight * static_cast<float>(rgba[3]);
        }
      }
      const glm::vec3 color = weighByAlpha && alpha > 0.0f ? weighted / alpha : plain;
      *out++ = store(color.r);
      *out++ = store(color.g);
      *out++ = store(color.b);
      *out++ = static_cast<std::uint8_t>(std::min(std::lround(alpha), 255l));
    }
  }
  return level;
}

}  // namespace

Status checkImageFile(std::span<const std::uint8_t> beginning, std::uint64_t fileBytes, const std::string& where) {
  if (!isPng(beginning) && !isJpeg(beginning))
    return Error{ErrorCode::invalidFile, where + ": not a PNG or JPEG image, or an empty file"};
  if (fileBytes > kMaxImageBytes)
    return Error{ErrorCode::invalidFile, where + ": an image of " + std::to_string(fileBytes) + " bytes, at most " +
                                             std::to_string(kMaxImageBytes) + " expected"};
  return done();
}

std::uint64_t maxPixels(std::uint64_t bytes) { return kMaxPixelsPerByte * bytes + 4096; }

Result<ImageSize> peekImage(std::span<const std::uint8_t> bytes, const std::string& where) {
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    return Error{ErrorCode::invalidFile, where + ": more than 2 GiB of image data"};
  // Tables come before the size, too.
  if (const char* problem = isJpeg(bytes) ? jpegProblem(bytes) : nullptr)
    return Error{ErrorCode::invalidFile, where + ": broken image (" + problem + ")"};
  if (const std::optional<ImageSize> claimed = pngSize(bytes)) {
    if (Status ok = checkSides(*claimed, where); !ok) return ok.error();
  }
  int width = 0, height = 0, channels = 0;
  resetReason();
  if ((!isPng(bytes) && !isJpeg(bytes)) ||
      !stbi_info_from_memory(bytes.data(), static_cast<int>(bytes.size()), &width, &height, &channels))
    return decodingError(where, "not a PNG or JPEG image that can be read");
  const ImageSize size{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height),
                       stbi_is_16_bit_from_memory(bytes.data(), static_cast<int>(bytes.size())) != 0};
  if (Status ok = checkSides(size, where); !ok) return ok.error();
  const std::uint64_t pixels = static_cast<std::uint64_t>(size.width) * size.height;
  if (pixels > (isJpeg(bytes) ? kMaxJpegPixelsPerByte * bytes.size() + 4096 : maxPixels(bytes.size()))) {
    return Error{ErrorCode::invalidFile, where + ": claims " + sized(size.width, size.height) + " texels in " +
                                             std::to_string(bytes.size()) + " bytes"};
  }
  return size;
}

Result<Image> decodeImage(std::span<const std::uint8_t> bytes, const std::string& where) {
  const Result<ImageSize> size = peekImage(bytes, where);
  if (!size) return size.error();
  auto rgba = decodeRgba<std::uint8_t>(bytes, where, stbi_load_from_memory);
  if (!rgba) return rgba.error();
  Image image;
  image.levels.push_back({size->width, size->height, std::move(*rgba)});
  return image;
}

Result<std::vector<std::uint16_t>> decodeDeepImage(std::span<const std::uint8_t> bytes, const std::string& where) {
  const Result<ImageSize> size = peekImage(bytes, where);
  if (!size) return size.error();
  return decodeRgba<std::uint16_t>(bytes, where, stbi_load_16_from_memory);
}

Result<ImageSize> peekHdr(std::span<const std::uint8_t> bytes, const std::string& where) {
  int width = 0, height = 0, channels = 0;
  resetReason();
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    return Error{ErrorCode::invalidFile, where + ": more than 2 GiB of image data"};
  const int count = static_cast<int>(bytes.size());
  if (!stbi_is_hdr_from_memory(bytes.data(), count) ||
      !stbi_info_from_memory(bytes.data(), count, &width, &height, &channels) || width < 1 || height < 1)
    return decodingError(where, "not a Radiance HDR image that can be read");
  const ImageSize size{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
  if (size.width > kMaxImageSide || size.height > kMaxImageSide)
    return Error{ErrorCode::invalidFile, where + ": " + sized(size.width, size.height) + " texels; expected at most " +
                                             sized(kMaxImageSide, kMaxImageSide)};
  if (static_cast<std::uint64_t>(size.width) * size.height > kMaxHdrPixelsPerByte * bytes.size()) {
    return Error{ErrorCode::invalidFile, where + ": claims " + sized(size.width, size.height) + " texels in " +
                                             std::to_string(bytes.size()) + " bytes"};
  }
  return size;
}

Result<std::vector<glm::vec3>> decodeHdr(std::span<const std::uint8_t> bytes, const std::string& where) {
  const Result<ImageSize> size = peekHdr(bytes, where);
  if (!size) return size.error();
  Source source{bytes};
  int width = 0, height = 0, channels = 0;
  resetReason();
  const std::unique_ptr<float, void (*)(void*)> decoded(
      stbi_loadf_from_callbacks(&kSourceCallbacks, &source, &width, &height, &channels, 3), stbi_image_free);
  if (!decoded) return decodingError(where, "broken image");
  if (source.ranOut) return Error{ErrorCode::invalidFile, where + ": ends before its last texel"};
  std::vector<glm::vec3> texels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::memcpy(texels.data(), decoded.get(), texels.size() * sizeof(glm::vec3));
  return texels;
}

void buildMipLevels(Image& image, bool weighByAlpha) {
  image.levels.resize(1);
  while (image.levels.back().width > 1 || image.levels.back().height > 1)
    image.levels.push_back(halve(image.levels.back(), weighByAlpha, image.isColor));
}

}  // namespace relume
