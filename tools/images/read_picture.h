// SPDX-License-Identifier: MIT
// Images as `relume diff` takes them: OpenEXR layers as they are, PNGs made linear.
#pragma once

#include "relume/result.h"
#include "tools/images/image_diff.h"
#include "tools/images/image_io.h"

#include <string>

namespace relume {

struct PictureFile {
  Picture picture;
  bool png = false;      // sRGB of 8 or 16 bits, for eyes: values end at 1
  bool opaque = true;    // false: a PNG with transparent pixels, whose colours are as they stand, without alpha
  std::string channels;  // "R,G,B", "Y", or the layers asked for: "DiffDir+DiffInd", ...; "sRGB" of a PNG
  std::string layers;    // "DiffDir, DiffInd": all that the file has beside R, G, B; empty: none
};

// Read a file of either kind, told by its first bytes. `layers` names layers of an OpenEXR joined by '+', which are
// summed (".R", ".G", ".B" each); files that have none of them, and all when it is empty, give R, G, B, or the grey of
// Y. io: not readable; invalidFile: no image, damaged, or without those channels, with the layers it has; usage: it has
// layers, but not all that were asked for, and no such channels either; errors of `fits`.
Result<PictureFile> readPicture(const std::string& path, const std::string& layers, const MemoryCheck& fits = {});

}  // namespace relume
