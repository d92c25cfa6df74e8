// SPDX-License-Identifier: MIT
// Materials as the baker needs them: diffuse albedo, emission, alpha test. Only images these use are read. An image
// that is missing or broken is an error: a bake with a wrong albedo would look right until someone sees it.
#include "bake/import/gltf_import.h"

#include "bake/base/memory_budget.h"
#include "bake/base/parallel.h"
#include "bake/import/gltf_file.h"
#include "bake/import/read_images.h"

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace relume {
namespace {

constexpr int kNearest = 9728, kClampToEdge = 33071, kMirroredRepeat = 33648;

float toFloat(double value) {
  constexpr double kMax = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -kMax, kMax));
}

Wrap toWrap(int wrap) {
  if (wrap == kClampToEdge) return Wrap::clamp;
  return wrap == kMirroredRepeat ? Wrap::mirror : Wrap::repeat;
}

// A texture slot of a glTF material before images are numbered and coordinates assigned.
struct Slot {
  int image = -1;  // glTF image
  int set = 0;     // TEXCOORD_n
  TextureRef ref;
};

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

class MaterialReader {
 public:
  MaterialReader(const GltfDocument& document, Context& context) : document_(document), context_(context) {}

  Result<Slot> slot(int texture, int texcoord, const tinygltf::ExtensionMap& extensions, const std::string& where) {
    tinygltf::Value transform;
    if (const auto it = extensions.find("KHR_texture_transform"); it != extensions.end()) transform = it->second;
    return slot(texture, texcoord, transform, where);
  }

  void warn(const std::string& what) { context_.message(Severity::warning, document_.at(what)); }

  // The slot of an extension's textureInfo, which tinygltf keeps as a plain value.
  Result<Slot> slot(const tinygltf::Value& info, const std::string& where) {
    tinygltf::Value transform;
    if (info.Has("extensions") && info.Get("extensions").Has("KHR_texture_transform"))
      transform = info.Get("extensions").Get("KHR_texture_transform");
    return slot(indexOr(info, "index", -1), indexOr(info, "texCoord", 0), transform, where);
  }

  // extras.relume.drivable.
  Result<bool> drivable(const tinygltf::Material& material, const std::string& where) const {
    if (!material.extras.IsObject() || !material.extras.Has("relume")) return false;
    const tinygltf::Value& relume = material.extras.Get("relume");
    const std::string path = where + ".extras.relume";
    if (!relume.IsObject()) return document_.invalid(path, "expected an object");
    if (!relume.Has("drivable")) return false;
    const tinygltf::Value& drivable = relume.Get("drivable");
    const double number = numberOr(relume, "drivable", -1.0);  // Blender 3.4 writes false and true as 0 and 1
    if (!drivable.IsBool() && number != 0.0 && number != 1.0)
      return document_.invalid(path + ".drivable", "expected true or false");
    return drivable.IsBool() ? drivable.Get<bool>() : number == 1.0;
  }

