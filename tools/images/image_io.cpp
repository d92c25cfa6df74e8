// SPDX-License-Identifier: MIT
// See image_io.h. The only file that includes OpenEXR and stb_image_write.
#include "tools/images/image_io.h"

#include "formats/color.h"
#include "formats/file_io.h"

#include <ImfChannelList.h>
#include <ImfCompression.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <half.h>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb_image_write.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <new>

namespace relume {
namespace {

constexpr std::int64_t kMaxSize = 16384;  // [pixels] a side
constexpr std::size_t kMaxChannels = 1024;

std::string channelName(const std::string& layer, char suffix) {
  return layer.empty() ? std::string(1, suffix) : layer + '.' + suffix;
}

// A file in memory, for OpenEXR, which goes back to fill in its table of offsets.
class MemoryStream : public Imf::OStream {
 public:
  MemoryStream() : OStream("") {}
  void write(const char data[], int size) override {
    const auto count = static_cast<std::size_t>(size);
    if (bytes.size() < at_ + count) bytes.resize(at_ + count);
    std::copy_n(reinterpret_cast<const std::byte*>(data), count, bytes.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ += count;
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t at) override { at_ = static_cast<std::size_t>(at); }

  std::vector<std::byte> bytes;

 private:
  std::size_t at_ = 0;
};

Status writeBytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  return writeFileAtomically(path, [bytes](const ByteSink& sink) { return sink(bytes); });
}

Error cannotWrite(const std::filesystem::path& path, const std::string& why) {
  return {ErrorCode::failed, "cannot write \"" + path.string() + "\": " + why};
}

Status checkSize(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height, std::size_t pixels) {
  if (width > 0 && height > 0 && pixels == std::size_t{width} * height) return done();
  return Error{ErrorCode::usage, "cannot write \"" + path.string() + "\": " + std::to_string(width) + " x " +
                                     std::to_string(height) + " pixels expected, " + std::to_string(pixels) + " found"};
}

// stb_image_write counts the bytes of all rows, each with one for its filter, in an int, and grows what it packs them
// to by doubling.
bool fitsPng(std::uint64_t width, std::uint64_t height) { return (3 * width + 1) * height < 1u << 30; }

// How many bytes of pixels a byte of a file can stand for; 0 = no bound is known.
double maxPacking(Imf::Compression compression) {
  switch (compression) {
    case Imf::NO_COMPRESSION:
      return 1.0;
    case Imf::RLE_COMPRESSION:
      return 64.0;  // runs of 128 in two bytes
    case Imf::ZIPS_COMPRESSION:
    case Imf::ZIP_COMPRESSION:
    case Imf::PXR24_COMPRESSION:
      return 1032.0 * 4.0 / 3.0;  // deflate; PXR24 drops a byte of four before
    default:
      return 0.0;
  }
}

std::int64_t widthOf(const Imath::Box2i& window) { return std::int64_t{window.max.x} - window.min.x + 1; }
std::int64_t heightOf(const Imath::Box2i& window) { return std::int64_t{window.max.y} - window.min.y + 1; }

// Pixels of a display window and, to its left and right, those of a data window that reaches into it: what rows are
// read to.
Imath::Box2i readWindow(const Imath::Box2i& display, const Imath::Box2i& data) {
  Imath::Box2i window = display;
  if (!data.intersects(display)) return window;
  window.min.x = std::min(display.min.x, data.min.x);
  window.max.x = std::max(display.max.x, data.max.x);
  return window;
}

double sizeToRead(const Imf::Header& header) {
  const Imath::Box2i window = readWindow(header.displayWindow(), header.dataWindow());
  return static_cast<double>(widthOf(window)) * static_cast<double>(heightOf(window)) * sizeof(float);
}

// Whether what a header says can be read, and its pixels can be in the file. One of 300 bytes may claim gigabytes.
Status checkHeader(const std::filesystem::path& path, const Imf::Header& header) {
  const auto invalid = [&path](const std::string& what) {
    return Error{ErrorCode::invalidFile, "\"" + path.string() + "\": " + what};
  };
  if (header.hasType() && Imf::isDeepData(header.type()))
    return invalid("deep pixels, of many values each; flatten it to one value each");
  const Imath::Box2i data = header.dataWindow();
  for (const Imath::Box2i& window : {data, header.displayWindow()}) {
    const std::int64_t width = widthOf(window), height = heightOf(window);
    if (width < 1 || height < 1 || width > kMaxSize || height > kMaxSize)
      return invalid(std::to_string(width) + " x " + std::to_string(height) +
                     " pixels, at most 16384 x 16384 expected");
  }
  const double pixels = static_cast<double>(widthOf(data)) * static_cast<double>(heightOf(data));
  double stored = 0.0, count = 0.0;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it, count += 1.0) {
    const Imf::Channel& channel = it.channel();
    if (channel.xSampling != 1 || channel.ySampling != 1)
      return invalid("channel \"" + std::string(it.name()) + "\" has one value for " +
                     std::to_string(channel.xSampling) + " x " + std::to_string(channel.ySampling) +
                     " pixels, one for each expected; write it without subsampling");
    stored += pixels * (channel.type == Imf::HALF ? 2.0 : 4.0);
  }
  std::error_code ec;
  const double size = static_cast<double>(std::filesystem::file_size(path, ec));
  const double packing = maxPacking(header.compression());
  if (ec || packing <= 0.0 || stored <= packing * size) return done();
  std::array<char, 96> text;
  std::snprintf(text.data(), text.size(), "claims %.0f pixels of %.0f channels in %.0f bytes", pixels, count, size);
  return invalid(text.data());
}

// Leave `width` columns of rows, from a first one.
void cropRows(std::vector<float>& rows, std::size_t rowWidth, std::size_t first, std::size_t width) {
  const std::size_t height = rows.size() / rowWidth;
  for (std::size_t y = 0; y < height; ++y)
    std::memmove(&rows[y * width], &rows[y * rowWidth + first], width * sizeof(float));
  rows.resize(width * height);
}

// Put a part's channels, by their names in the image, where its data window lies; the rest of the image is 0.
void readPart(Imf::MultiPartInputFile& file, int number, const std::map<std::string, std::vector<float>*>& channels) {
  Imf::InputPart part(file, number);
  const Imath::Box2i data = part.header().dataWindow(), display = part.header().displayWindow();
  const Imath::Box2i window = readWindow(display, data);
  const auto width = static_cast<std::size_t>(widthOf(window));
  Imf::FrameBuffer buffer;
  for (const auto& [name, channel] : channels) {
    channel->resize(width * static_cast<std::size_t>(heightOf(window)));
    buffer.insert(name,
                  Imf::Slice::Make(Imf::FLOAT, channel->data(), window, sizeof(float), sizeof(float) * width, 1, 1));
  }
  if (!data.intersects(display)) return;
  part.setFrameBuffer(buffer);
  part.readPixels(std::max(data.min.y, display.min.y), std::min(data.max.y, display.max.y));
  if (window == display) return;
  for (const auto& [name, channel] : channels) {
    cropRows(*channel, width, static_cast<std::size_t>(std::int64_t{display.min.x} - window.min.x),
             static_cast<std::size_t>(widthOf(display)));
  }
}

}  // namespace

