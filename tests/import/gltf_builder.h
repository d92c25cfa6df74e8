// SPDX-License-Identifier: MIT
// Small glTF files for tests, built in memory and written to a folder of the test's own.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/scene.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace relume::testing {

using nlohmann::json;

// [m] Corners of a square in z = 0.
inline const std::vector<float> kSquare = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};

// An empty folder that belongs to the running test.
std::filesystem::path testFolder();

// A PNG of width x height RGBA texels.
std::vector<std::uint8_t> png(std::uint32_t width, std::uint32_t height, const std::vector<std::uint8_t>& rgba);

std::string base64(const std::vector<std::uint8_t>& bytes);

class GltfBuilder {
 public:
  GltfBuilder();

  // Append bytes to the buffer, 4-aligned; returns the buffer view.
  int view(const void* bytes, std::size_t size, int stride = 0);
  template <class T>
  int view(const std::vector<T>& values, int stride = 0) {
    return view(values.data(), values.size() * sizeof(T), stride);
  }
  // An accessor of a view.
  int accessor(int view, int componentType, std::size_t count, const char* type, bool normalized = false);
  int floats(const std::vector<float>& values, const char* type);
  int indices(const std::vector<std::uint16_t>& values);

  int mesh(const json& primitive);
  int node(const json& node);  // listed in scene 0
  int material(const json& material);
  int texture(const std::vector<std::uint8_t>& imageFile, const json& sampler = nullptr);
  // A quad [0,1]² in z = 0 that faces +Z, uv = (x, 1 - y), placed by a node; returns the node.
  int quad(const json& extraOfPrimitive = json::object());

  std::filesystem::path write(const std::string& name = "test.glb") const;  // .glb, or .gltf with a data URI
  Result<Scene> import() const;

  json root;
  std::vector<std::uint8_t> binary;
  int threads = 0;                                           // of import()
  std::function<bool(std::string_view, double)> onProgress;  // of import()
  mutable std::vector<std::string> messages;                 // of the last import, but for the next
  mutable bool isToldBare = false;                           // that it has no materials, as most levels of tests
};

// Write bytes or text to a file of the test's folder.
std::filesystem::path writeFile(const std::string& name, const std::vector<std::uint8_t>& bytes);
std::filesystem::path writeFile(const std::string& name, const std::string& text);
std::vector<std::uint8_t> glb(const std::string& jsonText, const std::vector<std::uint8_t>& binary);

inline Result<Scene> importFile(const std::filesystem::path& path) {
  Context context;
  return importGltf(path, context);
}

}  // namespace relume::testing