 private:
  Result<Slot> slot(int texture, int texcoord, const tinygltf::Value& transform, const std::string& where) {
    Slot out;
    if (texture < 0) return out;
    const auto& model = document_.model;
    if (static_cast<std::size_t>(texture) >= model.textures.size())
      return document_.invalid(
          where, jsonPath("textures", texture) + " does not exist, there are " + std::to_string(model.textures.size()));
    const tinygltf::Texture& t = model.textures[static_cast<std::size_t>(texture)];
    if (t.source < 0) {
      if (t.extensions.empty()) {
        context_.message(Severity::warning,
                         document_.at(where + ": " + jsonPath("textures", texture) +
                                      " has no image, so its factor alone is used; give the texture a source, or "
                                      "take it off the material"));
        return out;
      }
      return Error{ErrorCode::unsupported,
                   document_.at(where + ": " + jsonPath("textures", texture) +
                                " has no PNG or JPEG image, only one for " + t.extensions.begin()->first)};
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

  const GltfDocument& document_;
  Context& context_;
};

struct MaterialDraft {
  Material material;
  Slot albedo, emission;
};

const tinygltf::Value* extensionOf(const tinygltf::Material& material, const char* name) {
  const auto it = material.extensions.find(name);
  return it == material.extensions.end() ? nullptr : &it->second;
}

glm::vec3 toVec3(const std::vector<double>& v) { return {toFloat(v[0]), toFloat(v[1]), toFloat(v[2])}; }

Result<MaterialDraft> draftMaterial(const tinygltf::Material& source, int index, MaterialReader& reader) {
  const std::string where = jsonPath("materials", index) + (source.name.empty() ? "" : " '" + source.name + "'");
  MaterialDraft draft;
  Material& m = draft.material;
  m.name = source.name.empty() ? "material" + std::to_string(index) : source.name;
  m.doubleSided = source.doubleSided;
  m.alphaMode = source.alphaMode == "OPAQUE" ? AlphaMode::opaque : AlphaMode::mask;
  m.alphaCutoff = source.alphaMode == "MASK" ? toFloat(source.alphaCutoff) : 0.5f;

  // Base colour, or the diffuse colour of the older workflow.
  const tinygltf::Value* glossiness = extensionOf(source, "KHR_materials_pbrSpecularGlossiness");
  std::vector<double> factor = source.pbrMetallicRoughness.baseColorFactor;
  Result<Slot> albedo = Slot{};
  if (glossiness) {
    factor = {1.0, 1.0, 1.0, 1.0};
    for (int i = 0; glossiness->Has("diffuseFactor") && i < 4; ++i)
      factor[static_cast<std::size_t>(i)] = glossiness->Get("diffuseFactor").Get(i).GetNumberAsDouble();
    if (glossiness->Has("diffuseTexture")) albedo = reader.slot(glossiness->Get("diffuseTexture"), where);
  } else {
    const tinygltf::TextureInfo& info = source.pbrMetallicRoughness.baseColorTexture;
    albedo = reader.slot(info.index, info.texCoord, info.extensions, where + ".baseColorTexture");
  }
  if (!albedo) return albedo.error();
  draft.albedo = *albedo;
  m.albedo = glm::clamp(toVec3(factor), 0.0f, 1.0f);
  m.alpha = std::clamp(toFloat(factor[3]), 0.0f, 1.0f);
  constexpr float kRounding = 1e-3f;  // of exporters
  if (glm::any(glm::greaterThan(glm::abs(m.albedo - toVec3(factor)), glm::vec3(kRounding))) ||
      std::abs(m.alpha - toFloat(factor[3])) > kRounding)
    reader.warn(where + ": base colour or alpha is outside 0 to 1; clamped");

  const tinygltf::Value* strength = extensionOf(source, "KHR_materials_emissive_strength");
  const double scale = strength ? numberOr(*strength, "emissiveStrength", 1.0) : 1.0;
  for (int i = 0; i < 3; ++i)
    m.emission[i] = std::max(toFloat(source.emissiveFactor[static_cast<std::size_t>(i)] * scale), 0.0f);
  if (scale < 0.0 || *std::min_element(source.emissiveFactor.begin(), source.emissiveFactor.end()) < 0.0)
    reader.warn(where + ": emissive factor or strength is negative; taken for 0");
  const tinygltf::TextureInfo& info = source.emissiveTexture;
  const Result<Slot> emission = reader.slot(info.index, info.texCoord, info.extensions, where + ".emissiveTexture");
  if (!emission) return emission.error();
  const Result<bool> drivable = reader.drivable(source, where);
  if (!drivable) return drivable.error();
  m.drivable = *drivable;
  if (m.emission != glm::vec3(0.0f) || m.drivable) draft.emission = *emission;
  return draft;
}

// Mesh::uv holds two sets: those numbered 0 and 1, unless a texture wants another and none wants set 0.
UvSets assignSets(MaterialDraft& draft, const GltfDocument& document, Context& context) {
  UvSets sets{0, 1};
  const auto uses = [&](int set) {
    return (draft.albedo.image >= 0 && draft.albedo.set == set) ||
           (draft.emission.image >= 0 && draft.emission.set == set);
  };
  for (Slot* slot : {&draft.albedo, &draft.emission}) {
    if (slot->image < 0) continue;
    if (slot->set > 1 && slot->set != sets[0]) {
      if (uses(0) || sets[0] != 0) {
        context.message(
            Severity::warning,
            document.at("material '" + draft.material.name + "' uses TEXCOORD_" + std::to_string(slot->set) +
                        " beside others, so that texture is left out; bring its textures to two sets of texture "
                        "coordinates, TEXCOORD_0 and TEXCOORD_1"));
        slot->image = -1;
        continue;
      }
      sets[0] = slot->set;
    }
    slot->ref.texcoord = slot->set == 1 ? 1u : 0u;
  }
  return sets;
}

Status checkTextures(const GltfDocument& document) {
  const auto outOfRange = [](int index, std::size_t count) {
    return index >= 0 && static_cast<std::size_t>(index) >= count;
  };
  for (std::size_t i = 0; i < document.model.textures.size(); ++i) {
    const tinygltf::Texture& t = document.model.textures[i];
    const std::string where = jsonPath("textures", static_cast<int>(i));
    if (outOfRange(t.source, document.images.size()))
      return document.invalid(
          where, jsonPath("images", t.source) + " does not exist, there are " + std::to_string(document.images.size()));
    if (outOfRange(t.sampler, document.model.samplers.size()))
      return document.invalid(where, jsonPath("samplers", t.sampler) + " does not exist, there are " +
                                         std::to_string(document.model.samplers.size()));
  }
  return done();
}

// How a glTF image is used: as a mask's colour its mip levels weigh colour by alpha, else they do not. One that is used
// both ways becomes two images of the scene, so that no material changes what another one looks like.
struct ImageUse {
  bool plain = false, masked = false;
};
struct ImageNumbers {
  std::uint32_t plain = kNone, masked = kNone;  // in Scene::images
};

bool weighsByAlpha(const MaterialDraft& draft, const Slot& slot) {
  return &slot == &draft.albedo && draft.material.alphaMode == AlphaMode::mask;
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
  } else if (!source.uri.empty()) {
    // Look at a file's beginning and size before the whole of it is read.
    auto beginning = readUri(source.uri, document.folder, document.at(where), document.files, {0, kImageBeginning});
    if (!beginning) return beginning.error();
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

// Four bytes a texel, a third of that for the mip levels; an image that is decoded is held twice for a while.
Status reserveTexels(std::uint64_t texels, std::uint64_t largest, std::size_t images, Context& context) {
  if (images == 0) return done();
  const double needed = 16.0 / 3.0 * static_cast<double>(texels) + 4.0 * static_cast<double>(largest);
  return reserveMemory(context, "import", needed,
                       std::to_string(texels) + " texels of " + std::to_string(images) + " images",
                       "use smaller images");
}

// Read the used images in order, then decode them in parallel. `number` maps glTF images to Scene::images.
Status importImages(GltfDocument& document, const std::vector<ImageUse>& uses, Scene& scene,
                    std::vector<ImageNumbers>& number, Context& context) {
  std::vector<std::size_t> source;
  std::vector<std::vector<std::uint8_t>> owned;
  std::vector<std::span<const std::uint8_t>> bytes;
  number.assign(uses.size(), {});
  for (std::size_t i = 0; i < uses.size(); ++i) {
    if (!uses[i].plain && !uses[i].masked) continue;
    owned.emplace_back();
    bytes.emplace_back();
    Result<Image> image = readImage(document, i, owned.back(), bytes.back());
    if (!image) return image.error();
    (uses[i].plain ? number[i].plain : number[i].masked) = static_cast<std::uint32_t>(scene.images.size());
    scene.images.push_back(std::move(*image));
    source.push_back(i);
  }
  const auto whereIs = [&](std::size_t i) {
    return document.at(jsonPath("images", static_cast<int>(source[i])) + " '" + scene.images[i].name + "'");
  };

  // Views may overlap: together the images cannot hold more than the bytes there are.
  std::uint64_t available = document.dataBytes, claimed = 0, largest = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    available += owned[i].size();
    const Result<ImageSize> size = peekImage(bytes[i], whereIs(i));
    if (!size) return size.error();
    const std::uint64_t texels = static_cast<std::uint64_t>(size->width) * size->height;
    claimed += texels;
    largest = std::max(largest, texels);
  }
  if (claimed > maxPixels(available))
    return document.invalid("images",
                            "claim " + std::to_string(claimed) + " texels in " + std::to_string(available) + " bytes");

  if (Status reserved = reserveTexels(claimed, largest, bytes.size(), context); !reserved)
    return Error{reserved.error().code, document.at(reserved.error().message)};

  std::vector<std::optional<Error>> errors(scene.images.size());
  parallelChunks(context, "read images", scene.images.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Result<Image> decoded = decodeImage(bytes[i], whereIs(i));
      if (!decoded) {
        errors[i] = decoded.error();
        continue;
      }
      scene.images[i].levels = std::move(decoded->levels);
      buildMipLevels(scene.images[i], !uses[source[i]].plain);
    }
  });
  for (const auto& error : errors) {
    if (error) return *error;
  }
  for (std::size_t i = 0; i < uses.size(); ++i) {
    if (!uses[i].plain || !uses[i].masked) continue;
    number[i].masked = static_cast<std::uint32_t>(scene.images.size());
    Image copy = scene.images[number[i].plain];
    buildMipLevels(copy, true);
    scene.images.push_back(std::move(copy));
  }
  return context.cancelled() ? Status(cancelledError()) : done();
}

}  // namespace

