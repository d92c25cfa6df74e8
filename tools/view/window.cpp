// SPDX-License-Identifier: MIT
// See window.h. The only file that includes GLFW.
#include <epoxy/gl.h>

#include "tools/base/printable.h"
#include "tools/view/input_events.h"
#include "tools/view/key_letters.h"
#include "tools/view/light_handles.h"
#include "tools/view/panel.h"
#include "tools/view/rest.h"
#include "tools/view/session.h"
#include "tools/view/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

bool isModifier(int key) { return key >= GLFW_KEY_LEFT_SHIFT && key <= GLFW_KEY_RIGHT_SUPER; }

// GLFW from init to terminate, with one window.
class Window {
 public:
  Status open(const ViewerOptions& options) {
    glfwSetErrorCallback([](int, const char* text) { lastError() = text; });
    started_ = glfwInit() == GLFW_TRUE;
    if (!started_) return Error{ErrorCode::unsupported, "no display: " + lastError() + " (--headless needs none)"};
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    window_ =
        glfwCreateWindow(static_cast<int>(options.width), static_cast<int>(options.height), "Relume", nullptr, nullptr);
    if (!window_) return Error{ErrorCode::unsupported, "no window with OpenGL 4.3: " + lastError()};
    glfwMakeContextCurrent(window_);
    glfwSwapInterval(1);
    // Before those of Dear ImGui, which calls what is there.
    glfwSetWindowUserPointer(window_, this);
    glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int button, int action, int mods) {
      if (button != GLFW_MOUSE_BUTTON_LEFT) return;
      // glfwGetCursorPos() has where the mouse is now, which after a slow frame is not where the button went down.
      const auto kind = action == GLFW_PRESS ? InputEvent::Kind::press : InputEvent::Kind::release;
      of(w).events_.push_back({.kind = kind, .at = of(w).mouse_, .mods = mods});
    });
    glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double x, double y) {
      of(w).mouse_ = glm::vec2(x, y);
      of(w).events_.push_back({.at = of(w).mouse_});
    });
    glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double y) {
      of(w).events_.push_back({.kind = InputEvent::Kind::scroll, .at = of(w).mouse_, .notches = static_cast<float>(y)});
    });
    glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** paths) {
      of(w).events_.push_back({.kind = InputEvent::Kind::drop, .paths = {paths, paths + count}});
    });
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    ImGui::GetIO().ConfigWindowsMoveFromTitleBarOnly = true;
    ImGui_ImplGlfw_InitForOpenGL(window_, true);
    ImGui_ImplOpenGL3_Init("#version 430");
    gui_ = true;
    // In place of those of Dear ImGui, which is handed keys and characters frame by frame.
    glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int scancode, int action, int mods) {
      if (action == GLFW_REPEAT) return;
      const auto kind = action == GLFW_PRESS ? InputEvent::Kind::key : InputEvent::Kind::keyRelease;
      // Commands go by the letter on the key, flight by where the key is.
      const int letter = lettered(key, glfwGetKeyName(key, scancode));
      of(w).events_.push_back(
          {.kind = kind, .key = key, .mods = mods, .letter = letter, .isModifier = isModifier(key)});
      if (action == GLFW_PRESS && (mods & GLFW_MOD_CONTROL) == 0) of(w).held_.insert(key);
      if (action == GLFW_RELEASE) of(w).held_.erase(key);
    });
    glfwSetCharCallback(window_, [](GLFWwindow* w, unsigned int character) {
      of(w).events_.push_back({.kind = InputEvent::Kind::character, .character = character});
    });
    return done();
  }
  ~Window() {
    if (gui_) {
      ImGui_ImplOpenGL3_Shutdown();
      ImGui_ImplGlfw_Shutdown();
      ImGui::DestroyContext();
    }
    if (window_) glfwDestroyWindow(window_);
    if (started_) glfwTerminate();
  }
  Window() = default;
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  GLFWwindow* get() const { return window_; }
  // Whether a key is down that was pressed without Control: one with it is a command until it is released, whichever of
  // the two is released first.
  bool isHeld(int key) const { return held_.contains(key); }
  // Wait for what happens, at most so long [s]; whether something has.
  static bool waitFor(double seconds) {
    const double begin = glfwGetTime();
    glfwWaitEventsTimeout(seconds);
    return glfwGetTime() - begin < 0.9 * seconds;
  }
  // Whether keys are down, or what happened has not been handled.
  bool isInUse() const { return !events_.empty() || !held_.empty(); }
  // What is to be handled in this frame, in its order.
  std::vector<InputEvent> takeEvents() {
    const auto end = events_.begin() + static_cast<std::ptrdiff_t>(eventsOfFrame(events_));
    std::vector<InputEvent> taken(events_.begin(), end);
    events_.erase(events_.begin(), end);
    for (const InputEvent& e : taken) {
      const bool isButton = e.kind == InputEvent::Kind::press || e.kind == InputEvent::Kind::release;
      if (isButton) isDown_ = e.kind == InputEvent::Kind::press;
      if (isButton || e.kind == InputEvent::Kind::move) handledMouse_ = e.at;
    }
    return taken;
  }
  // Mouse and button after these, for Dear ImGui in place of those that are by now.
  void replayMouse() const {
    ImGuiIO& io = ImGui::GetIO();
    if (io.MousePos.x < -1e30f) return;  // the window has not the focus
    io.MousePos = {handledMouse_.x, handledMouse_.y};
    io.MouseDown[0] = isDown_;
  }

 private:
  static Window& of(GLFWwindow* window) { return *static_cast<Window*>(glfwGetWindowUserPointer(window)); }
  static std::string& lastError() {
    static std::string text;
    return text;
  }
  GLFWwindow* window_ = nullptr;
  std::vector<InputEvent> events_;
  std::set<int> held_;
  glm::vec2 mouse_{0.0f}, handledMouse_{0.0f};  // [pixel]
  bool isDown_ = false;                         // the left button, as far as it has been handled
  bool started_ = false, gui_ = false;
};

