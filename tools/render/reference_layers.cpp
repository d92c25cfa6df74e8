// SPDX-License-Identifier: MIT
// See reference_layers.h.
#include "tools/render/reference_layers.h"

namespace relume {

std::vector<glm::vec3> radianceOf(const ReferenceImage& image) {
  std::vector<glm::vec3> radiance(image.albedo.size());
  for (std::size_t i = 0; i < radiance.size(); ++i)
    radiance[i] = (image.direct[i] + image.indirect[i]) * image.albedo[i] + image.emission[i];
  for (std::size_t i = 0; i < radiance.size() && image.mirrors; ++i)
    radiance[i] += image.glossyDirect[i] + image.glossyIndirect[i];
  return radiance;
}

std::vector<glm::vec3> glossyOf(const ReferenceImage& image) {
  std::vector<glm::vec3> glossy(image.glossyDirect.size());
  for (std::size_t i = 0; i < glossy.size(); ++i) glossy[i] = image.glossyDirect[i] + image.glossyIndirect[i];
  return glossy;
}

std::vector<glm::vec3> opennessOf(const ReferenceImage& image) {
  std::vector<glm::vec3> open;
  open.reserve(image.open.size());
  for (const float o : image.open) open.emplace_back(o);
  return open;
}

ChannelImage toChannels(const ReferenceImage& image, std::span<const glm::vec3> combined) {
  ChannelImage file{image.width, image.height, {}};
  file.setLayer("", combined);
  file.setLayer("DiffInd", image.indirect);
  file.setLayer("DiffDir", image.direct);
  file.setLayer("DiffIndErr", image.indirectError);
  file.setLayer("DiffDirErr", image.directError);
  if (!image.glossyDirect.empty()) {
    file.setLayer("GlossInd", image.glossyIndirect);
    file.setLayer("GlossDir", image.glossyDirect);
    file.setLayer("GlossIndErr", image.glossyIndirectError);
    file.setLayer("GlossDirErr", image.glossyDirectError);
  }
  if (!image.open.empty()) file.channels["Open.V"] = image.open;
  file.setLayer("DiffCol", image.albedo);
  file.setLayer("Emit", image.emission);
  file.setLayer("Position", image.position, "XYZ");
  file.setLayer("Normal", image.normal, "XYZ");
  file.channels["Depth.Z"] = image.depth;
  return file;
}

}  // namespace relume
