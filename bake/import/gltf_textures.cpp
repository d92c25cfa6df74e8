// SPDX-License-Identifier: MIT
// See gltf_textures.h.
#include "bake/import/gltf_textures.h"

#include "bake/base/memory_budget.h"
#include "bake/import/read_images.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

namespace relume {
namespace {

constexpr int kNearest = 9728, kClampToEdge = 33071, kMirroredRepeat = 33648;

Wrap toWrap(int wrap) {
  if (wrap == kClampToEdge) return Wrap::clamp;
  return wrap == kMirroredRepeat ? Wrap::mirror : Wrap::repeat;
}

// T R S of KHR_texture_transform: scale, then rotate (counter-clockwise as the image is seen), then offset.
std::array<float, 6> foldTransform(const tinygltf::Value& extension) {
  const auto pair = [&](const char* name, int i, double fallback) {
    return extension.Has(name) ? extension.Get(name).Get(i).GetNumberAsDouble() : fallback;
  };
  const double sx = pair("scale", 0, 1.0), sy = pair("scale", 1, 1.0);
  const double rotation = numberOr(extension, "rotation", 0.0);
  const double c = std::cos(rotation), s = std::sin(rotation);
  return {toFloat(sx * c),  toFloat(sy * s), toFloat(pair("offset", 0, 0.0)),
          toFloat(-sx * s), toFloat(sy * c), toFloat(pair("offset", 1, 0.0))};
}

// Whether the file is of a format that glTF has by an extension alone, where the texture should say so.
Status checkFormat(std::span<const std::uint8_t> file, const std::string& where) {
  using namespace std::string_view_literals;
  struct Format {
    std::string_view beginning;  // * = any byte
    const char *name, *extension;
  };
  constexpr Format kFormats[] = {{"RIFF****WEBP", "WebP", "EXT_texture_webp"},
                                 {"\0\0\0*ftypavi"sv, "AVIF", "EXT_texture_avif"},
                                 {"\xABKTX 20", "KTX2", "KHR_texture_basisu"},
                                 {"DDS ", "DDS", "MSFT_texture_dds"}};
  for (const Format& format : kFormats) {
    const std::string_view sign = format.beginning;
    const auto fits = [](char c, std::uint8_t byte) { return c == '*' || static_cast<std::uint8_t>(c) == byte; };
    if (file.size() < sign.size() || !std::equal(sign.begin(), sign.end(), file.begin(), fits)) continue;
    return Error{ErrorCode::unsupported,
                 where + ": is " + format.name + ", not PNG or JPEG" + imageRemedy(format.extension)};
  }
  return done();
}

}  // namespace

float toFloat(double value) {
  constexpr double kMax = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -kMax, kMax));
}

tinygltf::Value transformOf(const tinygltf::ExtensionMap& extensions) {
  const auto it = extensions.find("KHR_texture_transform");
  return it == extensions.end() ? tinygltf::Value() : it->second;
}

std::string materialPath(const tinygltf::Material& material, int index) {
  return jsonPath("materials", index) + (material.name.empty() ? "" : " '" + material.name + "'");
}

const tinygltf::Value* extensionOf(const tinygltf::Material& material, const char* name) {
  const auto it = material.extensions.find(name);
  return it == material.extensions.end() ? nullptr : &it->second;
}

Result<TextureSlot> readSlot(const GltfDocument& document, int texture, int texcoord, const tinygltf::Value& transform,
                             const std::string& where, Context& context) {
  TextureSlot out;
  if (texture < 0) return out;
  const auto& model = document.model;
  if (static_cast<std::size_t>(texture) >= model.textures.size())
    return document.invalid(
        where, jsonPath("textures", texture) + " does not exist, there are " + std::to_string(model.textures.size()));
  const tinygltf::Texture& t = model.textures[static_cast<std::size_t>(texture)];
  if (t.source < 0) {
    if (t.extensions.empty()) {
      context.message(Severity::warning,
                      document.at(where + ": " + jsonPath("textures", texture) +
                                  " has no image, so its factor alone is used; give the texture a source, or "
                                  "take it off the material"));
      return out;
    }
    return Error{ErrorCode::unsupported,
                 document.at(where + ": " + jsonPath("textures", texture) + " has no PNG or JPEG image, only one for " +
                             t.extensions.begin()->first + imageRemedy(t.extensions.begin()->first))};
  }
  if (t.sampler >= 0) {
    const tinygltf::Sampler& sampler = model.samplers[static_cast<std::size_t>(t.sampler)];
    out.ref.wrapU = toWrap(sampler.wrapS);
    out.ref.wrapV = toWrap(sampler.wrapT);
    out.ref.nearest = sampler.magFilter == kNearest;
  }
  out.image = t.source;
  out.set = texcoord;
  if (transform.IsObject()) {
    out.ref.transform = foldTransform(transform);
    out.set = indexOr(transform, "texCoord", texcoord);
  }
  return out;
}

Result<Image> readImage(GltfDocument& document, std::size_t index, std::vector<std::uint8_t>& fileBytes,
                        std::span<const std::uint8_t>& bytes) {
  const GltfDocument::ImageSource& source = document.images[index];
  const std::string where = jsonPath("images", static_cast<int>(index));
  Image image;
  image.name = !source.name.empty() ? source.name : "image" + std::to_string(index);
  if (source.bufferView >= 0) {
    const auto view = document.viewBytes(source.bufferView, where);
    if (!view) return view.error();
    bytes = *view;
    if (Status status = checkFormat(bytes, document.at(where)); !status) return status.error();
  } else if (!source.uri.empty()) {
    // Look at a file's beginning and size before the whole of it is read.
    auto beginning = readUri(source.uri, document.folder, document.at(where), document.files, {0, kImageBeginning});
    if (!beginning) return beginning.error();
    if (Status status = checkFormat(beginning->bytes, document.at(where)); !status) return status.error();
    if (Status status = checkImageFile(beginning->bytes, beginning->fileBytes, document.at(where)); !status)
      return status.error();
    if (beginning->bytes.size() < beginning->fileBytes) {
      beginning = readUri(source.uri, document.folder, document.at(where), document.files);
      if (!beginning) return beginning.error();
    }
    fileBytes = std::move(beginning->bytes);
    bytes = fileBytes;
  } else {
    return document.invalid(where, "neither uri nor bufferView");
  }
  return image;
}

// Four bytes a texel, a third of that for the mip levels.
Status reserveTexels(std::uint64_t texels, std::uint64_t largest, std::size_t images, Context& context) {
  if (images == 0) return done();
  const double needed = 16.0 / 3.0 * static_cast<double>(texels) + 4.0 * static_cast<double>(largest);
  return reserveMemory(context, "import", needed,
                       std::to_string(texels) + " texels of " + std::to_string(images) + " images",
                       "use smaller images");
}

}  // namespace relume
