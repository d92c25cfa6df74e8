// SPDX-License-Identifier: MIT
// See drive_scene.h.
#include "tools/render/drive_scene.h"

#include "bake/base/memory_budget.h"
#include "formats/color.h"
#include "formats/limits.h"
#include "runtime/shared/image_pyramid.h"
#include "tools/base/parse_numbers.h"
#include "tools/images/read_picture.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <optional>

namespace relume {
namespace {

Error emissionError(std::string message) { return {ErrorCode::usage, "--emission: " + std::move(message)}; }

// Name and value of a text; both empty where it has no '='.
std::pair<std::string, std::string> halves(const std::string& text) {
  const std::size_t at = text.find('=');
  if (at == std::string::npos) return {};
  return {text.substr(0, at), text.substr(at + 1)};
}

bool namesFile(const std::string& value) { return value.ends_with(".exr") || value.ends_with(".png"); }

Status readImage(const std::string& path, const MemoryCheck& fits, DrivenMaterial& driven) {
  Result<PictureFile> file = readPicture(path, "", fits);
  if (!file) return file.error();
  driven.width = file->picture.width;
  driven.height = file->picture.height;
  driven.image = std::move(file->picture.pixels);
  if (driven.width > kMaxDrivenSide || driven.height > kMaxDrivenSide) {
    return emissionError("\"" + path + "\" has " + std::to_string(driven.width) + " x " +
                         std::to_string(driven.height) + " texels, at most " + std::to_string(kMaxDrivenSide) +
                         " along a side expected");
  }
  for (std::size_t i = 0; i < driven.image.size(); ++i) {
    if (isRadiance(driven.image[i])) continue;
    return Error{ErrorCode::invalidFile, "\"" + path + "\": texel " + std::to_string(i % driven.width) + ", " +
                                             std::to_string(i / driven.width) +
                                             " is negative, not finite or above 1e9 W/m²/sr"};
  }
  return done();
}

// The image as one of the scene's, divided by `unit`.
Image sceneImage(const DrivenMaterial& driven, float unit) {
  ImagePyramid pyramid(driven.width, driven.height, std::pmr::new_delete_resource());
  pyramid.set(driven.image, {});
  Image image;
  image.name = driven.name;
  for (std::uint32_t level = 0; level < pyramid.levels(); ++level) {
    Image::Level l;
    l.width = pyramid.size(level).x;
    l.height = pyramid.size(level).y;
    for (const glm::vec3& texel : pyramid.texels(level)) l.linear.push_back(texel / unit);
    image.levels.push_back(std::move(l));
  }
  return image;
}

std::string drivableNames(const Scene& scene) {
  std::string names;
  for (const Material& m : scene.materials) {
    if (isDrivable(m)) names += (names.empty() ? "\"" : ", \"") + m.name + "\"";
  }
  return names.empty() ? "none" : names;
}

Status checkTextured(const Scene& scene, std::uint32_t material) {
  const std::uint32_t set = scene.materials[material].emissionTexture.texcoord;
  for (const Mesh& mesh : scene.meshes) {
    if (mesh.material == material && mesh.uv[set].empty() && !mesh.triangle.empty()) {
      return emissionError(
          "mesh \"" + mesh.name + "\" of material \"" + scene.materials[material].name +
          "\" has no texture coordinates, so that no image can be put on it; give it some, or drive it by "
          "R,G,B");
    }
  }
  return done();
}

Status driveMaterial(Scene& scene, std::uint32_t index, const DrivenMaterial& driven) {
  Material& material = scene.materials[index];
  material.emission = driven.radiance;
  if (driven.image.empty()) {
    material.emissionTexture.image = kNone;
    return done();
  }
  if (Status ok = checkTextured(scene, index); !ok) return ok;
  // The factor says how bright the material is on the whole: by it paths choose among emitters.
  double sum = 0.0;
  for (const glm::vec3& texel : driven.image) sum += static_cast<double>(luminance(texel));
  const float unit = std::max(static_cast<float>(sum / static_cast<double>(driven.image.size())), 1e-20f);
  material.emission = glm::vec3(sum > 0.0 ? unit : 0.0f);
  material.emissionTexture.image = static_cast<std::uint32_t>(scene.images.size());
  material.emissionTexture.nearest = false;
  scene.images.push_back(sceneImage(driven, unit));
  return done();
}

}  // namespace

void addEmissionOption(CLI::App& command, std::vector<std::string>& texts) {
  command
      .add_option("--emission", texts,
                  "light a material in another way, once for each: MATERIAL=R,G,B, its radiance [W/m^2/sr], or "
                  "MATERIAL=FILE, a .png or .exr whose linear values are put where its emissive texture is. A material "
                  "that emits, or has extras.relume.drivable; it shines whether or not --lights has emissive")
      ->type_name("MATERIAL=VALUE")
      ->allow_extra_args(false);
}

std::vector<std::string> emissionFiles(const std::vector<std::string>& texts) {
  std::vector<std::string> files;
  for (const std::string& text : texts) {
    if (namesFile(halves(text).second)) files.push_back(halves(text).second);
  }
  return files;
}

Result<std::vector<DrivenMaterial>> readEmissions(const std::vector<std::string>& texts, Context& context) {
  const MemoryCheck fits = [&context](double bytes, const std::string& what) {
    return reserveMemory(context, "emission", bytes, what, "use a smaller one");
  };
  std::vector<DrivenMaterial> list;
  for (const std::string& text : texts) {
    const auto [name, value] = halves(text);
    DrivenMaterial driven;
    driven.name = name;
    if (std::any_of(list.begin(), list.end(), [&](const DrivenMaterial& d) { return d.name == driven.name; }))
      return emissionError("material \"" + name + "\" appears twice");
    const std::optional<glm::vec3> radiance = threeNumbers(value);
    if (name.empty() || (!radiance && !namesFile(value)) || (radiance && !isRadiance(*radiance))) {
      return emissionError(
          "MATERIAL=R,G,B, three numbers of 0 to 1e9, or MATERIAL=FILE with a name that ends in .exr or .png "
          "expected, \"" +
          text + "\" found");
    }
    if (radiance) {
      driven.radiance = *radiance;
    } else if (Status ok = readImage(value, fits, driven); !ok) {
      return ok.error();
    }
    list.push_back(std::move(driven));
  }
  return list;
}

Status driveScene(Scene& scene, std::span<const DrivenMaterial> driven, bool keepOthers) {
  std::vector<bool> found(driven.size(), false);
  for (std::uint32_t m = 0; m < scene.materials.size(); ++m) {
    Material& material = scene.materials[m];
    const auto mine =
        std::find_if(driven.begin(), driven.end(), [&](const DrivenMaterial& d) { return d.name == material.name; });
    if (mine == driven.end()) {
      if (!keepOthers) material.emission = glm::vec3(0.0f);
      continue;
    }
    if (!isDrivable(material)) continue;
    found[static_cast<std::size_t>(mine - driven.begin())] = true;
    if (Status ok = driveMaterial(scene, m, *mine); !ok) return ok;
  }
  const auto missing = std::find(found.begin(), found.end(), false);
  if (missing == found.end()) return done();
  return emissionError("no material \"" + driven[static_cast<std::size_t>(missing - found.begin())].name +
                       "\" in the scene that emits or has extras.relume.drivable; there are: " + drivableNames(scene));
}

Status checkDriven(const Scene& scene, std::span<const DrivenMaterial> driven, const Emitters& emitters,
                   const std::string& bakeFile) {
  for (const DrivenMaterial& d : driven) {
    const auto isBaked = [&](const Instance& i) { return i.baked() && scene.material(i).name == d.name; };
    if (findMaterial(emitters, d.name) || std::none_of(scene.instances.begin(), scene.instances.end(), isBaked))
      continue;
    return emissionError("\"" + bakeFile + "\" knows nothing of material \"" + d.name +
                         "\" that emits, though baked parts have it: it was not drivable when the level was baked, or "
                         "nothing of it is seen; bake the level again, or leave it out");
  }
  return done();
}

}  // namespace relume
