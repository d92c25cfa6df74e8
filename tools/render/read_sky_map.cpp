// SPDX-License-Identifier: MIT
// See read_sky_map.h. Radiance HDR is decoded by stb_image, after what its header claims was held against the file.
#include "tools/render/read_sky_map.h"

#include "formats/file_io.h"
#include "formats/limits.h"
#include "relume/relighter.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_NO_STDIO
#define STBI_ONLY_HDR
#define STBI_MAX_DIMENSIONS 16384
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#endif
#include <stb/stb_image.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

namespace relume {
namespace {

constexpr std::size_t kMaxBytes = 0x7FFFFFFF;  // stb_image counts them in an int
// A run of 127 equal texels takes two bytes in each of four channels.
constexpr std::uint64_t kMaxTexelsPerByte = 16;

// Columns from which sky patches are made: finer than 4096 patches by far.
constexpr std::uint32_t kPatchColumns = 512;

Error invalid(const std::filesystem::path& path, const std::string& what) {
  return {ErrorCode::invalidFile, "sky map \"" + path.string() + "\": " + what};
}

// stb_image takes what lies behind the end of a file for zeros: note that it asked.
struct Source {
  std::span<const std::byte> bytes;
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

Result<SkyMap> readHdr(const std::filesystem::path& path, const MemoryCheck& fits) {
  const auto file = readFile(path, kMaxBytes);
  if (!file) return file.error();
  const auto* bytes = reinterpret_cast<const stbi_uc*>(file->bytes.data());
  const auto size = static_cast<int>(file->bytes.size());
  int width = 0, height = 0, channels = 0;
  if (stbi_info_from_memory(bytes, size, &width, &height, &channels) == 0 || width < 1 || height < 1)
    return invalid(path, "neither an OpenEXR nor a Radiance HDR file of up to 16384 x 16384 texels");
  const std::uint64_t texels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  if (texels > kMaxTexelsPerByte * file->bytes.size())
    return invalid(path, "claims " + std::to_string(width) + " x " + std::to_string(height) +
                             " texels, more than its " + std::to_string(file->bytes.size()) + " bytes can hold");
  if (fits) {
    if (Status ok = fits(2.0 * 12.0 * static_cast<double>(texels),
                         "a sky map of " + std::to_string(width) + " x " + std::to_string(height) + " texels");
        !ok)
      return ok.error();
  }
  Source source{file->bytes};
  const std::unique_ptr<float, void (*)(void*)> pixels(
      stbi_loadf_from_callbacks(&kSourceCallbacks, &source, &width, &height, &channels, 3), stbi_image_free);
  if (!pixels) return invalid(path, std::string("broken: ") + stbi_failure_reason());
  if (source.ranOut) return invalid(path, "ends before its last texel");
  SkyMap map{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), {}, 0.0f};
  map.texels.resize(texels);
  std::memcpy(map.texels.data(), pixels.get(), texels * sizeof(glm::vec3));
  return map;
}

Result<SkyMap> readExrSky(const std::filesystem::path& path, const MemoryCheck& fits) {
  auto image = readExr(path, fits);
  if (!image) return image.error();
  SkyMap map{image->width, image->height, image->layer(""), 0.0f};
  if (map.texels.empty()) return invalid(path, "channels R, G and B expected, not found");
  return map;
}

// What is wrong with a texel, or nothing.
const char* faultOf(const glm::vec3& texel) {
  for (int c = 0; c < 3; ++c) {
    if (std::isnan(texel[c])) return "NaN";
    if (texel[c] < 0.0f) return "negative";
    if (texel[c] > kMaxRadiance) return "over 1e9";
  }
  return nullptr;
}

}  // namespace

Result<SkyMap> readSkyMap(const std::filesystem::path& path, const MemoryCheck& fits) {
  const auto file = mapFile(path);
  if (!file) return file.error();
  constexpr unsigned char kExrMagic[4] = {0x76, 0x2F, 0x31, 0x01};
  const bool isExr = file->bytes.size() >= 4 && std::memcmp(file->bytes.data(), kExrMagic, 4) == 0;
  auto map = isExr ? readExrSky(path, fits) : readHdr(path, fits);
  if (!map) return map.error();
  for (std::size_t i = 0; i < map->texels.size(); ++i) {
    if (const char* fault = faultOf(map->texels[i])) {
      return invalid(path, "texel (" + std::to_string(i % map->width) + ", " + std::to_string(i / map->width) +
                               ") is " + fault + ", radiances of 0..1e9 W/m²/sr expected");
    }
  }
  return map;
}

std::vector<glm::vec3> skyPatchesOf(const SkyMap& map, std::span<const glm::vec3> skyDirection) {
  const SkyMap even = unrotatedSky(reducedSky(map, kPatchColumns), kPatchColumns);
  return projectEnvironment(skyDirection, even.texels, even.width, even.height);
}

}  // namespace relume
