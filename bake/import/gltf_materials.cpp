// SPDX-License-Identifier: MIT
// Materials as the baker needs them: diffuse albedo, emission, alpha test. Only images these use are read. An image
// that is missing or broken is an error: a bake with a wrong albedo would look right until someone sees it.
#include "bake/import/gltf_import.h"

#include "bake/base/memory_budget.h"
#include "bake/base/parallel.h"
#include "bake/import/gltf_textures.h"
#include "bake/import/read_images.h"

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>

namespace relume {
namespace {

// Texture slots, and what else of a material is checked.
class MaterialReader {
 public:
  MaterialReader(const GltfDocument& document, Context& context) : document_(document), context_(context) {}

  Result<TextureSlot> slot(const tinygltf::TextureInfo& info, const std::string& where) {
    return readSlot(document_, info.index, info.texCoord, transformOf(info.extensions), where, context_);
  }

  void warn(const std::string& what) { context_.message(Severity::warning, document_.at(what)); }

  // The slot of an extension's textureInfo, which tinygltf keeps as a plain value.
  Result<TextureSlot> slot(const tinygltf::Value& info, const std::string& where) {
    tinygltf::Value transform;
    if (info.Has("extensions") && info.Get("extensions").Has("KHR_texture_transform"))
      transform = info.Get("extensions").Get("KHR_texture_transform");
    return readSlot(document_, indexOr(info, "index", -1), indexOr(info, "texCoord", 0), transform, where, context_);
  }

  // extras.relume.drivable.
  Result<bool> drivable(const tinygltf::Material& material, const std::string& where) {
    if (!material.extras.IsObject() || !material.extras.Has("relume")) return false;
    const tinygltf::Value& relume = material.extras.Get("relume");
    const std::string path = where + ".extras.relume";
    if (!relume.IsObject()) return document_.invalid(path, "expected an object");
    warnOfUnknownMembers(document_, relume, path, {"drivable"}, unknownMembers_, context_);
    if (!relume.Has("drivable")) return false;
    const tinygltf::Value& drivable = relume.Get("drivable");
    const double number = numberOr(relume, "drivable", -1.0);  // Blender 3.4 writes false and true as 0 and 1
    if (!drivable.IsBool() && number != 0.0 && number != 1.0)
      return document_.invalid(path + ".drivable", "expected true or false");
    return drivable.IsBool() ? drivable.Get<bool>() : number == 1.0;
  }

 private:
  const GltfDocument& document_;
  Context& context_;
  std::set<std::string> unknownMembers_;  // of extras.relume
};

struct MaterialDraft {
  Material material;
  TextureSlot albedo, emission;
};

glm::vec3 toVec3(const std::vector<double>& v) { return {toFloat(v[0]), toFloat(v[1]), toFloat(v[2])}; }

Result<MaterialDraft> draftMaterial(const tinygltf::Material& source, int index, MaterialReader& reader) {
  const std::string where = materialPath(source, index);
  MaterialDraft draft;
  Material& m = draft.material;
  m.name = source.name.empty() ? "material" + std::to_string(index) : source.name;
  m.doubleSided = source.doubleSided;
  m.alphaMode = source.alphaMode == "OPAQUE" ? AlphaMode::opaque : AlphaMode::mask;
  m.alphaCutoff = source.alphaMode == "MASK" ? toFloat(source.alphaCutoff) : 0.5f;

  // Base colour, or the diffuse colour of the older workflow.
  const tinygltf::Value* glossiness = extensionOf(source, "KHR_materials_pbrSpecularGlossiness");
  std::vector<double> factor = source.pbrMetallicRoughness.baseColorFactor;
  Result<TextureSlot> albedo = TextureSlot{};
  if (glossiness) {
    factor = {1.0, 1.0, 1.0, 1.0};
    for (int i = 0; glossiness->Has("diffuseFactor") && i < 4; ++i)
      factor[static_cast<std::size_t>(i)] = glossiness->Get("diffuseFactor").Get(i).GetNumberAsDouble();
    if (glossiness->Has("diffuseTexture")) albedo = reader.slot(glossiness->Get("diffuseTexture"), where);
  } else {
    const tinygltf::TextureInfo& info = source.pbrMetallicRoughness.baseColorTexture;
    albedo = reader.slot(info, where + ".baseColorTexture");
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
  const Result<TextureSlot> emission = reader.slot(info, where + ".emissiveTexture");
  if (!emission) return emission.error();
  const Result<bool> drivable = reader.drivable(source, where);
  if (!drivable) return drivable.error();
  m.drivable = *drivable;
  if (m.emission != glm::vec3(0.0f) || m.drivable) draft.emission = *emission;
  return draft;
}

// Mesh::uv holds two sets: 0 and 1, but where a texture wants another, that takes the place of one that is not used.
// Emission without a texture may be driven by images, which lie by set 0.
UvSets assignSets(MaterialDraft& draft) {
  UvSets sets{0, 1};
  const bool isDriven = draft.material.drivable || draft.material.emission != glm::vec3(0.0f);
  const auto uses = [&](int set) {
    return (draft.albedo.image >= 0 && draft.albedo.set == set) ||
           (draft.emission.image >= 0 && draft.emission.set == set) ||
           (isDriven && draft.emission.image < 0 && set == 0);
  };
  for (TextureSlot* slot : {&draft.albedo, &draft.emission}) {
    if (slot->image < 0) continue;
    auto at = std::find(sets.begin(), sets.end(), slot->set);
    if (at == sets.end()) {
      at = uses(sets[0]) ? sets.begin() + 1 : sets.begin();
      *at = slot->set;
    }
    slot->ref.texcoord = static_cast<std::uint32_t>(at - sets.begin());
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

bool weighsByAlpha(const MaterialDraft& draft, const TextureSlot& slot) {
  return &slot == &draft.albedo && draft.material.alphaMode == AlphaMode::mask;
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
  std::uint64_t available = document.dataBytes, claimed = 0, twice = 0, largest = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    available += owned[i].size();
    const Result<ImageSize> size = peekImage(bytes[i], whereIs(i));
    if (!size) return size.error();
    const std::uint64_t texels = static_cast<std::uint64_t>(size->width) * size->height;
    claimed += texels;
    if (uses[source[i]].plain && uses[source[i]].masked) twice += texels;
    largest = std::max(largest, texels);
  }
  if (claimed > maxPixels(available))
    return document.invalid("images",
                            "claim " + std::to_string(claimed) + " texels in " + std::to_string(available) + " bytes");

  if (Status reserved = reserveTexels(claimed + twice, largest, bytes.size(), context); !reserved)
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
    sets.push_back(assignSets(*draft));
    for (const TextureSlot* slot : {&draft->albedo, &draft->emission}) {
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
    const auto resolve = [&](const TextureSlot& slot, TextureRef& to) {
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
