// SPDX-License-Identifier: MIT
// Pictures as other programs write them: OpenEXR windows, parts and what is refused of them; PNGs of 16 bits.
#include "tools/images/read_picture.h"

#include "formats/color.h"

#include <gtest/gtest.h>

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfTiledOutputFile.h>
#include <unistd.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>

namespace relume {
namespace {

namespace fs = std::filesystem;
using Imath::Box2i;
using Imath::V2i;

const Box2i kDisplay(V2i(10, 20), V2i(49, 39));  // 40 x 20

// What a pixel of a file holds: its place.
float placed(int x, int y) { return static_cast<float>(1000 * y + x); }

Imf::Header header(const Box2i& data, const std::vector<std::string>& channels, int sampling = 1) {
  Imf::Header h(kDisplay, data);
  for (const std::string& name : channels) h.channels().insert(name, Imf::Channel(Imf::FLOAT, sampling, sampling));
  return h;
}

// Values for every pixel of a data window, times a factor, all channels the same.
struct Values {
  Values(const Imf::Header& h, float factor) {
    const Box2i data = h.dataWindow();
    for (int y = data.min.y; y <= data.max.y; ++y) {
      for (int x = data.min.x; x <= data.max.x; ++x) values.push_back(factor * placed(x, y));
    }
    for (auto it = h.channels().begin(); it != h.channels().end(); ++it)
      buffer.insert(it.name(), Imf::Slice::Make(Imf::FLOAT, values.data(), data, 0, 0, it.channel().xSampling,
                                                it.channel().ySampling));
    rows = data.max.y - data.min.y + 1;
  }
  std::vector<float> values;
  Imf::FrameBuffer buffer;
  int rows = 0;
};

class PictureFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("relume_pictures_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const Imf::Header& h) const {
    const Values v(h, 1.0f);
    Imf::OutputFile file(at(name).c_str(), h);
    file.setFrameBuffer(v.buffer);
    file.writePixels(v.rows);
    return at(name);
  }
  std::string writeTiled(const std::string& name, Imf::Header h) const {
    const Values v(h, 1.0f);
    h.setTileDescription(Imf::TileDescription(16, 16));
    Imf::TiledOutputFile file(at(name).c_str(), h);
    file.setFrameBuffer(v.buffer);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
    return at(name);
  }
  // Of part n every value is n + 1 times its place.
  std::string writeParts(const std::string& name, std::vector<std::pair<std::string, Imf::Header>> parts) const {
    std::vector<Imf::Header> headers;
    for (auto& [part, h] : parts) {
      h.setName(part);
      h.setType(Imf::SCANLINEIMAGE);
      headers.push_back(h);
    }
    Imf::MultiPartOutputFile file(at(name).c_str(), headers.data(), static_cast<int>(headers.size()));
    for (std::size_t p = 0; p < headers.size(); ++p) {
      const Values v(headers[p], static_cast<float>(p + 1));
      Imf::OutputPart part(file, static_cast<int>(p));
      part.setFrameBuffer(v.buffer);
      part.writePixels(v.rows);
    }
    return at(name);
  }
  static void expectRefused(const std::string& path, const std::string& words) {
    const auto image = readExr(path);
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().code, ErrorCode::invalidFile);
    EXPECT_NE(image.error().message.find(words), std::string::npos) << image.error().message;
  }
  fs::path folder_;
};

// Each pixel of the display window: its place, times a factor, where a data window has it, otherwise 0.
std::vector<float> shown(const Box2i& data, float factor = 1.0f) {
  std::vector<float> values;
  for (int y = kDisplay.min.y; y <= kDisplay.max.y; ++y) {
    for (int x = kDisplay.min.x; x <= kDisplay.max.x; ++x)
      values.push_back(data.intersects(V2i(x, y)) ? factor * placed(x, y) : 0.0f);
  }
  return values;
}