// Keys and mouse move the camera while the panel does not want them. speed: [m/s].
void fly(const Window& window, float speed, FlyCamera& camera, float seconds, glm::dvec2& cursor) {
  glm::dvec2 now;
  glfwGetCursorPos(window.get(), &now.x, &now.y);
  const glm::vec2 moved(now - cursor);
  cursor = now;
  const ImGuiIO& io = ImGui::GetIO();
  if (!io.WantCaptureMouse && glfwGetMouseButton(window.get(), GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS)
    camera.turn(-0.004f * moved.x, -0.004f * moved.y);
  if (io.WantTextInput) return;  // while a number is typed, keys are its own
  const auto axis = [&](int plus, int minus) { return static_cast<float>(window.isHeld(plus) - window.isHeld(minus)); };
  const float way = seconds * speed * (window.isHeld(GLFW_KEY_LEFT_SHIFT) ? FlySpeed::kFast : 1.0f);  // [m]
  camera.move(way *
              glm::vec3(axis(GLFW_KEY_D, GLFW_KEY_A), axis(GLFW_KEY_E, GLFW_KEY_Q), axis(GLFW_KEY_W, GLFW_KEY_S)));
}

// The command of a key, by lettered().
std::optional<Command> commandOf(int key, int mods) {
  const bool control = (mods & GLFW_MOD_CONTROL) != 0, shift = (mods & GLFW_MOD_SHIFT) != 0;
  if (control) {
    if (key == GLFW_KEY_Z) return shift ? Command::redo : Command::undo;
    if (key == GLFW_KEY_Y) return Command::redo;
    if (key == GLFW_KEY_S) return Command::saveLights;
    if (key == GLFW_KEY_O) return Command::loadLights;
    if (key == GLFW_KEY_D) return Command::duplicateLight;
    return std::nullopt;
  }
  if (key == GLFW_KEY_DELETE) return Command::removeLight;
  if (key == GLFW_KEY_ESCAPE) return Command::cancel;
  if (key == GLFW_KEY_TAB) return Command::togglePanel;
  if (key == GLFW_KEY_G) return Command::toggleHandles;
  if (key == GLFW_KEY_F12) return Command::screenshot;
  if (key == GLFW_KEY_F11) return Command::film;
  return std::nullopt;
}

// Hands what happened to the session, and keys to Dear ImGui as well.
void handle(const InputEvent& event, GLFWwindow* window, Session& session) {
  const bool isTyping = ImGui::GetIO().WantTextInput && ImGui::IsAnyItemActive();
  const bool isList = ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel);
  switch (event.kind) {
    case InputEvent::Kind::press:
      if (!isList) session.press(event.at);
      return;
    case InputEvent::Kind::scroll:
      if (!isList) session.scroll(event.at, event.notches);
      return;
    case InputEvent::Kind::move:
      return session.move(event.at);
    case InputEvent::Kind::release:
      return session.release();
    case InputEvent::Kind::drop:
      return session.drop(event.paths);
    case InputEvent::Kind::key:
      ImGui_ImplGlfw_KeyCallback(window, event.key, 0, GLFW_PRESS, event.mods);
      // While a text is typed, keys are its own. The flag still stands in the frame after the one that ended it.
      if (const auto command = commandOf(event.letter, event.mods); command && !isTyping) session.run(*command);
      return;
    case InputEvent::Kind::keyRelease:
      return ImGui_ImplGlfw_KeyCallback(window, event.key, 0, GLFW_RELEASE, event.mods);
    case InputEvent::Kind::character:
      return ImGui_ImplGlfw_CharCallback(window, event.character);
  }
}

// How long a level without a bake takes from the program's start until it is lit.
class FirstLight {
 public:
  explicit FirstLight(std::chrono::steady_clock::time_point begin) : last_(begin) {}

