// SPDX-License-Identifier: MIT
// What the window is busy with: the level it shows, how it shows it, and the edits of its lights. Commands of keys, the
// panel and dropped files end here; window.h feeds it, the panel draws it.
#pragma once

#include "tools/view/capture.h"
#include "tools/view/coarse_frames.h"
#include "tools/view/file_watch.h"
#include "tools/view/fly_speed.h"
#include "tools/view/gizmo.h"
#include "tools/view/level_job.h"
#include "tools/view/light_editor.h"
#include "tools/view/loaded_level.h"
#include "tools/view/messages.h"
#include "tools/view/object_editor.h"
#include "tools/view/options.h"
#include "tools/view/reference_job.h"
#include "tools/view/time_history.h"
#include "tools/view/view_edits.h"
#include "tools/view/view_state.h"
#include "tools/view/viewer.h"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace relume {

enum class Command {
  undo,
  redo,
  saveLights,
  loadLights,
  removeLight,
  duplicateLight,
  cancel,
  togglePanel,
  toggleHandles,
  screenshot,
  film
};

// A rectangle of the window that the panel covers [pixel].
struct PixelBox {
  glm::vec2 low{0.0f}, high{0.0f};
  bool holds(const glm::vec2& p) const { return p.x >= low.x && p.y >= low.y && p.x < high.x && p.y < high.y; }
};

class Session {
 public:
  // `first`: what the first level is shown with. getProcAddress: of the context, which is current for the session's
  // life.
  Session(ViewState first, const ViewerOptions& options, GetProcAddress getProcAddress);

  // Show a level. Another bake of the level that is shown takes over its light, its camera and what was edited; lights
  // and emitters that were not are those of the level's file. Errors of Viewer and initialState(): what is shown stays.
  Status show(LevelPtr next);
  // Begin to load or bake a level; what was being loaded is cancelled. `scene`: loadScene() of it, where that is done.
  void begin(LevelFiles files, std::optional<Scene> scene = {});
  // Files that were dropped on the window together: a level, which is baked at preset draft, and lit without a bake
  // until then where the window's first level is; a bake of it, of the level that is on its way, or of the one that is
  // shown; a list of lights.
  void drop(const std::vector<std::string>& paths);

  // Begin to bake the level that is shown, in memory, while its light goes on: at preset draft, or by the options of
  // its bake but for the kind of the links.
  void bakeDraft();
  void bakeLinks(LinkKind kind);

  // Begin to hold the view against a path-traced one; `heat` has it when it is done.
  void compareWithReference();

  void run(Command command);
  void addLight(LightKind kind);
  // The left button at a pixel of the window.
  void press(const glm::vec2& pixel);
  void move(const glm::vec2& pixel);
  void release();
  // The wheel, so many notches, at a pixel: how fast the camera flies.
  void scroll(const glm::vec2& pixel, float notches);

  // Once a frame: `now` [s], the window's size [pixel]. Looks after the job and the bake's file.
  void beginFrame(double now, const glm::vec2& windowSize);
  // Whether a control of the panel is held: what it changes is an edit once it is let go.
  void endControls(bool isHeld);
  // The level into a framebuffer; black where there is none yet. What goes wrong is shown as a message.
  void draw(GLuint framebuffer, std::uint32_t width, std::uint32_t height);

  // Whether what is drawn changes by itself: light that settles or moves, a film.
  bool isMoving() const;
  // [s] That moving things are at: the clock's, or a film's own.
  double animationTime() const { return animation_; }
  // [s] That they go on by in a frame which took so long by the clock.
  double frameSeconds(double clockSeconds) const {
    return capture_.isFilming() ? Capture::kFrameSeconds : clockSeconds;
  }
  const Capture& capture() const { return capture_; }

  const PixelView& pixels() const { return pixels_; }
  void say(Severity severity, std::string text) { messages.say(severity, std::move(text), now_); }

  LevelPtr level;                         // null until the first is there
  std::optional<Viewer> viewer;           // of it
  std::optional<LevelJob> job;            // that runs
  std::optional<ReferenceJob> reference;  // likewise
  std::optional<HeatPicture> heat;        // of the view that was compared last
  GlTexture heatTexture;                  // that shows it
  ViewState state;
  FlySpeed flySpeed;  // in the level
  LightEditor editor;
  ObjectEditor objects;  // of a level without a bake
  ViewEdits edits;       // of all that the state has
  Messages messages;
  TimeHistory times;  // of the last frames' passes
  CoarseFrames coarse;
  std::vector<std::string> warnings;  // about levels, for the terminal: too many for the window
  std::string lightsFile;             // that lights are saved to and loaded from
  std::vector<PixelBox> covered;      // by the panel, in the last frame
  glm::vec2 mouse{-1.0f};
  std::optional<std::size_t> shownLight, shownObject;  // id, index of those whose controls the panel had last

 private:
  static constexpr const char* kLightsFile = "lights.json";

  bool isCovered(const glm::vec2& pixel) const;
  void saveLights();
  void loadLights(const std::string& path);
  void duplicateLight();
  void cancelDrags();
  void tellSwitchedOff(std::size_t lights);
  void commit();
  LevelFiles filesOf(const std::string& scene, const std::string& bake) const;
  void relightAsChosen();
  void recordsAsChosen();
  bool drawView(GLuint framebuffer, std::uint32_t width, std::uint32_t height);
  void finishJob();
  void finishReference();
  void watchBake();

  void pick(const glm::vec3& pointWorld);
  void toggleFilm();
  void takePictures(std::uint32_t width, std::uint32_t height);
  void refusePictures();

  ViewerOptions options_;   // for levels that are yet to come
  bool bakesAtOnce_;        // whether levels that are dropped are baked before they are shown
  bool draftNext_ = false;  // the level that is loaded was dropped, and is to be baked once it is shown
  GetProcAddress getProcAddress_;
  FileWatch watch_;
  std::optional<glm::vec2> pick_;  // [pixel] whose surface, or object, is to be picked in the next frame
  PixelView pixels_;
  double now_ = 0.0, animation_ = 0.0;  // [s]
  Capture capture_;
  std::set<std::filesystem::path> ownLights_;  // files of lights that were loaded or saved while this level is shown
  bool screenshotWanted_ = false;
};

}  // namespace relume
