// SPDX-License-Identifier: MIT
// See view_edits.h.
#include "tools/view/view_edits.h"

#include "tools/view/light_set.h"

#include <algorithm>
#include <cstddef>

namespace relume {

ViewEdits::Edited ViewEdits::editedOf(const ViewState& state) {
  Edited edited{state.lights, {}, {}, state.emission, state.sky.radiance, state.sky.rotationDeg};
  for (const ViewedObject& object : state.objects) edited.objects.push_back(object.position);
  for (const ViewedEmitter& emitter : state.emitters)
    edited.emitters.push_back({emitter.name, emitter.isDriven, emitter.radiance});
  return edited;
}

void ViewEdits::put(const Edited& edited, ViewState& state) {
  state.lights = edited.lights;
  state.emission = edited.emission;
  state.sky.radiance = edited.skyRadiance;
  state.sky.rotationDeg = edited.skyRotationDeg;
  for (std::size_t i = 0; edited.objects.size() == state.objects.size() && i < state.objects.size(); ++i)
    state.objects[i].position = edited.objects[i];
  for (ViewedEmitter& emitter : state.emitters) {
    const auto same = std::ranges::find(edited.emitters, emitter.name, &Emitter::name);
    if (same == edited.emitters.end()) continue;
    emitter.isDriven = same->isDriven;
    emitter.radiance = same->radiance;
  }
}

void ViewEdits::begin(const ViewState& state) { history_ = EditHistory<Edited>(editedOf(state)); }

void ViewEdits::replace(const ViewState& state, const FileParts& before, const FileParts& now) {
  history_.replace(editedOf(state));
  history_.changeOthers([&](Edited& edited) {
    edited.lights = followFile(edited.lights, before.lights, now.lights);
    for (Emitter& emitter : edited.emitters) {
      const auto was = std::ranges::find(before.emitters, emitter.name, &ViewedEmitter::name);
      const auto is = std::ranges::find(now.emitters, emitter.name, &ViewedEmitter::name);
      if (was == before.emitters.end() || is == now.emitters.end()) continue;
      if (emitter.isDriven == was->isDriven && emitter.radiance == was->radiance) emitter.radiance = is->radiance;
    }
  });
}

void ViewEdits::commit(const ViewState& state) { history_.commit(editedOf(state)); }

void ViewEdits::undo(ViewState& state) {
  commit(state);
  put(history_.undo(), state);
  history_.replace(editedOf(state));
}

void ViewEdits::redo(ViewState& state) {
  commit(state);
  put(history_.redo(), state);
  history_.replace(editedOf(state));
}

}  // namespace relume
