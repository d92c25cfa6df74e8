// SPDX-License-Identifier: MIT
// See layer_files.h.
#include "tools/cli/layer_files.h"

#include "formats/file_io.h"
#include "tools/base/shown_float.h"
#include "tools/images/image_io.h"
#include "tools/render/drive_scene.h"
#include "tools/render/exposure.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>

namespace relume {
namespace {

// Images of equal size beside each other, from left to right; `width` pixels of `channels` values each.
template <class T>
std::vector<T> joined(const std::vector<std::vector<T>>& images, std::size_t width, std::size_t channels) {
  const std::size_t row = width * channels, rows = images.front().size() / row;
  std::vector<T> wide(images.size() * images.front().size());
  for (std::size_t k = 0; k < images.size(); ++k) {
    for (std::size_t y = 0; y < rows; ++y)
      std::copy_n(images[k].begin() + static_cast<std::ptrdiff_t>(y * row), row,
                  wide.begin() + static_cast<std::ptrdiff_t>((y * images.size() + k) * row));
  }
  return wide;
}

}  // namespace

void addPictureOptions(CLI::App& command, PictureOptions& options) {
  command
      .add_option("--exposure", options.exposure,
                  "stops by which the light of a PNG is brightened, -30..30, or auto: from the picture; above 1 clips")
      ->capture_default_str();
  command.add_flag("--side-by-side", options.sideBySide, "put several AOVs into one image, from left to right");
  command.add_option("-o,--output", options.output, "image to write: .exr (linear, 32-bit) or .png (sRGB)")
      ->type_name("FILE")
      ->required();
  command.add_flag("--force", options.force,
                   "write over files that are something else than an image of that kind, or read-only");
}

std::vector<std::filesystem::path> LayerFiles::paths() const {
  if (!areSeveral()) return {output};
  std::vector<std::filesystem::path> list;
  for (const Aov aov : aovs) {
    std::filesystem::path path(output);
    path.replace_extension("." + aovNames()[static_cast<std::size_t>(aov)] + path.extension().string());
    list.push_back(path);
  }
  return list;
}

CommandFiles filesOf(const PictureOptions& options, const LayerFiles& layers) {
  CommandFiles files;
  files.read("the scene", options.scene);
  files.read("the bake", options.bake);
  files.read("the file of --lights-file", options.view.lightsFile);
  files.read("the file of --sky-map", options.view.skyMap);
  for (const std::string& image : emissionFiles(options.emissions)) files.read("an image of --emission", image);
  for (const auto& path : layers.paths()) files.write("-o", path, imageKind(path));
  files.force = options.force;
  return files;
}

void setView(const View& view, RenderRequest& request) {
  request.camera = view.camera;
  request.width = view.width;
  request.height = view.height;
  request.lights = view.lights;
  request.emissive = view.emissive;
  request.sky = view.sky;
}

Status checkImageName(const std::string& output) {
  const std::string extension = lowerExtension(output);
  if (extension == ".exr" || extension == ".png") return done();
  return Error{ErrorCode::usage, "-o: a name that ends in .exr or .png expected, \"" + output + "\" found"};
}

Result<std::vector<Aov>> aovsByName(const std::vector<std::string>& wanted) {
  std::vector<Aov> aovs;
  const auto& names = aovNames();
  for (const std::string& name : wanted) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      std::string known;
      for (const std::string& n : names) known += (known.empty() ? "" : ", ") + n;
      return Error{ErrorCode::usage, "--aov: \"" + name + "\" found; there are: " + known};
    }
    const auto aov = static_cast<Aov>(found - names.begin());
    if (std::find(aovs.begin(), aovs.end(), aov) != aovs.end())
      return Error{ErrorCode::usage, "--aov: \"" + name + "\" found twice; name each once"};
    aovs.push_back(aov);
  }
  return aovs;
}

Status writeLayers(const RenderedFrame& frame, const LayerFiles& files, const PictureScale& scale,
                   std::vector<std::string>& written) {
  std::vector<std::vector<glm::vec3>> raw;
  std::vector<std::vector<std::uint8_t>> pictures;
  const std::vector<std::filesystem::path> paths = files.paths();
  for (const Aov aov : files.aovs) {
    if (files.isPng())
      pictures.push_back(drawPicture(frame, aov, scale));
    else
      raw.push_back(composeAov(frame, aov));
  }
  std::uint32_t width = frame.width;
  if (!files.areSeveral()) {
    width *= static_cast<std::uint32_t>(files.aovs.size());
    if (files.isPng())
      pictures = {joined(pictures, frame.width, 3)};
    else
      raw = {joined(raw, frame.width, 1)};
  }
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const Status ok = files.isPng()
                          ? writePng(paths[i], width, frame.height, std::span<const std::uint8_t>(pictures[i]))
                          : writeImage(paths[i], width, frame.height, raw[i]);
    if (!ok) return ok;
    written.push_back(paths[i].string());
  }
  return done();
}

nlohmann::json describeScale(const std::vector<Aov>& aovs, const PictureScale& scale) {
  nlohmann::json described = nlohmann::json::object();
  const glm::vec3 low = scale.bounds.min, high = scale.bounds.max;
  for (const Aov aov : aovs) {
    if (isLight(aov)) described["exposureStops"] = roundedStops(scale.exposureStops);
    if (aov == Aov::position) {
      described["positionBlackM"] = {shownFloat(low.x), shownFloat(low.y), shownFloat(low.z)};
      described["positionWhiteM"] = {shownFloat(high.x), shownFloat(high.y), shownFloat(high.z)};
    }
    if (aov == Aov::depth) {
      described["depthWhiteM"] = shownFloat(scale.nearestM);
      described["depthDarkestM"] = shownFloat(scale.farthestM);
    }
  }
  return described;
}

void printScale(const std::vector<Aov>& aovs, const PictureScale& scale, bool automatic) {
  const glm::vec3 low = scale.bounds.min, high = scale.bounds.max;
  if (std::any_of(aovs.begin(), aovs.end(), isLight)) {
    std::printf("exposure: %s stops", stopsText(scale.exposureStops).c_str());
    if (automatic) std::printf(", from the picture (--exposure %s repeats it)", stopsText(scale.exposureStops).c_str());
    std::printf("\n");
  }
  if (std::count(aovs.begin(), aovs.end(), Aov::position))
    std::printf("position: %g,%g,%g m is black, %g,%g,%g m white, X Y Z as red green blue\n", low.x, low.y, low.z,
                high.x, high.y, high.z);
  if (std::count(aovs.begin(), aovs.end(), Aov::depth))
    std::printf("depth: white at %g m to dark grey at %g m, black where nothing is\n", scale.nearestM, scale.farthestM);
}

}  // namespace relume