void ChannelImage::setLayer(const std::string& name, std::span<const glm::vec3> pixels, const char* suffixes) {
  for (int c = 0; c < 3; ++c) {
    std::vector<float>& channel = channels[channelName(name, suffixes[c])];
    channel.resize(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) channel[i] = pixels[i][c];
  }
}

std::vector<glm::vec3> ChannelImage::layer(const std::string& name, const char* suffixes) const {
  std::vector<glm::vec3> pixels(std::size_t{width} * height);
  for (int c = 0; c < 3; ++c) {
    const auto found = channels.find(channelName(name, suffixes[c]));
    if (found == channels.end()) return {};
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i][c] = found->second[i];
  }
  return pixels;
}

bool isExr(std::span<const std::byte> beginning) {
  constexpr std::array<unsigned char, 4> kMagic{0x76, 0x2F, 0x31, 0x01};
  return beginning.size() >= kMagic.size() && std::memcmp(beginning.data(), kMagic.data(), kMagic.size()) == 0;
}

Result<ChannelImage> readExr(const std::filesystem::path& path, const MemoryCheck& fits) {
  if (std::ifstream probe(path, std::ios::binary); !probe || probe.peek() == std::ifstream::traits_type::eof()) {
    return Error{ErrorCode::io, "cannot read \"" + path.string() + "\""};
  }
  try {
    // 1. What the headers claim
    Imf::MultiPartInputFile file(path.string().c_str(), 0);
    std::map<std::string, int> partsWith;  // a channel of this name
    std::size_t count = 0;
    double bytes = 0.0;
    for (int p = 0; p < file.parts(); ++p) {
      const Imf::Header& header = file.header(p);
      if (Status ok = checkHeader(path, header); !ok) return ok.error();
      for (auto it = header.channels().begin(); it != header.channels().end(); ++it, ++count) {
        ++partsWith[it.name()];
        bytes += sizeToRead(header);
      }
    }
    if (count > kMaxChannels)
      return Error{ErrorCode::invalidFile, "\"" + path.string() + "\": more than 1024 channels"};
    if (Status ok = fits ? fits(bytes, "the image \"" + path.string() + "\"") : done(); !ok) return ok.error();

    // 2. Their pixels
    const Imath::Box2i display = file.header(0).displayWindow();  // of all parts, as OpenEXR sees to
    ChannelImage image{static_cast<std::uint32_t>(widthOf(display)), static_cast<std::uint32_t>(heightOf(display)), {}};
    for (int p = 0; p < file.parts(); ++p) {
      const Imf::Header& header = file.header(p);
      std::map<std::string, std::vector<float>*> channels;
      for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
        const std::string name = partsWith[it.name()] > 1 ? header.name() + '.' + it.name() : it.name();
        const auto [channel, isNew] = image.channels.try_emplace(name);
        if (!isNew) return Error{ErrorCode::invalidFile, "\"" + path.string() + "\": channel \"" + name + "\" twice"};
        channels[it.name()] = &channel->second;
      }
      readPart(file, p, channels);
    }
    return image;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::failed, "\"" + path.string() + "\": out of memory"};
  } catch (const std::exception& e) {
    return Error{ErrorCode::invalidFile, "\"" + path.string() + "\" is not a readable OpenEXR: " + e.what()};
  }
}

