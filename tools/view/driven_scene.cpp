// SPDX-License-Identifier: MIT
// See driven_scene.h.
#include "tools/view/driven_scene.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace relume {
namespace {

bool drivesAny(const ViewState& state) {
  return std::ranges::any_of(state.emitters, [](const ViewedEmitter& each) { return each.isDriven; });
}

}  // namespace

float DrivenScene::factorOf(const ViewState& state) { return drivesAny(state) ? 1.0f : state.emission; }

// Found once for each change: a level may have thousands of materials.
const std::vector<ShownEmission>& DrivenScene::emissionsOf(const ViewState& state) {
  const bool isDriven = drivesAny(state);
  Key key{isDriven ? state.emission : 1.0f, {}};
  for (const ViewedEmitter& each : state.emitters) key.emitters.emplace_back(each.isDriven, each.radiance);
  if (!emissions_.empty() && key == key_) return emissions_;
  key_ = std::move(key);
  emissions_.clear();
  for (std::uint32_t m = 0; m < level_->materials.size(); ++m) {
    const Material& own = level_->materials[m];
    emissions_.push_back(isDriven ? shownEmission(*level_, state, m)
                                  : ShownEmission{own.emission, own.emissionTexture});
  }
  return emissions_;
}

bool DrivenScene::isOf(const ViewState& state) {
  return std::ranges::equal(scene().materials, emissionsOf(state), [](const Material& own, const ShownEmission& shown) {
    return own.emission == shown.radiance && own.emissionTexture.image == shown.texture.image;
  });
}

void DrivenScene::drive(const ViewState& state) {
  if (isOf(state)) return;
  if (!driven_) driven_ = std::make_unique<Scene>(level_->scene);
  for (std::size_t m = 0; m < emissions_.size(); ++m) {
    driven_->materials[m].emission = emissions_[m].radiance;
    driven_->materials[m].emissionTexture = emissions_[m].texture;
  }
}

}  // namespace relume