  // What has been done since the step before.
  void step(const char* name) {
    const auto now = std::chrono::steady_clock::now();
    steps_.emplace_back(name, std::chrono::duration<double>(now - last_).count());
    last_ = now;
  }
  // Tell it, once, when the first frame with indirect light is on the screen.
  void tell(const Viewer& viewer) {
    const LiveShading* const live = viewer.live();
    if (isTold_ || !live || live->last().number == 0) return;
    isTold_ = true;
    step("frames");
    double sum = 0.0;
    for (const auto& [name, seconds] : steps_) sum += seconds;
    std::printf("indirect light after %.2f s:", sum);
    for (const auto& [name, seconds] : steps_) std::printf("  %s %.2f", name, seconds);
    std::printf("; meanwhile, ms:");
    for (const PassTime& pass : live->passTimes()) std::printf("  %s %.0f", pass.pass, pass.ms);
    std::printf("\n");
    std::fflush(stdout);
  }

 private:
  std::chrono::steady_clock::time_point last_;
  std::vector<std::pair<const char*, double>> steps_;
  bool isTold_ = false;
};

void loop(Window& window, Session& session, FirstLight& firstLight) {
  double last = glfwGetTime();
  glm::dvec2 cursor(0.0);
  glfwGetCursorPos(window.get(), &cursor.x, &cursor.y);
  Rest rest;
  const LoadedLevel* shown = nullptr;
  while (!glfwWindowShouldClose(window.get())) {
    bool isBusy = false;
    if (rest.isDue()) {
      isBusy = Window::waitFor(rest.step());
    } else {
      glfwPollEvents();
    }
    isBusy = isBusy || window.isInUse();
    const double now = glfwGetTime();
    ViewState& state = session.state;
    fly(window, session.flySpeed.metresPerSecond(), state.camera, static_cast<float>(session.frameSeconds(now - last)),
        cursor);
    last = now;
    int windowWidth = 0, windowHeight = 0, width = 0, height = 0;
    glfwGetWindowSize(window.get(), &windowWidth, &windowHeight);
    glfwGetFramebufferSize(window.get(), &width, &height);
    session.beginFrame(now, glm::vec2(windowWidth, windowHeight));
    for (const std::string& warning : std::exchange(session.warnings, {}))
      std::fprintf(stderr, "relume-view: warning: %s\n", printableLines(warning).c_str());
    for (const InputEvent& event : window.takeEvents()) handle(event, window.get(), session);
    if (session.viewer) animate(state, session.animationTime(), session.viewer->levelSize());
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    window.replayMouse();
    ImGui::NewFrame();
    drawPanel(session);
    session.endControls(ImGui::IsAnyItemActive());
    if (state.handles && session.level) {
      drawLightHandles(session.editor, state.lights, session.pixels(), session.mouse);
      drawObjectHandles(session.objects, state.objects, session.pixels(), session.mouse);
    }
    if (width > 0 && height > 0) session.draw(0, static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height));
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    glfwSwapBuffers(window.get());
    if (session.viewer) firstLight.tell(*session.viewer);
    const LoadedLevel* const before = std::exchange(shown, session.level.get());
    if (shown && before != shown) glfwSetWindowTitle(window.get(), titleOf(*shown).c_str());
    rest.frame(now, isBusy || before != shown || session.isMoving() || ImGui::IsAnyItemActive());
  }
}

}  // namespace

Status runWindow(Scene scene, LevelPtr level, const ViewerOptions& options) {
  auto state = initialState(level ? level->scene : scene, options);
  if (!state) return state.error();
  FirstLight firstLight(options.begin);
  firstLight.step("read");
  Window window;
  if (Status ok = window.open(options); !ok) return ok;
  if (epoxy_gl_version() < 43)
    return Error{ErrorCode::unsupported, "OpenGL 4.3 expected, " + std::to_string(epoxy_gl_version()) + " found"};
  firstLight.step("window");
  ViewerOptions chosen = options;
  const BackendKind faster = LiveCachesGl::fasterBackend(glfwGetProcAddress);
  if (options.choosesLiveBackend) chosen.live.backend = faster;
  state->live = chosen.live;
  // Where a processor draws, objects that shadow light over links take several frames' time: when they are asked for.
  state->movingParts = faster == BackendKind::gl;
  Session session(std::move(*state), chosen, glfwGetProcAddress);
  if (faster == BackendKind::cpu) session.coarse.expectSlow();
  if (level) {
    if (Status ok = session.show(std::move(level)); !ok) return ok;
    std::printf("bands %s\n", session.viewer->bands().c_str());
  } else {
    session.begin({options.scene, "", options.sceneOptions, options.allowStale, options.driven,
                   presetOptions(Preset::draft), options.edit},
                  std::move(scene));
  }
  firstLight.step("upload");
  loop(window, session, firstLight);
  return done();
}

}  // namespace relume