Status writeExr(const std::filesystem::path& path, const ChannelImage& image, bool half) {
  for (const auto& [name, channel] : image.channels) {
    if (Status ok = checkSize(path, image.width, image.height, channel.size()); !ok) return ok;
  }
  MemoryStream stream;
  try {
    Imf::Header header(static_cast<int>(image.width), static_cast<int>(image.height));
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::FrameBuffer buffer;
    std::map<std::string, std::vector<Imath::half>> narrow;
    for (const auto& [name, channel] : image.channels) {
      const bool isHalf = half && !name.starts_with("Depth") && !name.starts_with("Position");
      if (isHalf) narrow[name].assign(channel.begin(), channel.end());
      const Imf::PixelType type = isHalf ? Imf::HALF : Imf::FLOAT;
      const std::size_t stride = isHalf ? sizeof(Imath::half) : sizeof(float);
      // Only read through by writePixels.
      const void* values = isHalf ? static_cast<const void*>(narrow[name].data()) : channel.data();
      auto* base = static_cast<char*>(const_cast<void*>(values));
      header.channels().insert(name, Imf::Channel(type));
      buffer.insert(name, Imf::Slice(type, base, stride, stride * image.width));
    }
    Imf::OutputFile file(stream, header, 0);
    file.setFrameBuffer(buffer);
    file.writePixels(static_cast<int>(image.height));
  } catch (const std::bad_alloc&) {
    return cannotWrite(path, "out of memory");
  } catch (const std::exception& e) {
    return cannotWrite(path, e.what());
  }
  return writeBytes(path, stream.bytes);
}

Status writePng(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height,
                std::span<const glm::vec3> pixels, float exposure) {
  return writePng(path, width, height, encodeSrgb(pixels, exposure));
}

std::vector<std::uint8_t> encodeSrgb(std::span<const glm::vec3> pixels, float exposure) {
  std::vector<std::uint8_t> rgb(3 * pixels.size());
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    const float linear = pixels[i / 3][static_cast<int>(i % 3)] * exposure;
    const float clipped = linear > 0.0f ? std::min(linear, 1.0f) : 0.0f;
    rgb[i] = static_cast<std::uint8_t>(std::lround(255.0f * linearToSrgb(clipped)));
  }
  return rgb;
}

Status writePng(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height,
                std::span<const std::uint8_t> rgb) {
  if (Status ok = checkSize(path, width, height, rgb.size() / 3); !ok) return ok;
  if (!fitsPng(width, height))
    return Error{ErrorCode::failed, "cannot write \"" + path.string() + "\": " + std::to_string(width) + " x " +
                                        std::to_string(height) +
                                        " pixels are too many for a PNG, whose rows hold less than "
                                        "1 GiB in all; write an .exr, or a smaller image"};
  const std::vector<std::byte> bytes = encodePng(width, height, rgb);
  return bytes.empty() ? cannotWrite(path, "out of memory") : writeBytes(path, bytes);
}

std::vector<std::byte> encodePng(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb) {
  std::vector<std::byte> bytes;
  if (width == 0 || height == 0 || rgb.size() != std::size_t{3} * width * height || !fitsPng(width, height))
    return bytes;
  const auto append = [](void* context, void* data, int size) {
    const auto* first = static_cast<const std::byte*>(data);
    auto& all = *static_cast<std::vector<std::byte>*>(context);
    all.insert(all.end(), first, first + size);
  };
  stbi_write_png_to_func(append, &bytes, static_cast<int>(width), static_cast<int>(height), 3, rgb.data(),
                         static_cast<int>(3 * width));
  return bytes;
}

Status writeImage(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height,
                  std::span<const glm::vec3> pixels, float exposure) {
  const std::string extension = lowerExtension(path);
  if (extension == ".png") return writePng(path, width, height, pixels, exposure);
  if (extension != ".exr") {
    return Error{ErrorCode::usage, "\"" + path.string() + "\": the extension must be .exr or .png"};
  }
  if (Status ok = checkSize(path, width, height, pixels.size()); !ok) return ok;
  ChannelImage image{width, height, {}};
  image.setLayer("", pixels);
  return writeExr(path, image);
}

}  // namespace relume
