// SPDX-License-Identifier: MIT
// See bench_live.h.
#include "tools/cli/bench_live.h"

#include "bake/base/printed.h"
#include "bake/scene/camera_rays.h"
#include "tools/base/printable.h"
#include "tools/cli/bench_tables.h"
#include "tools/render/render_frame.h"
#include "tools/render/scene_bounds.h"

#include <glm/ext/matrix_transform.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <optional>

namespace relume {
namespace {

constexpr double kFrameSeconds = 1.0 / 60.0;
const std::string kOnGl = "OpenGL: ";  // of buffers

// Passes by what is done, with their names in the table.
constexpr std::array<std::pair<const char*, const char*>, 16> kLivePasses{
    {{"pieces", "cut and read textures"},
     {"voxelise", "voxelise"},
     {"shadow rays", "shadow rays' structure"},
     {"direct", "direct light"},
     {"bounce", "bounce"},
     {"gather", "gather"},
     {"frame", "**frame**"},
     {"edit voxelise", "edit: voxelise"},
     {"edit shadow rays", "edit: rays' structure"},
     {"edit cells", "edit: cells"},
     {"edit frame", "**frame after an edit**"},
     {"eye voxelise", "eye a cell on: voxelise"},
     {"eye cells", "eye a cell on: cells"},
     {"eye direct", "eye a cell on: direct light"},
     {"eye gather", "eye a cell on: gather"},
     {"eye frame", "**frame after the eye**"}}};

// What standing part is moved: of those with triangles the median by their number.
std::optional<std::uint32_t> medianPart(const Scene& scene) {
  std::vector<std::uint32_t> parts;
  const auto triangles = [&](std::uint32_t i) { return scene.meshes[scene.instances[i].mesh].triangle.size(); };
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    if (scene.instances[i].baked() && triangles(i) > 0) parts.push_back(i);
  }
  if (parts.empty()) return std::nullopt;
  std::stable_sort(parts.begin(), parts.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return triangles(a) < triangles(b); });
  return parts[parts.size() / 2];
}

// Of the first camera; nothing = the level's middle.
std::optional<glm::vec3> eyeOf(const Scene& scene) {
  if (scene.cameras.empty()) return std::nullopt;
  return CameraRays(scene.cameras.front(), 1, 1).origin;
}

class Measurement {
 public:
  // onGl: who lights the voxels, null = the level itself.
  Measurement(const Scene& scene, const LiveLevelOptions& options, LiveFrames* onGl)
      : scene_(scene), options_(options), onGl_(onGl) {
    options_.backend = onGl != nullptr ? BackendKind::gl : BackendKind::cpu;
    for (const SceneLight& light : scene.lights) frame_.lights.push_back(toRuntimeLight(light));
    if (frame_.lights.empty()) frame_.lights.emplace_back().kind = LightKind::directional;
  }

  // Levels, of which the last one stays.
  Status make(int makes, Context& context) {
    for (int i = 0; i < makes; ++i) {
      level_.reset();
      auto made = LiveLevel::create(scene_, options_, context, eyeOf(scene_));
      if (!made) return made.error();
      level_.emplace(std::move(*made));
      for (const char* pass : {"pieces", "voxelise", "shadow rays"}) add(pass, pass);
    }
    return update();
  }

  Status light(int frames, const Context& context) {
    for (int i = 0; i < frames; ++i) {
      if (context.cancelled()) return cancelledError();
      frame_.lights.front().intensity *= i % 2 == 0 ? 0.5f : 2.0f;
      if (Status ok = update(); !ok) return ok;
      ms_["frame"].push_back(0.0);
      for (const char* pass : {"direct", "bounce", "gather"}) ms_["frame"].back() += add(pass, pass);
    }
    return done();
  }

