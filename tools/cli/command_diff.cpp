// SPDX-License-Identifier: MIT
// `relume diff IMAGE REFERENCE`: how far an image is from another of the same view, in figures and as a picture.
#include "bake/base/memory_budget.h"
#include "tools/base/number_check.h"
#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/cli/commands.h"
#include "tools/cli/layer_files.h"
#include "tools/cli/terminal.h"
#include "tools/images/image_diff.h"
#include "tools/images/image_io.h"
#include "tools/images/read_picture.h"
#include "tools/render/exposure.h"

#include <CLI/CLI.hpp>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>

namespace relume {
namespace {

struct Bounds {
  std::optional<double> rmse, flip;
};

struct DiffArguments {
  std::string image, reference, output, layer, exposure = "auto";
  Bounds bounds;
  std::uint64_t maxMemory = 0;
  bool json = false, force = false;
};

// Stops for FLIP: as asked; from the reference; none for PNGs, which are exposed already.
float stopsFor(const std::optional<float>& asked, const PictureFile& reference) {
  if (asked) return *asked;
  return reference.png ? 0.0f : autoExposure(reference.picture.pixels);
}

bool exceeds(const PictureDifference& d, const Bounds& bounds) {
  return (bounds.rmse && !(d.relativeRmse <= *bounds.rmse)) || (bounds.flip && !(d.flip <= *bounds.flip));
}

// The picture of the error, or the difference itself for an OpenEXR. Returns the picture's scale; 0 for the latter.
Result<double> writeError(const std::string& path, const Picture& image, const Picture& reference) {
  if (imageKind(path) == FileKind::png) {
    const ErrorPicture error = drawError(image, reference);
    const Status ok = writePng(path, image.width, image.height, std::span<const std::uint8_t>(error.rgb));
    if (!ok) return ok.error();
    return error.scale;
  }
  std::vector<glm::vec3> difference = image.pixels;
  // A float may not hold the difference of two: the largest that it holds says so, and is read again.
  constexpr float kMax = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < difference.size(); ++i)
    difference[i] = glm::clamp(difference[i] - reference.pixels[i], -kMax, kMax);
  const Status ok = writeImage(path, image.width, image.height, difference);
  if (!ok) return ok.error();
  return 0.0;
}

// JSON has no infinity: null says it.
nlohmann::json finiteOrNull(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

void printJson(const PictureDifference& d, const DiffArguments& a, const PictureFile& image,
               const PictureFile& reference, float stops, double scale, bool exceeded) {
  nlohmann::json report{{"image", a.image},
                        {"reference", a.reference},
                        {"imageChannels", image.channels},
                        {"referenceChannels", reference.channels},
                        {"width", image.picture.width},
                        {"height", image.picture.height},
                        {"rmse", d.rmse},
                        {"relativeRmse", finiteOrNull(d.relativeRmse)},
                        {"energy", finiteOrNull(d.energy)},
                        {"flip", d.flip},
                        {"flipExposureStops", roundedStops(stops)},
                        {"worst", {{"x", d.worstX}, {"y", d.worstY}, {"difference", d.worst}}},
                        {"withinBounds", !exceeded}};
  if (!a.output.empty()) report["errorPicture"] = a.output;
  if (scale > 0.0) report["errorPictureScale"] = scale;
  std::printf("%s\n", jsonText(report).c_str());
}

void printText(const PictureDifference& d, const DiffArguments& a, const PictureFile& image,
               const PictureFile& reference, float stops, double scale, bool exceeded) {
  std::printf("%u x %u pixels, %s against %s of the reference\n", image.picture.width, image.picture.height,
              printable(image.channels).c_str(), printable(reference.channels).c_str());
  // A render of one kind of light against all light is what a forgotten --layer looks like.
  if (a.layer.empty() && image.layers.empty() && !reference.layers.empty()) {
    std::printf("               which has more than that, for --layer: %s\n", printable(reference.layers).c_str());
  }
  std::printf("RMSE           %.6g\n", d.rmse);
  std::printf("relative RMSE  %.4g %%\n", 100.0 * d.relativeRmse);
  std::printf("energy         %.5g of the reference's\n", d.energy);
  std::printf("FLIP           %.4g (0 the same .. 1), at %s stops\n", d.flip, stopsText(stops).c_str());
  std::printf("worst          %.6g at pixel %u,%u\n", d.worst, d.worstX, d.worstY);
  if (!a.output.empty()) std::printf("wrote %s", printable(a.output).c_str());
  if (scale > 0.0) std::printf(": red is too bright, blue too dark, full colour at %g %% or more", 100.0 * scale);
  if (!a.output.empty()) std::printf("\n");
  if (a.bounds.rmse || a.bounds.flip) std::printf("%s\n", exceeded ? "EXCEEDED" : "WITHIN BOUNDS");
}

Status checkFiles(const DiffArguments& a, Context& context) {
  CommandFiles files;
  files.read("the image", a.image);
  files.read("the reference", a.reference);
  files.write("-o", a.output, imageKind(a.output));
  files.force = a.force;
  return checkOutputs(files, context);
}

// A render has R, G and B where its reference has layers; a name that no file has was not meant.
Status checkLayer(const DiffArguments& a, const PictureFile& image, const PictureFile& reference) {
  if (a.layer.empty() || image.channels == a.layer || reference.channels == a.layer) return done();
  const auto layersOf = [](const std::string& path, const PictureFile& file) {
    return "\"" + path + "\" has " + (file.layers.empty() ? "none" : file.layers);
  };
  return Error{ErrorCode::usage, "--layer: expected layers of either file, found \"" + a.layer + "\"; " +
                                     layersOf(a.image, image) + ", " + layersOf(a.reference, reference)};
}

void warnOfAlpha(const DiffArguments& a, const PictureFile& image, const PictureFile& reference, Context& context) {
  if (image.opaque && reference.opaque) return;
  std::string names;
  if (!image.opaque) names = "\"" + a.image + "\"";
  if (!reference.opaque) names += (names.empty() ? "\"" : " and \"") + a.reference + "\"";
  context.message(Severity::warning,
                  names + ": some pixels are transparent; their alpha is left out, their colours compared as they are");
}

int runDiff(const DiffArguments& a) {
  // 1. What is asked for
  const auto asked = readExposure(a.exposure);
  if (!asked) return fail(asked.error());
  if (Status ok = a.output.empty() ? done() : checkImageName(a.output); !ok) return fail(ok.error());
  Terminal terminal(a.maxMemory);
  Context& context = terminal.context();
  if (Status ok = checkFiles(a, context); !ok) return fail(ok.error());

  // 2. Read and compare
  const MemoryCheck fits = [&context](double bytes, const std::string& what) {
    return reserveMemory(context, "diff", bytes, what, "compare smaller images");
  };
  const auto image = readPicture(a.image, a.layer, fits);
  if (!image) return fail(image.error());
  const auto reference = readPicture(a.reference, a.layer, fits);
  if (!reference) return fail(reference.error());
  if (image->png != reference->png) {
    return fail({ErrorCode::usage, "\"" + (image->png ? a.image : a.reference) +
                                       "\" is a PNG, whose exposure is unknown, and the other is not: compare two "
                                       "OpenEXR images or two PNGs"});
  }
  if (Status ok = checkLayer(a, *image, *reference); !ok) return fail(ok.error());
  warnOfAlpha(a, *image, *reference, context);
  constexpr double kComparedBytes = 4 + 12 + 3 * 4;  // a pixel's error, difference and place in a picture of it
  const double pixels = static_cast<double>(image->picture.width) * image->picture.height;
  if (Status ok = fits(kComparedBytes * pixels, "comparing them"); !ok) return fail(ok.error());
  const float stops = stopsFor(*asked, *reference);
  const auto difference = comparePictures(image->picture, reference->picture, std::exp2(stops), a.image, a.reference);
  if (!difference) return fail(difference.error());

  // 3. Tell
  double scale = 0.0;
  if (!a.output.empty()) {
    const auto written = writeError(a.output, image->picture, reference->picture);
    if (!written) return fail(written.error());
    scale = *written;
  }
  const bool exceeded = exceeds(*difference, a.bounds);
  if (a.json)
    printJson(*difference, a, *image, *reference, stops, scale, exceeded);
  else
    printText(*difference, a, *image, *reference, stops, scale, exceeded);
  return exceeded ? kDifferenceFound : 0;
}

}  // namespace

void addDiffCommand(CLI::App& app, Action& action) {
  auto a = std::make_shared<DiffArguments>();
  CLI::App* command = app.add_subcommand("diff", "How far an image is from a reference: figures and a picture");
  command->add_option("IMAGE", a->image, "image, OpenEXR (.exr) or PNG (.png)")->type_name("FILE")->required();
  command->add_option("REFERENCE", a->reference, "image of the same size and kind to compare with: .exr or .png")
      ->type_name("FILE")
      ->required();
  command
      ->add_option("-o,--output", a->output,
                   "picture of the error: .png (red is too bright, blue too dark) or .exr (IMAGE - REFERENCE)")
      ->type_name("FILE");
  command->add_option("--layer", a->layer,
                      "layer of OpenEXR files to compare, or a sum, as DiffDir+DiffInd; when one of the files has none "
                      "of them, R, G, B of that one; default: R, G, B");
  command
      ->add_option("--exposure", a->exposure,
                   "stops for FLIP, which sees what a screen shows: -30..30, or auto: from the reference; 0 for PNGs")
      ->capture_default_str();
  command
      ->add_option("--max-rmse", a->bounds.rmse,
                   "exit with 7 when the relative RMSE is beyond this (0.02 = 2 %) [>= 0]")
      ->option_text("X [none]")
      ->check(numberFrom(0.0));
  command->add_option("--max-flip", a->bounds.flip, "exit with 7 when the mean of FLIP is beyond this [0..1]")
      ->option_text("X [none]")
      ->check(numberFrom(0.0, 1.0));
  command->add_flag("--force", a->force,
                    "write over a file that is something else than an image of that kind, or read-only");
  command->add_flag("--json", a->json, "print JSON");
  addMemoryOption(*command, a->maxMemory);
  command->callback([a, &action] { action = [a] { return runDiff(*a); }; });
}

}  // namespace relume
