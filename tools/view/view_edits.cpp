// SPDX-License-Identifier: MIT
// See view_edits.h.
#include "tools/view/view_edits.h"

#include <cstddef>

namespace relume {

ViewEdits::Edited ViewEdits::editedOf(const ViewState& state) {
  Edited edited{state.lights, {}, {}, state.emission, state.sky.radiance, state.sky.rotationDeg};
  for (const ViewedObject& object : state.objects) edited.objects.push_back(object.position);
  for (const ViewedEmitter& emitter : state.emitters) edited.emitters.push_back({emitter.isDriven, emitter.radiance});
  return edited;
}

void ViewEdits::put(const Edited& edited, ViewState& state) {
  state.lights = edited.lights;
  state.emission = edited.emission;
  state.sky.radiance = edited.skyRadiance;
  state.sky.rotationDeg = edited.skyRotationDeg;
  for (std::size_t i = 0; edited.objects.size() == state.objects.size() && i < state.objects.size(); ++i)
    state.objects[i].position = edited.objects[i];
  for (std::size_t i = 0; edited.emitters.size() == state.emitters.size() && i < state.emitters.size(); ++i) {
    state.emitters[i].isDriven = edited.emitters[i].isDriven;
    state.emitters[i].radiance = edited.emitters[i].radiance;
  }
}

void ViewEdits::begin(const ViewState& state) { history_ = EditHistory<Edited>(editedOf(state)); }

void ViewEdits::replace(const ViewState& state) { history_.replace(editedOf(state)); }

void ViewEdits::commit(const ViewState& state) { history_.commit(editedOf(state)); }

void ViewEdits::undo(ViewState& state) {
  commit(state);
  put(history_.undo(), state);
}

void ViewEdits::redo(ViewState& state) {
  commit(state);
  put(history_.redo(), state);
}

}  // namespace relume
