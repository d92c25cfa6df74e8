// SPDX-License-Identifier: MIT
// See read_sky_map.h.
#include "tools/render/read_sky_map.h"

#include "bake/base/memory_budget.h"
#include "bake/import/read_images.h"
#include "formats/equirectangular.h"
#include "formats/file_io.h"
#include "formats/limits.h"
#include "relume/relighter.h"

#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

namespace relume {
namespace {

// Columns from which sky patches are made: finer than 4096 patches by far.
constexpr std::uint32_t kPatchColumns = 512;

std::string named(const std::filesystem::path& path) { return "sky map \"" + path.string() + "\""; }

Result<SkyMap> readHdr(const std::filesystem::path& path, std::span<const std::byte> file, const MemoryCheck& fits) {
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(file.data()), file.size());
  const auto size = peekHdr(bytes, named(path));
  if (!size) return size.error();
  if (fits) {
    const double texels = static_cast<double>(size->width) * static_cast<double>(size->height);
    if (Status ok = fits(2.0 * sizeof(glm::vec3) * texels, "a sky map of " + std::to_string(size->width) + " x " +
                                                               std::to_string(size->height) + " texels");
        !ok)
      return ok.error();
  }
  auto texels = decodeHdr(bytes, named(path));
  if (!texels) return texels.error();
  return SkyMap{size->width, size->height, std::move(*texels)};
}

Result<SkyMap> readExrSky(const std::filesystem::path& path, const MemoryCheck& fits) {
  auto image = readExr(path, fits);
  if (!image) return image.error();
  SkyMap map{image->width, image->height, image->layer("")};
  if (map.texels.empty())
    return Error{ErrorCode::invalidFile,
                 named(path) + ": channels R, G and B expected, not found, or found in several parts"};
  return map;
}

// What is wrong with a texel, or null.
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
  const bool isHdr = file->bytes.size() > 2 && std::memcmp(file->bytes.data(), "#?", 2) == 0;
  if (!isExr(file->bytes) && !isHdr)
    return Error{ErrorCode::invalidFile, named(path) + ": neither an OpenEXR nor a Radiance HDR file"};
  auto map = isHdr ? readHdr(path, file->bytes, fits) : readExrSky(path, fits);
  if (!map) return map.error();
  for (std::size_t i = 0; i < map->texels.size(); ++i) {
    if (const char* fault = faultOf(map->texels[i])) {
      return Error{ErrorCode::invalidFile, named(path) + ": texel (" + std::to_string(i % map->width) + ", " +
                                               std::to_string(i / map->width) + ") is " + fault +
                                               ", radiances of 0..1e9 W/m²/sr expected"};
    }
  }
  return map;
}

Result<SkyMap> readSkyMap(const std::filesystem::path& path, Context& context) {
  return readSkyMap(path, [&context](double bytes, const std::string& what) {
    return reserveMemory(context, "sky map", bytes, what, "use a smaller one");
  });
}

std::vector<glm::vec3> skyPatchesOf(const Sky& sky, std::span<const glm::vec3> skyDirection) {
  if (sky.isConstant()) return {};
  if (!sky.map) return twoColorSky(skyDirection, sky.radiance, *sky.below);
  constexpr std::uint32_t kRows = kPatchColumns / 2;
  const Sky coarse{{}, {}, std::make_shared<const SkyMap>(reducedSky(*sky.map, kPatchColumns)), sky.rotationDeg};
  std::vector<glm::vec3> texels;
  texels.reserve(std::size_t{kPatchColumns} * kRows);
  for (std::uint32_t y = 0; y < kRows; ++y) {
    for (std::uint32_t x = 0; x < kPatchColumns; ++x)
      texels.push_back(coarse.along(fromEquirectangular({(x + 0.5) / kPatchColumns, (y + 0.5) / kRows})));
  }
  return projectEnvironment(skyDirection, texels, kPatchColumns, kRows);
}

}  // namespace relume
