// SPDX-License-Identifier: MIT
// See view_edits.h.
#include "tools/view/view_edits.h"

#include "tools/view/light_set.h"

#include <algorithm>
#include <cstddef>

namespace relume {

ViewEdits::Edited ViewEdits::editedOf(const ViewState& state) {
  Edited edited{state.lights, {}, {}, state.emission, state.sky.radiance, state.sky.rotationDeg};
  for (auto object = state.objects.begin(); object != state.objects.end(); ++object) {
    if (object->position == object->home) continue;
    const auto number = std::count_if(state.objects.begin(), object, [&](const ViewedObject& o) {
      return o.home == object->home && o.name == object->name;
    });
    edited.objects.push_back({object->name, object->home, number, object->position});
  }
  for (const ViewedEmitter& emitter : state.emitters)
    edited.emitters.push_back({emitter.name, emitter.isDriven, emitter.radiance});
  return edited;
}

void ViewEdits::put(const Edited& edited, ViewState& state) {
  state.lights = edited.lights;
  state.emission = edited.emission;
  state.sky.radiance = edited.skyRadiance;
  state.sky.rotationDeg = edited.skyRotationDeg;
  for (ViewedObject& object : state.objects) object.position = object.home;
  for (const MovedObject& moved : edited.objects) {
    std::ptrdiff_t before = moved.number;
    const auto same = std::ranges::find_if(state.objects, [&](const ViewedObject& o) {
      return o.home == moved.home && o.name == moved.name && before-- == 0;
    });
    if (same != state.objects.end()) same->position = moved.position;
  }
  for (ViewedEmitter& emitter : state.emitters) {
    const auto same = std::ranges::find(edited.emitters, emitter.name, &Emitter::name);
    if (same == edited.emitters.end()) continue;
    emitter.isDriven = same->isDriven;
    emitter.radiance = same->radiance;
  }
}

// Bring what was as the file had it to what the file has now, as Session::show() does with what is shown.
void ViewEdits::follow(const FileParts& before, const FileParts& now, Edited& edited) {
  edited.lights = followFile(edited.lights, before.lights, now.lights);
  for (Emitter& emitter : edited.emitters) {
    const auto was = std::ranges::find(before.emitters, emitter.name, &ViewedEmitter::name);
    const auto is = std::ranges::find(now.emitters, emitter.name, &ViewedEmitter::name);
    if (was == before.emitters.end() || is == now.emitters.end()) continue;
    if (emitter.isDriven == was->isDriven && emitter.radiance == was->radiance) emitter.radiance = is->radiance;
  }
}

void ViewEdits::begin(const ViewState& state) { history_ = EditHistory<Edited>(editedOf(state)); }

void ViewEdits::replace(const ViewState& state, const FileParts& before, const FileParts& now) {
  history_.change([&](Edited& edited) { follow(before, now, edited); });
  // What was noted last, in a level of these objects and emitters: the next commit() compares with it.
  ViewState noted = state;
  put(history_.current(), noted);
  limitLightsOn(noted.lights);
  history_.replace(editedOf(noted));
}

void ViewEdits::commit(const ViewState& state) { history_.commit(editedOf(state)); }

// What an undo or redo has found.
std::size_t ViewEdits::bring(const Edited& edited, ViewState& state) {
  put(edited, state);
  const std::size_t off = limitLightsOn(state.lights);
  history_.replace(editedOf(state));
  return off;
}

std::size_t ViewEdits::undo(ViewState& state) {
  commit(state);
  return bring(history_.undo(), state);
}

std::size_t ViewEdits::redo(ViewState& state) {
  commit(state);
  return bring(history_.redo(), state);
}

}  // namespace relume