Result<std::vector<UvSets>> importMaterials(GltfDocument& document, Scene& scene, Context& context) {
  // Read every material and note which images it uses, and how.
  if (Status status = checkTextures(document); !status) return status.error();
  MaterialReader reader(document, context);
  std::vector<MaterialDraft> drafts;
  std::vector<UvSets> sets;
  std::vector<ImageUse> uses(document.images.size());
  for (std::size_t i = 0; i < document.model.materials.size(); ++i) {
    Result<MaterialDraft> draft = draftMaterial(document.model.materials[i], static_cast<int>(i), reader);
    if (!draft) return draft.error();
    sets.push_back(assignSets(*draft, document, context));
    for (const Slot* slot : {&draft->albedo, &draft->emission}) {
      if (slot->image < 0) continue;
      ImageUse& use = uses[static_cast<std::size_t>(slot->image)];
      (weighsByAlpha(*draft, *slot) ? use.masked : use.plain) = true;
    }
    drafts.push_back(std::move(*draft));
  }

  // Read those images and point the materials to them.
  std::vector<ImageNumbers> number;
  if (Status status = importImages(document, uses, scene, number, context); !status) return status.error();
  for (MaterialDraft& draft : drafts) {
    const auto resolve = [&](const Slot& slot, TextureRef& to) {
      if (slot.image < 0) return;
      to = slot.ref;
      const ImageNumbers& image = number[static_cast<std::size_t>(slot.image)];
      to.image = weighsByAlpha(draft, slot) ? image.masked : image.plain;
    };
    resolve(draft.albedo, draft.material.albedoTexture);
    resolve(draft.emission, draft.material.emissionTexture);
    scene.materials.push_back(std::move(draft.material));
  }
  return sets;
}

}  // namespace relume
