// SPDX-License-Identifier: MIT
// See reference_layers.h.
#include "tools/render/reference_layers.h"

namespace relume {

std::vector<glm::vec3> radianceOf(const ReferenceImage& image) {
  std::vector<glm::vec3> radiance(image.albedo.size());
  for (std::size_t i = 0; i < radiance.size(); ++i)
    radiance[i] = (image.direct[i] + image.indirect[i]) * image.albedo[i] + image.emission[i];
  return radiance;
}

ChannelImage toChannels(const ReferenceImage& image) {
  ChannelImage file{image.width, image.height, {}};
  file.setLayer("", radianceOf(image));
  file.setLayer("DiffInd", image.indirect);
  file.setLayer("DiffDir", image.direct);
  file.setLayer("DiffIndErr", image.indirectError);
  file.setLayer("DiffDirErr", image.directError);
  file.setLayer("DiffCol", image.albedo);
  file.setLayer("Emit", image.emission);
  file.setLayer("Position", image.position, "XYZ");
  file.setLayer("Normal", image.normal, "XYZ");
  file.channels["Depth.Z"] = image.depth;
  return file;
}

}  // namespace relume
