// SPDX-License-Identifier: MIT
// See read_picture.h.
#include "tools/images/read_picture.h"

#include "bake/import/read_images.h"
#include "formats/color.h"
#include "formats/file_io.h"
#include "tools/images/image_io.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <limits>

namespace relume {
namespace {

constexpr std::array<unsigned char, 4> kPngMagic{0x89, 'P', 'N', 'G'};

Error invalid(const std::string& path, const std::string& what) {
  return {ErrorCode::invalidFile, "\"" + path + "\": " + what};
}

// "DiffInd, DiffDir, ..." of the layers that have R, G and B; empty: none.
std::string layersOf(const ChannelImage& image) {
  std::string text;
  for (const auto& [name, values] : image.channels) {
    if (!name.ends_with(".R")) continue;
    const std::string layer = name.substr(0, name.size() - 2);
    if (image.channels.contains(layer + ".G") && image.channels.contains(layer + ".B"))
      text += (text.empty() ? "" : ", ") + layer;
  }
  return text;
}

// "A, Depth, ...", at most eight.
std::string channelsOf(const ChannelImage& image) {
  constexpr std::size_t kNamed = 8;
  std::string text;
  std::size_t count = 0;
  for (const auto& [name, values] : image.channels) {
    if (count++ < kNamed) text += (text.empty() ? "" : ", ") + name;
  }
  return count > kNamed ? text + ", ..." : text;
}

std::vector<std::string> split(const std::string& layers) {
  std::vector<std::string> names;
  for (std::size_t begin = 0; begin <= layers.size();) {
    const std::size_t end = std::min(layers.find('+', begin), layers.size());
    names.push_back(layers.substr(begin, end - begin));
    begin = end + 1;
  }
  return names;
}

Result<PictureFile> readExrPicture(const std::string& path, const std::string& layers, const MemoryCheck& fits) {
  const Result<ChannelImage> image = readExr(path, fits);
  if (!image) return image.error();
  PictureFile file{{image->width, image->height, {}}, false, true, "R,G,B", layersOf(*image)};
  std::size_t found = 0;
  const std::vector<std::string> names = layers.empty() ? std::vector<std::string>() : split(layers);
  for (const std::string& name : names) {
    const std::vector<glm::vec3> layer = image->layer(name);
    if (layer.empty() || name.empty()) continue;
    file.picture.pixels.resize(layer.size(), glm::vec3(0.0f));
    for (std::size_t i = 0; i < layer.size(); ++i) file.picture.pixels[i] += layer[i];
    ++found;
  }
  const Error otherLayers{ErrorCode::usage, "--layer: expected layers of \"" + path + "\", found \"" + layers +
                                                "\"; it has " + file.layers};
  if (found > 0 && found < names.size()) return otherLayers;
  if (found > 0) {
    file.channels = layers;
    return file;
  }
  file.picture.pixels = image->layer("");
  if (!file.picture.pixels.empty()) return file;
  // Grey; with RY and BY, its colours are coded.
  const auto grey = image->channels.find("Y");
  if (grey != image->channels.end() && !image->channels.contains("RY") && !image->channels.contains("BY")) {
    for (const float y : grey->second) file.picture.pixels.emplace_back(y);
    file.channels = "Y";
    return file;
  }
  if (file.layers.empty())
    return invalid(path, "has no channels R, G, B, no grey Y, and no layers; its channels: " + channelsOf(*image));
  if (layers.empty())
    return invalid(path, "has no channels R, G, B; name one of its layers with --layer: " + file.layers);
  return otherLayers;
}

// The decoder takes no notice of checksums. A file that ends early is for it to tell.
Status checkPngSums(std::span<const std::uint8_t> png, const std::string& path) {
  constexpr std::size_t kSignature = 8, kLength = 4, kType = 4, kSum = 4;
  const auto number = [&](std::size_t at) {
    return std::uint32_t{png[at]} << 24 | std::uint32_t{png[at + 1]} << 16 | std::uint32_t{png[at + 2]} << 8 |
           png[at + 3];
  };
  for (std::size_t at = kSignature; at + kLength + kType + kSum <= png.size();) {
    const std::size_t length = number(at), left = png.size() - at - kLength - kType - kSum;
    if (length > left) break;
    const std::uint8_t* type = &png[at + kLength];
    const std::string name(type, type + kType);
    if (crc32(0, type, static_cast<uInt>(kType + length)) != number(at + kLength + kType + length))
      return invalid(path, "damaged: the checksum of chunk \"" + name + "\" at byte " + std::to_string(at) +
                               " is not that of its data");
    if (name == "IEND") break;
    at += kLength + kType + length + kSum;
  }
  return done();
}

// The linear picture of sRGB values: red, green, blue, alpha of each pixel.
template <class Value>
PictureFile linearPicture(const ImageSize& size, const std::vector<Value>& rgba) {
  constexpr Value kMax = std::numeric_limits<Value>::max();
  PictureFile file{{size.width, size.height, {}}, true, true, "sRGB", ""};
  file.picture.pixels.resize(rgba.size() / 4);
  for (std::size_t i = 0; i < file.picture.pixels.size(); ++i) {
    for (int c = 0; c < 3; ++c)
      file.picture.pixels[i][c] = srgbToLinear(static_cast<float>(rgba[4 * i + static_cast<std::size_t>(c)]) / kMax);
    if (rgba[4 * i + 3] != kMax) file.opaque = false;
  }
  return file;
}

Result<PictureFile> readPngPicture(const std::string& path, const MemoryCheck& fits) {
  const Result<FileBytes> bytes = readFile(path, kMaxImageBytes);
  if (!bytes) return bytes.error();
  const auto* first = reinterpret_cast<const std::uint8_t*>(bytes->bytes.data());
  if (Status ok = checkPngSums({first, bytes->bytes.size()}, path); !ok) return ok.error();
  const Result<ImageSize> size = peekImage({first, bytes->bytes.size()}, "\"" + path + "\"");
  if (!size) return size.error();
  if (fits) {
    const double pixelBytes = 2 * 4 * (size->isDeep ? 2 : 1) + 12;  // as decoded, as four values, as numbers
    const double pixels = static_cast<double>(size->width) * size->height;
    if (Status ok = fits(pixelBytes * pixels, "the image \"" + path + "\""); !ok) return ok.error();
  }
  if (size->isDeep) {
    const auto rgba = decodeDeepImage({first, bytes->bytes.size()}, "\"" + path + "\"");
    if (!rgba) return rgba.error();
    return linearPicture(*size, *rgba);
  }
  const Result<Image> image = decodeImage({first, bytes->bytes.size()}, "\"" + path + "\"");
  if (!image) return image.error();
  return linearPicture(*size, image->levels.at(0).rgba);
}

}  // namespace

Result<PictureFile> readPicture(const std::string& path, const std::string& layers, const MemoryCheck& fits) {
  std::array<unsigned char, 4> magic{};
  std::error_code ec;
  if (!std::filesystem::is_regular_file(path, ec)) {
    const bool there = std::filesystem::exists(path, ec);
    return Error{ErrorCode::io, (there ? "not a regular file: \"" : "no such file: \"") + path + "\""};
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) return Error{ErrorCode::io, "cannot read \"" + path + "\""};
  in.read(reinterpret_cast<char*>(magic.data()), magic.size());
  if (isExr(std::as_bytes(std::span(magic).first(static_cast<std::size_t>(in.gcount())))))
    return readExrPicture(path, layers, fits);
  if (in.gcount() == magic.size() && magic == kPngMagic) return readPngPicture(path, fits);
  return invalid(path, "is neither an OpenEXR nor a PNG image");
}

}  // namespace relume
