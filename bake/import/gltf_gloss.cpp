// SPDX-License-Identifier: MIT
// What pictures of glossy surfaces need of the materials beside importMaterials(): metalness, roughness and normal
// maps, glTF 2.0 Section 3.9. Bakes do without. So nothing here is an error: what cannot be read is left out with a
// warning.
#include "bake/import/gltf_import.h"
#include "bake/import/gltf_textures.h"

#include "bake/base/parallel.h"
#include "bake/import/read_images.h"
#include "formats/decimal.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <span>

namespace relume {
namespace {

class GlossReader {
 public:
  GlossReader(const GltfDocument& document, Context& context) : document_(document), context_(context) {}

  // A factor of 0..1.
  float share(double value, const char* name, const std::string& where) {
    constexpr double kRounding = 1e-3;  // of exporters
    if (!(value >= -kRounding && value <= 1.0 + kRounding))
      warn(where + "." + name + " is " + decimalGeneral(value, 6) + ", outside 0 to 1; " +
           (std::isfinite(value) ? "clamped" : "taken for 1"));
    return std::isfinite(value) ? static_cast<float>(std::clamp(value, 0.0, 1.0)) : 1.0f;
  }

  // The slot of a texture, its coordinates among the two sets that the mesh has.
  TextureSlot slot(int texture, int texcoord, const tinygltf::ExtensionMap& extensions, const UvSets& sets,
                   const std::string& where) {
    const Result<TextureSlot> read = readSlot(document_, texture, texcoord, transformOf(extensions), where, context_);
    if (!read) {
      context_.message(Severity::warning, read.error().message + "; it is left out of glossy pictures");
      return {};
    }
    TextureSlot slot = *read;
    if (slot.image < 0) return slot;
    if (slot.set != sets[0] && slot.set != sets[1]) {
      warn(where + " uses TEXCOORD_" + std::to_string(slot.set) +
           " beside others, so it is left out of glossy pictures; bring the material's textures to TEXCOORD_0 and "
           "TEXCOORD_1");
      return {};
    }
    slot.ref.texcoord = slot.set == sets[1] ? 1u : 0u;
    return slot;
  }

  void warn(const std::string& what) { context_.message(Severity::warning, document_.at(what)); }

 private:
  const GltfDocument& document_;
  Context& context_;
};

struct GlossDraft {
  MaterialGloss gloss;
  TextureSlot texture, normal;
};

GlossDraft draftGloss(const tinygltf::Material& source, int index, const UvSets& sets, GlossReader& reader) {
  const std::string where = materialPath(source, index);
  GlossDraft draft;
  if (const tinygltf::Value* older = extensionOf(source, "KHR_materials_pbrSpecularGlossiness")) {
    // The older workflow has no metals: its diffuse colour is what the surface scatters.
    draft.gloss.metalness = 0.0f;
    draft.gloss.roughness = 1.0f - reader.share(numberOr(*older, "glossinessFactor", 1.0), "glossinessFactor", where);
  } else {
    const tinygltf::PbrMetallicRoughness& rough = source.pbrMetallicRoughness;
    draft.gloss.metalness = reader.share(rough.metallicFactor, "metallicFactor", where);
    draft.gloss.roughness = reader.share(rough.roughnessFactor, "roughnessFactor", where);
    const tinygltf::TextureInfo& info = rough.metallicRoughnessTexture;
    draft.texture = reader.slot(info.index, info.texCoord, info.extensions, sets, where + ".metallicRoughnessTexture");
  }
  const tinygltf::NormalTextureInfo& info = source.normalTexture;
  draft.normal = reader.slot(info.index, info.texCoord, info.extensions, sets, where + ".normalTexture");
  constexpr double kMaxScale = 1e3;
  if (std::abs(info.scale) <= kMaxScale) {
    draft.gloss.normalScale = static_cast<float>(info.scale);
  } else {
    reader.warn(where + ".normalTexture.scale is " + decimalGeneral(info.scale, 6) + ", beyond 1000; taken for 1");
  }
  return draft;
}

// Append the images as numbers, each once; returns the scene's image of a glTF image, without those that cannot be
// read.
Result<std::map<int, std::uint32_t>> importNumbers(GltfDocument& document, const std::vector<int>& wanted, Scene& scene,
                                                   Context& context) {
  struct Job {
    int source = 0;
    Image image;
    std::vector<std::uint8_t> owned;
    std::span<const std::uint8_t> bytes;
    std::optional<Error> error;
  };
  const auto whereIs = [&](int image) { return document.at(jsonPath("images", image)); };
  std::vector<Job> jobs;
  std::uint64_t texels = 0, largest = 0;
  for (const int source : wanted) {
    Job job;
    job.source = source;
    Result<Image> image = readImage(document, static_cast<std::size_t>(source), job.owned, job.bytes);
    const Result<ImageSize> size = image ? peekImage(job.bytes, whereIs(source)) : Result<ImageSize>(image.error());
    if (!size) {
      job.error = size.error();
    } else {
      job.image = std::move(*image);
      const std::uint64_t count = std::uint64_t{size->width} * size->height;
      texels += count;
      largest = std::max(largest, count);
    }
    jobs.push_back(std::move(job));
  }
  if (Status reserved = reserveTexels(texels, largest, jobs.size(), context); !reserved)
    return Error{reserved.error().code, document.at(reserved.error().message)};

  parallelChunks(context, "read images", jobs.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (jobs[i].error) continue;
      Result<Image> decoded = decodeImage(jobs[i].bytes, whereIs(jobs[i].source));
      if (!decoded) {
        jobs[i].error = decoded.error();
        continue;
      }
      jobs[i].image.levels = std::move(decoded->levels);
      jobs[i].image.isColor = false;
      buildMipLevels(jobs[i].image, false);
    }
  });
  if (context.cancelled()) return cancelledError();

  std::map<int, std::uint32_t> number;
  for (Job& job : jobs) {
    if (job.error) {
      if (job.error->code == ErrorCode::failed) return *job.error;
      context.message(Severity::warning,
                      job.error->message + "; its roughness, metalness or normals are left out of glossy pictures");
      continue;
    }
    number[job.source] = static_cast<std::uint32_t>(scene.images.size());
    scene.images.push_back(std::move(job.image));
  }
  return number;
}

}  // namespace

Status importGloss(GltfDocument& document, const std::vector<UvSets>& uvSets, Scene& scene, Context& context) {
  GlossReader reader(document, context);
  std::vector<GlossDraft> drafts;
  std::vector<int> wanted;
  for (std::size_t i = 0; i < document.model.materials.size(); ++i) {
    drafts.push_back(draftGloss(document.model.materials[i], static_cast<int>(i), uvSets[i], reader));
    for (const TextureSlot* slot : {&drafts.back().texture, &drafts.back().normal}) {
      if (slot->image >= 0) wanted.push_back(slot->image);
    }
  }
  std::sort(wanted.begin(), wanted.end());
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  const auto number = importNumbers(document, wanted, scene, context);
  if (!number) return number.error();

  for (std::size_t i = 0; i < drafts.size(); ++i) {
    const auto resolve = [&](const TextureSlot& slot, TextureRef& to) {
      const auto found = number->find(slot.image);
      if (found == number->end()) return;
      to = slot.ref;
      to.image = found->second;
    };
    resolve(drafts[i].texture, drafts[i].gloss.texture);
    resolve(drafts[i].normal, drafts[i].gloss.normalTexture);
    scene.materials[i].gloss = drafts[i].gloss;
  }
  return done();
}

}  // namespace relume