TEST_F(PictureFiles, AnImageIsWhatItsDisplayWindowShows) {
  const Box2i windows[] = {
      kDisplay,
      Box2i(V2i(15, 25), V2i(30, 30)),    // cropped
      Box2i(V2i(0, 10), V2i(60, 50)),     // overscan
      Box2i(V2i(-100, 22), V2i(12, 60)),  // both, by side
      Box2i(V2i(100, 0), V2i(120, 10)),   // elsewhere
      Box2i(V2i(10, 100), V2i(49, 110)),  // below
  };
  for (const Box2i& data : windows) {
    for (const bool tiled : {false, true}) {
      const Imf::Header h = header(data, {"R", "G", "B"});
      const auto image = readExr(tiled ? writeTiled("a.exr", h) : write("a.exr", h));
      ASSERT_TRUE(image) << image.error().message;
      EXPECT_EQ(image->width, 40u);
      EXPECT_EQ(image->height, 20u);
      for (const char* name : {"R", "G", "B"})
        EXPECT_TRUE(image->channels.at(name) == shown(data)) << data.min.x << ", " << data.min.y << " " << tiled;
    }
  }
}

TEST_F(PictureFiles, WindowsAreOfASizeAndTheirMemoryIsAskedFor) {
  Imf::Header h = header(Box2i(V2i(0, 0), V2i(0, 0)), {"R", "G", "B"});
  h.displayWindow() = Box2i(V2i(0, 0), V2i(16384, 9));
  expectRefused(write("a.exr", h), "16385 x 10 pixels, at most 16384 x 16384 expected");
  h.displayWindow() = Box2i(V2i(0, 0), V2i(16383, 16383));
  double asked = 0.0;
  const auto refuse = [&asked](double bytes, const std::string& what) -> Status {
    asked = bytes;
    return Error{ErrorCode::memory, what};
  };
  EXPECT_EQ(readExr(write("a.exr", h), refuse).error().code, ErrorCode::memory);
  EXPECT_EQ(asked, 16384.0 * 16384.0 * 3 * 4);
  // Rows as wide as both windows, where they meet.
  EXPECT_FALSE(readExr(write("a.exr", header(Box2i(V2i(0, 0), V2i(59, 0)), {"R"})), refuse));
  EXPECT_EQ(asked, 40.0 * 20 * 4);
  EXPECT_FALSE(readExr(write("a.exr", header(Box2i(V2i(0, 20), V2i(59, 20)), {"R"})), refuse));
  EXPECT_EQ(asked, 60.0 * 20 * 4);
}

// Of two views neither is the picture; what one part alone has needs no name of it.
TEST_F(PictureFiles, ChannelsOfSeveralPartsAreNamedByTheirPart) {
  const Box2i small(V2i(12, 22), V2i(13, 22));
  const auto image = readExr(writeParts("a.exr", {{"left", header(kDisplay, {"R", "G", "B", "A"})},
                                                  {"right", header(small, {"R", "G", "B"})},
                                                  {"depth", header(kDisplay, {"Z", "depth.V"})}}));
  ASSERT_TRUE(image) << image.error().message;
  std::string names;
  for (const auto& [name, values] : image->channels) names += name + " ";
  EXPECT_EQ(names, "A Z depth.V left.B left.G left.R right.B right.G right.R ");
  EXPECT_EQ(image->channels.at("left.G"), shown(kDisplay));
  EXPECT_EQ(image->channels.at("right.R"), shown(small, 2.0f));
  EXPECT_EQ(image->channels.at("Z"), shown(kDisplay, 3.0f));

  const auto none = readPicture(at("a.exr"), "");
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("name one of its layers with --layer: left, right"), std::string::npos);
  const auto right = readPicture(at("a.exr"), "right");
  ASSERT_TRUE(right) << right.error().message;
  EXPECT_EQ(right->picture.pixels[2 * 40 + 3], glm::vec3(2.0f * placed(13, 22)));

  const auto plain = readPicture(writeParts("b.exr", {{"rgba", header(kDisplay, {"R", "G", "B", "A"})},
                                                      {"DiffInd", header(kDisplay, {"DiffInd.R"})}}),
                                 "");
  ASSERT_TRUE(plain) << plain.error().message;
  expectRefused(writeParts("c.exr", {{"a", header(kDisplay, {"R", "b.R"})}, {"b", header(kDisplay, {"R"})}}),
                "channel \"b.R\" twice");
}