  Status edit(std::uint32_t part, int edits, const Context& context) {
    const SceneBounds bounds = boundsOf(scene_);
    const glm::mat4 up = glm::translate(glm::mat4(1.0f), glm::vec3(0.0f, 0.1f * (bounds.max.y - bounds.min.y), 0.0f));
    for (const Instance& instance : scene_.instances) frame_.toWorld.push_back(instance.toWorld);
    for (int i = 0; i < edits; ++i) {
      if (context.cancelled()) return cancelledError();
      const glm::mat4& home = scene_.instances[part].toWorld;
      frame_.toWorld[part] = i % 2 == 0 ? up * home : home;
      if (Status ok = update(); !ok) return ok;
      double sum =
          add("edit voxelise", "voxelise") + add("edit shadow rays", "shadow rays") + add("edit cells", "cells");
      for (const char* pass : {"direct", "bounce", "gather"}) sum += timeOf(pass);
      ms_["edit frame"].push_back(sum);
    }
    return done();
  }

  // The eye goes a cell of the innermost volume on, and back.
  Status walk(int steps, const Context& context) {
    if (options_.cascades == 1) return done();
    const NestedVolumes& volumes = level_->volumes();
    const VolumeGrid inner = volumes[volumes.size() - 1].grid();
    const glm::vec3 middle = inner.toWorld(0.5f * glm::vec3(inner.voxels()));
    for (int i = 0; i < steps; ++i) {
      if (context.cancelled()) return cancelledError();
      frame_.eyeWorld = middle + glm::vec3(i % 2 == 0 ? inner.cell() : 0.0f, 0.0f, 0.0f);
      if (Status ok = update(); !ok) return ok;
      double sum = timeOf("bounce");
      for (const char* pass : {"voxelise", "cells", "direct", "gather"})
        sum += add((std::string("eye ") + pass).c_str(), pass);
      ms_["eye frame"].push_back(sum);
    }
    return done();
  }

  RelightTimes times() {
    RelightTimes times;
    const auto threads = static_cast<int>(options_.threads);
    times.how = onGl_ != nullptr ? "OpenGL" : std::to_string(threads) + (threads == 1 ? " thread" : " threads");
    times.backend = onGl_ != nullptr ? "gl" : "cpu";
    times.threads = threads;
    times.bands = "Y3Co3Cg3";
    for (const auto& [pass, title] : kLivePasses) {
      // What OpenGL does not do takes no time.
      const std::vector<double>& ms = ms_[pass];
      if (std::any_of(ms.begin(), ms.end(), [](double each) { return each > 0.0; }))
        times.passes.push_back(figuresOf(pass, ms));
    }
    times.buffers = level_->bufferSizes();
    if (onGl_ == nullptr) return times;
    for (const auto& [name, bytes] : onGl_->bufferSizes()) times.buffers.emplace_back(kOnGl + name, bytes);
    return times;
  }
  std::uint32_t voxels() const { return level_->volumes().stats().occupied; }
  std::uint32_t caches() const { return onGl_ != nullptr ? onGl_->activeCells() : level_->light().activeCells(); }

 private:
  // A frame.
  Status update() {
    Status ok = level_->update(frame_, kFrameSeconds);
    return ok && onGl_ != nullptr ? onGl_->update(*level_, frame_, kFrameSeconds) : ok;
  }
  double timeOf(const std::string& pass) const {
    std::vector<PassTime> times = onGl_ != nullptr ? onGl_->passTimes() : std::vector<PassTime>();
    for (const PassTime& each : level_->passTimes()) times.push_back(each);
    for (const PassTime& time : times) {
      if (time.pass == pass) return time.ms;
    }
    return 0.0;
  }
  double add(const char* name, const char* pass) {
    ms_[name].push_back(timeOf(pass));
    return ms_[name].back();
  }

  const Scene& scene_;
  LiveLevelOptions options_;
  LiveFrames* onGl_;
  LiveScene frame_;
  std::optional<LiveLevel> level_;
  std::map<std::string, std::vector<double>> ms_;
};

}  // namespace

