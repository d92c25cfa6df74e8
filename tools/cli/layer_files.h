// SPDX-License-Identifier: MIT
// The layers of a drawn frame as files: one each, or side by side in one, and what is said of them afterwards.
// Libraries never print, so this is the command line's.
#pragma once

#include "relume/result.h"
#include "tools/base/output_files.h"
#include "tools/render/render_frame.h"
#include "tools/render/render_pictures.h"
#include "tools/render/view_options.h"

#include <nlohmann/json_fwd.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace relume {

// What commands that draw a level's light are told: of what, by which light, and into which pictures.
struct PictureOptions {
  std::string scene, bake, output, exposure = "auto";
  ViewOptions view;
  std::vector<std::string> emissions, aovs{"full"};
  bool sideBySide = false, force = false;
};
// Those of the pictures: exposure, side by side, output, force. `options` must live as long as the command.
void addPictureOptions(CLI::App& command, PictureOptions& options);

struct LayerFiles {
  std::string output;  // .exr or .png
  std::vector<Aov> aovs;
  bool sideBySide = false;  // in one file, from left to right

  bool isPng() const { return imageKind(output) == FileKind::png; }
  bool areSeveral() const { return aovs.size() > 1 && !sideBySide; }
  // The name as it is, or with ".NAME" before the extension where there are several. [Size aovs, or 1]
  std::vector<std::filesystem::path> paths() const;
};

// The files that such a command reads and writes, but for those that the scene names.
CommandFiles filesOf(const PictureOptions& options, const LayerFiles& layers);

// What the view says of a request.
void setView(const View& view, RenderRequest& request);

// usage: a name that ends in neither .exr nor .png.
Status checkImageName(const std::string& output);

// The layers that are named, usage: a name that there is not.
Result<std::vector<Aov>> aovsByName(const std::vector<std::string>& names);

// Write all of them; the names go to `written`, up to the one that failed.
Status writeLayers(const RenderedFrame& frame, const LayerFiles& files, const PictureScale& scale,
                   std::vector<std::string>& written);

// How the values of a PNG's layers came about, as JSON and as text. automatic: the exposure is the picture's own.
nlohmann::json describeScale(const std::vector<Aov>& aovs, const PictureScale& scale);
void printScale(const std::vector<Aov>& aovs, const PictureScale& scale, bool automatic);

}  // namespace relume
