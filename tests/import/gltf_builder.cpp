// SPDX-License-Identifier: MIT
#include "tests/import/gltf_builder.h"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#endif
#include <stb/stb_image_write.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include <gtest/gtest.h>

#include <unistd.h>

#include <fstream>

namespace relume::testing {

namespace fs = std::filesystem;

fs::path testFolder() {
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  std::string name = std::string(info->test_suite_name()) + "_" + info->name();
  for (char& c : name) {
    if (c == '/') c = '_';
  }
  const fs::path folder = fs::path(::testing::TempDir()) / ("relume_scene_" + std::to_string(::getpid())) / name;
  fs::create_directories(folder);
  return folder;
}

std::vector<std::uint8_t> png(std::uint32_t width, std::uint32_t height, const std::vector<std::uint8_t>& rgba) {
  std::vector<std::uint8_t> out;
  stbi_write_png_to_func(
      [](void* to, void* data, int size) {
        auto* bytes = static_cast<std::uint8_t*>(data);
        static_cast<std::vector<std::uint8_t>*>(to)->insert(static_cast<std::vector<std::uint8_t>*>(to)->end(), bytes,
                                                            bytes + size);
      },
      &out, static_cast<int>(width), static_cast<int>(height), 4, rgba.data(), static_cast<int>(4 * width));
  return out;
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  static const char* kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < left ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) out.push_back(k <= left ? kAlphabet[bits >> (18 - 6 * k) & 63] : '=');
  }
  return out;
}

fs::path writeFile(const std::string& name, const std::vector<std::uint8_t>& bytes) {
  const fs::path path = testFolder() / name;
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return path;
}

fs::path writeFile(const std::string& name, const std::string& text) {
  return writeFile(name, std::vector<std::uint8_t>(text.begin(), text.end()));
}

std::vector<std::uint8_t> glb(const std::string& jsonText, const std::vector<std::uint8_t>& binary) {
  std::vector<std::uint8_t> out;
  const auto u32 = [&](std::size_t v) {
    for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(v >> (8 * i) & 0xFF));
  };
  std::string text = jsonText;
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::vector<std::uint8_t> bin = binary;
  bin.resize((bin.size() + 3) / 4 * 4, 0);
  u32(0x46546C67);
  u32(2);
  u32(12 + 8 + text.size() + (bin.empty() ? 0 : 8 + bin.size()));
  u32(text.size());
  u32(0x4E4F534A);
  out.insert(out.end(), text.begin(), text.end());
  if (bin.empty()) return out;
  u32(bin.size());
  u32(0x004E4942);
  out.insert(out.end(), bin.begin(), bin.end());
  return out;
}

GltfBuilder::GltfBuilder() {
  root = {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", json::array({{{"nodes", json::array()}}})}};
}

int GltfBuilder::view(const void* bytes, std::size_t size, int stride) {
  binary.resize((binary.size() + 3) / 4 * 4, 0);
  json v = {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", size}};
  if (stride > 0) v["byteStride"] = stride;
  const auto* begin = static_cast<const std::uint8_t*>(bytes);
  binary.insert(binary.end(), begin, begin + size);
  root["bufferViews"].push_back(v);
  return static_cast<int>(root["bufferViews"].size()) - 1;
}

int GltfBuilder::accessor(int bufferView, int componentType, std::size_t count, const char* type, bool normalized) {
  json a = {{"bufferView", bufferView}, {"componentType", componentType}, {"count", count}, {"type", type}};
  if (normalized) a["normalized"] = true;
  root["accessors"].push_back(a);
  return static_cast<int>(root["accessors"].size()) - 1;
}

int GltfBuilder::floats(const std::vector<float>& values, const char* type) {
  const std::size_t components = std::string(type) == "SCALAR" ? 1 : static_cast<std::size_t>(type[3] - '0');
  return accessor(view(values), 5126, values.size() / components, type);
}

int GltfBuilder::indices(const std::vector<std::uint16_t>& values) {
  return accessor(view(values), 5123, values.size(), "SCALAR");
}

int GltfBuilder::mesh(const json& primitive) {
  root["meshes"].push_back({{"primitives", json::array({primitive})}});
  return static_cast<int>(root["meshes"].size()) - 1;
}

int GltfBuilder::node(const json& n) {
  root["nodes"].push_back(n);
  const int index = static_cast<int>(root["nodes"].size()) - 1;
  root["scenes"][0]["nodes"].push_back(index);
  return index;
}

int GltfBuilder::material(const json& m) {
  root["materials"].push_back(m);
  return static_cast<int>(root["materials"].size()) - 1;
}

int GltfBuilder::texture(const std::vector<std::uint8_t>& imageFile, const json& sampler) {
  root["images"].push_back({{"bufferView", view(imageFile)}, {"mimeType", "image/png"}});
  json t = {{"source", root["images"].size() - 1}};
  if (!sampler.is_null()) {
    root["samplers"].push_back(sampler);
    t["sampler"] = root["samplers"].size() - 1;
  }
  root["textures"].push_back(t);
  return static_cast<int>(root["textures"].size()) - 1;
}

int GltfBuilder::quad(const json& extraOfPrimitive) {
  json primitive = {{"attributes",
                     {{"POSITION", floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, "VEC3")},
                      {"TEXCOORD_0", floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2")}}},
                    {"indices", indices({0, 1, 2, 0, 2, 3})}};
  primitive.merge_patch(extraOfPrimitive);
  return node({{"mesh", mesh(primitive)}});
}

fs::path GltfBuilder::write(const std::string& name) const {
  json out = root;
  const bool binaryFile = name.ends_with(".glb");
  if (!out.contains("buffers") && !binary.empty()) {
    json buffer = {{"byteLength", binary.size()}};
    if (!binaryFile) buffer["uri"] = "data:application/octet-stream;base64," + base64(binary);
    out["buffers"] = json::array({buffer});
  }
  return binaryFile ? writeFile(name, glb(out.dump(), binary)) : writeFile(name, out.dump());
}

Result<Scene> GltfBuilder::import() const {
  messages.clear();
  Context context;
  context.threads = threads;
  context.onProgress = onProgress;
  isToldBare = false;
  context.onMessage = [this](Severity, std::string_view text) {
    if (text.find("% of the surface has no material") != std::string_view::npos) {
      isToldBare = true;
    } else {
      messages.emplace_back(text);
    }
  };
  return importGltf(write(), context);
}

}  // namespace relume::testing