TEST_F(PictureFiles, SubsampledAndDeepPixelsAreRefusedByName) {
  expectRefused(write("a.exr", header(kDisplay, {"R", "G", "B"}, 2)),
                "a.exr\": channel \"B\" has one value for 2 x 2 pixels, one for each expected");
  Imf::Header h = header(Box2i(V2i(0, 0), V2i(1, 1)), {"R", "G", "B", "A", "Z"});
  h.compression() = Imf::ZIPS_COMPRESSION;
  h.setType(Imf::DEEPSCANLINE);
  {
    float value = 0.5f;
    std::vector<unsigned> counts(4, 1);
    std::vector<float*> samples(4, &value);
    const std::size_t number = sizeof(unsigned), pointer = sizeof(float*);
    Imf::DeepFrameBuffer buffer;
    buffer.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()), number, 2 * number));
    for (const char* name : {"R", "G", "B", "A", "Z"})
      buffer.insert(name, Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(samples.data()), pointer, 2 * pointer,
                                         sizeof(float)));
    Imf::DeepScanLineOutputFile file(at("deep.exr").c_str(), h);
    file.setFrameBuffer(buffer);
    file.writePixels(2);
  }
  expectRefused(at("deep.exr"), "deep.exr\": deep pixels");
}

// A PNG of one row: `samples` of 16 bits.
std::string deepPng(char colorType, std::size_t channels, const std::vector<std::uint16_t>& samples) {
  const auto big = [](std::size_t v) {
    return std::string{static_cast<char>(v >> 24), static_cast<char>(v >> 16), static_cast<char>(v >> 8),
                       static_cast<char>(v)};
  };
  std::string row(1, '\0');
  for (const std::uint16_t v : samples) row += big(v).substr(2);
  uLongf size = compressBound(row.size());
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(row.data()), row.size());
  packed.resize(size);
  std::string file = "\x89PNG\r\n\x1a\n";
  const auto chunk = [&](const std::string& type, const std::string& data) {
    const std::string all = type + data;
    file += big(data.size()) + all +
            big(crc32(0, reinterpret_cast<const Bytef*>(all.data()), static_cast<uInt>(all.size())));
  };
  chunk("IHDR", big(samples.size() / channels) + big(1) + '\x10' + colorType + std::string(3, '\0'));
  chunk("IDAT", packed);
  chunk("IEND", "");
  return file;
}

TEST_F(PictureFiles, APngOfSixteenBitsIsReadInAllOfThem) {
  const auto read = [this](const std::string& bytes) {
    std::ofstream(folder_ / "a.png", std::ios::binary) << bytes;
    return readPicture(at("a.png"), "");
  };
  const auto linear = [](int v) { return srgbToLinear(static_cast<float>(v) / 65535.0f); };
  const auto colors = read(deepPng(2, 3, {0x8000, 0x8001, 0x80FF, 0, 1, 65535}));
  ASSERT_TRUE(colors) << colors.error().message;
  EXPECT_EQ(colors->picture.pixels[0], glm::vec3(linear(0x8000), linear(0x8001), linear(0x80FF)));
  EXPECT_EQ(colors->picture.pixels[1], glm::vec3(0.0f, linear(1), 1.0f));
  EXPECT_TRUE(colors->opaque);
  const auto grey = read(deepPng(4, 2, {1000, 65535, 2000, 65534}));
  ASSERT_TRUE(grey) << grey.error().message;
  EXPECT_EQ(grey->picture.pixels[1], glm::vec3(linear(2000)));
  EXPECT_FALSE(grey->opaque);
}

}  // namespace
}  // namespace relume