Result<LiveFigures> measureLive(const Scene& scene, const LiveLevelOptions& options, const std::vector<int>& threads,
                                LiveFrames* onGl, int makes, int frames, Context& context) {
  LiveFigures figures{options};
  const std::optional<std::uint32_t> part = medianPart(scene);
  if (part) {
    figures.edited = scene.instances[*part].node;
    figures.editedTriangles = static_cast<std::uint32_t>(scene.meshes[scene.instances[*part].mesh].triangle.size());
  }
  const auto measure = [&](int count, LiveFrames* lights) -> Status {
    figures.options.threads = static_cast<unsigned>(count);
    Measurement measured(scene, figures.options, lights);
    if (Status ok = measured.make(makes, context); !ok) return ok;
    if (Status ok = measured.light(frames, context); !ok) return ok;
    if (part) {
      if (Status ok = measured.edit(*part, makes, context); !ok) return ok;
    }
    if (Status ok = measured.walk(2 * makes, context); !ok) return ok;
    figures.voxels = measured.voxels();
    figures.caches = measured.caches();
    figures.times.push_back(measured.times());
    return done();
  };
  for (const int count : threads) {
    if (Status ok = measure(count, nullptr); !ok) return ok.error();
  }
  if (onGl != nullptr) {
    if (Status ok = measure(figures.options.threads > 0 ? static_cast<int>(figures.options.threads) : 1, onGl); !ok)
      return ok.error();
  }
  return figures;
}

std::string toMarkdown(const LiveFigures& figures) {
  std::string text = "\n## Light without a bake\n\n" +
                     printed("%u cells on the longest side, %u rays: ", figures.options.cells, figures.options.rays) +
                     printed("%u voxels, %u caches.", figures.voxels, figures.caches);
  if (figures.options.cascades > 1) text += printed(" Of %u volumes in one another.", figures.options.cascades);
  if (!figures.edited.empty())
    text +=
        " Edits move \"" + printable(figures.edited) + "\", " + std::to_string(figures.editedTriangles) + " triangles.";
  if (figures.times.back().backend == "gl")
    text +=
        " OpenGL lights by the GPU's own clock, without shadows, whose maps are the host's; cells and voxels are found "
        "on the CPU.";
  text += " Median (least), ms.\n\n";
  std::vector<std::string> titles{"pass"};
  for (const RelightTimes& times : figures.times) titles.push_back(times.how);
  text += tableHead(titles);
  for (const auto& [pass, title] : kLivePasses) {
    std::vector<std::string> cells{title};
    bool measured = false;  // no eye moves in one volume
    for (const RelightTimes& times : figures.times) {
      const PassFigures* found = findPass(times, pass);
      measured |= found != nullptr;
      cells.push_back(found ? tableNumber(found->medianMs) + " (" + tableNumber(found->minMs) + ")" : "–");
    }
    if (measured) text += tableRow(cells);
  }
  text += "\n" + tableHead({"buffer", "MiB"});
  const auto list = [&](const RelightTimes& times, const std::string& prefix, const char* all) {
    double sum = 0.0;
    for (const auto& [name, bytes] : times.buffers) {
      if (!name.starts_with(prefix)) continue;
      text += tableRow({name, tableNumber(mebibytes(bytes))});
      sum += mebibytes(bytes);
    }
    text += tableRow({all, "**" + tableNumber(sum) + "**"});
  };
  list(figures.times.front(), "", "**all**");
  // Beside those that the CPU's light takes
  if (figures.times.size() > 1 && figures.times.back().backend == "gl")
    list(figures.times.back(), kOnGl, "**all of OpenGL**");
  return text;
}

nlohmann::json toJson(const LiveFigures& figures) {
  nlohmann::json relight = nlohmann::json::array();
  for (const RelightTimes& times : figures.times) relight.push_back(toJson(times));
  return {{"cells", figures.options.cells},
          {"cascades", figures.options.cascades},
          {"rays", figures.options.rays},
          {"voxels", figures.voxels},
          {"caches", figures.caches},
          {"edited", figures.edited},
          {"editedTriangles", figures.editedTriangles},
          {"relight", relight}};
}

}  // namespace relume
